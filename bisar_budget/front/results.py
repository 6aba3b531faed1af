"""Answers of the front door: data, a line of `repr`, a table or a drawing in a notebook, rows as a data frame."""

import json
import os
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from bisar_budget import __version__
from bisar_budget.design.cases import Grid
from bisar_budget.design.passes import Passes, SatellitePass
from bisar_budget.design.sensitivity import Sensitivity
from bisar_budget.design.solve import Solution
from bisar_budget.design.table import Part, Swept
from bisar_budget.findings.images import VerifiedMission
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.monte_carlo import MonteCarlo
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row, unknown_id, worst_first
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.findings.status import complying, exit_code
from bisar_budget.front import notebook
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.report import FORMATS, Style, format_of, pictures, render
from bisar_budget.report.words.requirements import declared_words, requirement_lines, verdict
from bisar_budget.report.words.sentences import allowable_words, matters, percent, row_size, shown_use

if TYPE_CHECKING:
    from bisar_budget.simulator.point import PointImages

_COMPLIES = ("fail", "pass")
_DECIDING = 12  # rows of a result that a notebook shows
_SHOWN = 10  # cases of a sweep without a drawing


class MissingPackageError(ImportError):
    """A package that an answer needs is not installed; the message says which."""


def frame_of(columns: Mapping[str, Any], library: str | None = None) -> Any:
    """A data frame of columns, of pandas or of polars.

    Parameters
    ----------
    columns : mapping
        Values of each column by its name, all of one length.
    library : str, optional
        `pandas` or `polars`; omitted: the first of them that is installed.

    Raises
    ------
    MissingPackageError
        It is not installed, or neither is.
    """
    wanted = (library,) if library else ("pandas", "polars")
    for name in wanted:
        if find_spec(name) is not None:
            return import_module(name).DataFrame(dict(columns))
    raise MissingPackageError(f"a data frame needs {' or '.join(wanted)}: pip install {wanted[0]}")


class Picture:
    """A drawing: a notebook shows it, `save` writes a file.

    Parameters
    ----------
    made : callable
        From a kind of file, `svg`, `png` or `pdf`, to its bytes.
    """

    def __init__(self, title: str, made: Callable[[str], bytes]) -> None:
        self.title, self._made = title, made

    def __repr__(self) -> str:
        """Its title, on one line."""
        return f"Picture({self.title!r})"

    def _repr_html_(self) -> str:
        return self._made("svg").decode()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file: .svg, .png or .pdf.

        Raises
        ------
        ValueError
            The name ends otherwise.
        """
        kind = os.path.splitext(os.fspath(path))[1][1:].lower()
        if kind not in ("svg", "png", "pdf"):
            raise ValueError(f"{os.fspath(path)}: the suffix must be one of .svg, .png, .pdf")
        with open(path, "wb") as file:
            file.write(self._made(kind))


def _as_png(png: bytes, words: str) -> str:
    return f'<img alt="{words}" src="data:image/png;base64,{b64encode(png).decode()}">'


# ---------------------------------------------------------------------- a check
@dataclass(frozen=True, repr=False, eq=False)
class CheckResult(Mapping[str, Row]):
    """Findings of a check: its rows by their ids, in the order of the contract.

    `findings` are all of them, as the reports have them.
    """

    findings: MissionFindings

    def __repr__(self) -> str:
        """Mission, status and how many rows have which, on one line."""
        counts = ", ".join(f"{count} {status}" for status, count in self.findings.summary.items())
        return f"<check of {self.findings.name!r}: {self.status}; {counts}>"

    def __getitem__(self, row_id: str) -> Row:
        """The row of an id, such as `receiver.velocity.y`."""
        try:
            return self._rows[row_id]
        except KeyError:
            raise KeyError(f"{row_id}: {unknown_id(row_id, self._rows, self.findings.file)}") from None

    def __iter__(self) -> Iterator[str]:
        """Ids of the rows."""
        return iter(self._rows)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self._rows)

    @cached_property
    def _rows(self) -> Mapping[str, Row]:
        return {row.id: row for row in self.findings.rows}

    @property
    def status(self) -> str:
        """Verdict of the mission: fail, not_evaluated, warn, pass_with_autofocus or pass."""
        return self.findings.status

    @property
    def exit_code(self) -> int:
        """Exit code of `bisar-budget check`: 0 all judged and met, 1 not."""
        return exit_code({self.status}, False)

    @property
    def requirements(self) -> Mapping[str, JudgedRequirement]:
        """Requirements of the file by their keys, each with its status and the row that decides it."""
        return {one.key: one for one in self.findings.requirements}

    def to_dict(self) -> dict[str, Any]:
        """The document of `--format json`."""
        found: dict[str, Any] = json.loads(render("json", self._report, Style()))
        return found

    def to_dataframe(self, library: str | None = None) -> Any:
        """The rows as a data frame of pandas, or of polars; numbers in SI and radians.

        Raises
        ------
        MissingPackageError
            Neither is installed.
        """
        (mission,) = self.to_dict()["missions"]
        rows = [{key: value for key, value in row.items() if key not in _NESTED} for row in mission["rows"]]
        return frame_of({key: [row.get(key) for row in rows] for key in rows[0]}, library)

    def report(self, path: str | os.PathLike[str], detail: str = "summary") -> None:
        """Write a report, in the format of its suffix: .html, .md, .json, .csv, .xml, .sarif, .txt.

        Parameters
        ----------
        path : path
            Of the file; pictures of .md go to a folder beside it.
        detail : str
            `summary`, or `full` with the annex.

        Raises
        ------
        ValueError
            No format has the suffix.
        """
        name = os.fspath(path)
        form = format_of(name)
        if form is None:
            suffixes = ", ".join(suffix for one in FORMATS.values() for suffix in one.suffixes)
            raise ValueError(f"{name}: the suffix must be one of {suffixes}")
        folder = f"{os.path.splitext(name)[0]}.assets" if FORMATS[form].has_pictures else ""
        style = Style(detail=detail, assets=os.path.basename(folder))
        text = render(form, self._report, style)
        for picture, content in pictures(form, self._report, style).items():
            os.makedirs(folder, exist_ok=True)
            with open(os.path.join(folder, picture), "wb") as file:
                file.write(content)
        with open(name, "w", encoding="utf-8", newline="\n") as written:
            written.write(text)

    @property
    def _report(self) -> Report:
        return Report(version=__version__, missions=(self.findings,))

    def _repr_html_(self) -> str:
        found = self.findings
        required = [
            (
                one.name,
                one.allowed,
                one.reached,
                one.use,
                one.status,
                ", ".join(filter(None, (one.decided_by, one.remark))),
            )
            for one in requirement_lines(found)
        ]
        rows = [row for row in worst_first(found.rows) if matters(row) or found.is_empty]
        shown = [
            (
                row.id,
                "-" if row.declared is None else row_size(row.declared, row, found),
                allowable_words(row, found),
                _percent(shown_use(row)),
                row.status,
            )
            for row in rows[:_DECIDING]
        ]
        more = len(found.rows) - len(shown)
        return notebook.page(
            notebook.heading(found.status, found.name, verdict(found)),
            notebook.table(("requirement", "allowed", "reached", "use", "status", "decided by"), required),
            notebook.table(("row", "declared", "allowable", "use", "status"), shown),
            notebook.note(f"{declared_words(found.kinds)} {more} rows more: to_dataframe()."),
        )


_NESTED = ("displacement_m", "notes")  # of a row: no cells of a table
_SPECIFIED = ("key", "value", "ordered", "unit", "declared")


def _percent(part: float | None) -> str:
    return "-" if part is None else percent(part)


# ---------------------------------------------------------------------- answers to other questions
@dataclass(frozen=True, repr=False, eq=False)
class _Answer:
    """An answer that a command writes as JSON; its own attributes are those of what was found."""

    found: Any

    def __getattr__(self, name: str) -> Any:
        """An attribute of what was found."""
        if name.startswith("_") or name == "found":
            raise AttributeError(name)
        return getattr(self.found, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self.found)} - set(dir(tuple)))

    def _document(self) -> str:
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """The document of `--format json` of the command."""
        found: dict[str, Any] = json.loads(self._document())
        return found


class SolveResult(_Answer):
    """Values at which compliance begins or ends: `value` in SI, `crossings`, `status`, `nearest`."""

    found: Solution

    def __repr__(self) -> str:
        """Key and value, on one line."""
        value = "none" if self.found.value is None else f"{self.found.value:.6g} {self.found.unit}"
        return f"<solve of {self.found.key} for {self.found.name!r}: {value}>"

    def _document(self) -> str:
        from bisar_budget.report.formats.answers import as_json

        return as_json(__version__, [self.found])

    def _repr_html_(self) -> str:
        found = self.found
        rows = [
            (one.inside.value, one.inside.row or "", _percent(one.inside.utilization), one.outside.row or "")
            for one in found.crossings
        ]
        return notebook.page(
            notebook.heading(_COMPLIES[found.status != "none"], f"{found.key} of {found.name}", found.status),
            notebook.table((f"complies at [{found.unit}]", "worst row", "use", "breaks beyond by"), rows),
        )


class SensitivityResult(_Answer):
    """What each number does to the worst utilization: `slopes`, ranked."""

    found: Sensitivity

    def __repr__(self) -> str:
        """The number that matters most, on one line."""
        first = self.found.slopes[0].key if self.found.slopes else "none"
        return f"<sensitivity of {self.found.name!r}: {len(self.found.slopes)} numbers, first {first}>"

    def _document(self) -> str:
        from bisar_budget.report.formats.answers import as_json

        return as_json(__version__, [self.found])

    def plot(self) -> Picture:
        """The effects as bars."""
        from bisar_budget.report.drawing.tornado import tornado

        return Picture(f"sensitivity of {self.found.name}", lambda kind: tornado(self.found, kind))

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()


class AllocateResult(_Answer):
    """Specifications that together meet every requirement: `specifications`, `complies`, `requirements`."""

    found: SpecificationSheet

    def __repr__(self) -> str:
        """How many specifications, and whether the mission complies with them, on one line."""
        said = "complies" if self.found.complies else "does not comply"
        return f"<allocate of {self.found.name!r}: {len(self.found.specifications)} specifications, {said}>"

    def _document(self) -> str:
        from bisar_budget.report.formats import specification_sheet as sheets

        return sheets.as_json(__version__, [sheets.Answer(self.found)])

    def to_dataframe(self, library: str | None = None) -> Any:
        """The specifications as a data frame; numbers in SI, lists of three where axes differ."""
        (mission,) = self.to_dict()["missions"]
        rows = mission["specifications"]
        return frame_of({key: [row[key] for row in rows] for key in _SPECIFIED}, library)

    def _repr_html_(self) -> str:
        rows = [(one.key, one.text or "no limit") for one in self.found.specifications]
        return notebook.page(
            notebook.heading(_COMPLIES[self.found.complies], f"Specifications of {self.found.name}"),
            notebook.table(("key", "order at most"), rows),
        )


class VerifyResult(_Answer):
    """Verdicts of images on the limits: `rows`, `status`."""

    found: VerifiedMission

    def __repr__(self) -> str:
        """How many limits have which verdict, on one line."""
        counts = Counter(row.verdict for row in self.found.rows)
        said = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        return f"<verify of {self.found.name!r}: {said}>"

    def _document(self) -> str:
        from bisar_budget.report.formats.verification import as_json

        return as_json(__version__, [self.found])

    def to_dataframe(self, library: str | None = None) -> Any:
        """The verdicts as a data frame."""
        (mission,) = self.to_dict()["missions"]
        rows = mission["rows"]
        return frame_of({key: [row.get(key) for row in rows] for key in rows[0]} if rows else {}, library)

    def _repr_html_(self) -> str:
        rows = [(row.id, row.boundary_error, row.unit, row.verdict) for row in self.found.rows]
        return notebook.page(
            notebook.heading(self.found.status, f"Images at the limits of {self.found.name}"),
            notebook.table(("row", "limit", "unit", "verdict"), rows),
        )


class PassesResult(_Answer):
    """Passes of a satellite, each with the verdict of the mission then: a sequence of them."""

    found: Passes

    def __repr__(self) -> str:
        """How many passes comply, on one line."""
        found = self.found
        return f"<passes of {found.name!r}: {len(found.complying)} of {len(found.found)} comply>"

    def __len__(self) -> int:
        """Number of passes."""
        return len(self.found.found)

    def __getitem__(self, place: int) -> SatellitePass:
        """A pass, counted from 0."""
        return self.found.found[place]

    def _document(self) -> str:
        from bisar_budget.report.formats.pass_list import as_json

        return as_json(__version__, self.found)

    def to_dataframe(self, library: str | None = None) -> Any:
        """The passes as a data frame; angles in radians, lengths in metres, times as texts of UTC."""
        rows = self.to_dict()["passes"]
        return frame_of({key: [row.get(key) for row in rows] for key in rows[0]} if rows else {}, library)

    def plot(self) -> Picture:
        """Tracks in the sky, and resolutions over time."""
        from bisar_budget.report.drawing.figure import drawing_file
        from bisar_budget.report.drawing.sky_plot import sky_plot
        from bisar_budget.report.formats.pass_list import verdict

        svg = sky_plot(self.found, self.found.name, verdict(self.found))
        return Picture(self.found.name, lambda kind: drawing_file(svg, kind))

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()


class MonteCarloResult(_Answer):
    """How often each requirement holds: `probability`, `requirements`, each with its interval."""

    found: MonteCarlo

    def __repr__(self) -> str:
        """Draws and the probability of all requirements, on one line."""
        found = self.found
        if found.probability is None:
            return f"<monte_carlo: {found.draws} draws, no requirement to hold>"
        interval = f"{found.probability_low:.4g} to {found.probability_high:.4g}"
        return f"<monte_carlo: {found.draws} draws, all hold in {found.probability:.4g} ({interval})>"

    def to_dict(self) -> dict[str, Any]:
        """The same as `check --monte-carlo --format json` writes it."""
        from bisar_budget.report.formats.json_document import monte_carlo_item

        found: dict[str, Any] = json.loads(json.dumps(monte_carlo_item(self.found)))
        return found

    def _repr_html_(self) -> str:
        rows = [
            (one.id, one.probability, one.probability_low, one.probability_high) for one in self.found.requirements
        ]
        return notebook.page(
            notebook.table(("requirement", "holds in", "from", "to"), rows),
            notebook.note(f"{self.found.draws} draws, intervals of {100 * self.found.confidence:g} %"),
        )


class SimulateResult:
    """Images with the declared errors: `image` in the axes of the scene; `images` has all, and what explains them."""

    def __init__(self, images: "PointImages", mission: Mission) -> None:
        self.images, self._mission = images, mission

    def __repr__(self) -> str:
        """Shape and spacing of the image, on one line."""
        x, y = self.images.scene_spacing
        return f"<simulate of {self._mission.name!r}: image {self.image.shape}, pixels {x:.3g} m by {y:.3g} m>"

    @property
    def image(self) -> Any:
        """The image in the axes of the scene: (nx, ny) complex, along east and north."""
        return self.images.in_scene

    def plot(self) -> Picture:
        """The figures of the paper for this mission."""
        from bisar_budget.report.drawing.point_plot import drawn

        return Picture(self._mission.name, lambda kind: drawn(self.images, self._mission.name, kind))

    def _repr_html_(self) -> str:
        from bisar_budget.report.drawing.point_plot import drawn

        return notebook.page(_as_png(drawn(self.images, self._mission.name, "png"), "images of a point"))


# ---------------------------------------------------------------------- a sweep
@dataclass(repr=False, eq=False)
class SweepResult:
    """A mission checked for many values: its table, by `to_dataframe`, `to_xarray`, or as columns.

    Cases are those of `mission` with the values of `cases`; they are checked when they are first asked for.
    """

    mission: Mission
    cases: Grid
    _ask: Callable[[Sequence[str]], Swept]
    _columns: Sequence[str] = ()
    _parts: list[Part] = field(default_factory=list)

    def __repr__(self) -> str:
        """Keys, number of cases and how many comply, on one line."""
        keys = ", ".join(one.key for one in self.cases.varied)
        return f"<sweep of {self.mission.name!r} over {keys}: {self.summary}>"

    @cached_property
    def _swept(self) -> Swept:
        swept = self._ask(self._columns)
        self._parts = list(swept.parts)
        return replace(swept, parts=iter(()))

    def _again(self) -> Swept:
        swept = self._swept
        return replace(swept, parts=iter(self._parts))

    @cached_property
    def columns(self) -> Mapping[str, Any]:
        """Values of each column by its name, (cases,); what varies stands in the unit that it was asked for in."""
        from bisar_budget.report.tables import Described

        swept = self._again()
        described = Described(swept, self.cases, self.mission, __version__)
        parts = [described.values(part) for part in swept.parts]
        return {one.name: np.concatenate([part[one.name] for part in parts]) for one in described.columns}

    def __getitem__(self, name: str) -> Any:
        """Values of a column, (cases,)."""
        if name not in self.columns:
            raise KeyError(f"{name}: no such column; accepted: {', '.join(self.columns)}")
        return self.columns[name]

    @property
    def summary(self) -> str:
        """How many cases there are, and how many comply."""
        statuses = Counter(self["status"].tolist())
        return f"{self.cases.count} cases, {complying(statuses)} comply"

    def to_dataframe(self, library: str | None = None) -> Any:
        """The table as a data frame of pandas, or of polars: what `sweep` writes as CSV."""
        return frame_of({name: _plain(values) for name, values in self.columns.items()}, library)

    def to_xarray(self, chunks: Any = None) -> Any:
        """The table as `xarray.Dataset`, a dimension for each key, with units and long names (CF).

        Parameters
        ----------
        chunks : optional
            As `Dataset.chunk` takes them: arrays of Dask.

        Raises
        ------
        MissingTablesError
            xarray is not installed.
        """
        from bisar_budget.report.tables import dataset

        found = dataset(self._again(), self.cases, self.mission)
        return found if chunks is None else found.chunk(chunks)

    def plot(self, column: str | None = None) -> Picture:
        """One key as curves of utilization, two as a map of what complies.

        Parameters
        ----------
        column : str, optional
            Draw this column instead.

        Raises
        ------
        QuestionError
            There are more keys than a drawing has axes.
        """
        from functools import partial

        from bisar_budget.report.drawing.figure import drawing_file
        from bisar_budget.report.drawing.trade_drawing import head_of, trade_drawing
        from bisar_budget.report.drawing.trades import Gathered, check_plot, uses_of_rows
        from bisar_budget.report.tables import Described

        check_plot(self.cases, is_polar=False)

        def gathered(swept: Swept, more: Sequence[str] = (), drawn: str | None = None) -> Gathered:
            described = Described(swept, self.cases, self.mission, __version__)
            found = Gathered(described, ("binding_requirement", *more), column=drawn)
            for part in swept.parts:
                found.add(part)
            return found

        trade = gathered(self._again(), drawn=column).trade(is_polar=False)
        rows = uses_of_rows(trade, lambda columns: gathered(self._ask(columns), columns))
        keys = " and ".join(axis.key for axis in trade.axes)
        svg = trade_drawing(
            trade,
            rows,
            self.mission.file,
            f"Trade study: {keys}, {self.mission.name}",
            self.summary,
            above=head_of(trade, self.mission, is_polar=False),
        )
        return Picture(f"{keys}, {self.mission.name}", partial(drawing_file, svg))

    def _repr_html_(self) -> str:
        try:
            drawn = self.plot()._repr_html_()
        except QuestionError:
            names = list(self.columns)
            rows = zip(*(self.columns[name][:_SHOWN] for name in names), strict=True)
            drawn = notebook.table(names, rows)
        return notebook.page(drawn, notebook.note(f"{self.mission.name}: {self.summary}"))


def _plain(values: Any) -> Any:
    """Texts as a list, numbers as they are."""
    return values.tolist() if values.dtype == object else values
