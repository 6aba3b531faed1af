"""Result classes of the Python interface. Notebooks display the results, and data frames can be made from them."""

import json
import os
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property, partial
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, ClassVar

from bisar_budget import __version__, notebook
from bisar_budget.arrays import Complexes
from bisar_budget.faults import SetValue
from bisar_budget.findings.images import VerifiedMission
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.monte_carlo import MonteCarlo
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row, unknown_id
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.findings.status import exit_code
from bisar_budget.json_types import JsonDocument
from bisar_budget.mission.model import Mission
from bisar_budget.report import FORMATS, Style, content, format_of, pictures, render
from bisar_budget.report.answers import files, format_of_file, module_of, records_of, suffixes, written
from bisar_budget.report.words.sentences import waived_count
from bisar_budget.resources import special_file

if TYPE_CHECKING:
    from bisar_budget.findings.offer import Offer
    from bisar_budget.findings.satellite_passes import Passes, SatellitePass
    from bisar_budget.findings.slopes import Sensitivity
    from bisar_budget.findings.solution import Comparison, Solution
    from bisar_budget.simulator.point import PointImages


DataFrame = Any
"""A data frame of pandas or polars, neither of which has to be installed."""


class MissingPackageError(ImportError):
    """An optional package that a method of a result class needs is not installed; the message names the package."""


def frame_of(columns: Mapping[str, object], library: str | None = None) -> DataFrame:
    """Make a data frame of pandas or polars from columns.

    Parameters
    ----------
    columns : mapping
        Values of each column, by column name; all columns have the same length.
    library : str, optional
        `pandas` or `polars`; by default the first of them that is installed.

    Raises
    ------
    MissingPackageError
        The requested library is not installed, or, if none is requested, neither library is.
    """
    libraries = (library,) if library else ("pandas", "polars")
    for name in libraries:
        if find_spec(name) is not None:
            return import_module(name).DataFrame(dict(columns))
    raise MissingPackageError(f"a data frame needs {' or '.join(libraries)}: pip install {libraries[0]}")


def _frame_of_rows(rows: Sequence[Mapping[str, object]], library: str | None) -> DataFrame:
    """Make a data frame from rows that map column names to values; the keys of the first row are the columns."""
    return frame_of({key: [row.get(key) for row in rows] for key in (rows[0] if rows else ())}, library)


class Picture:
    """A drawing that notebooks display.

    The method `save` writes the drawing to a file. The argument `draw` is stored as the attribute `of`.

    Parameters
    ----------
    title : str
        Title of the drawing.
    draw : callable
        Function that takes the kind of file, `svg`, `png` or `pdf`, and returns the content of such a file as bytes.
    """

    def __init__(self, title: str, draw: Callable[[str], bytes]) -> None:
        self.title, self.of = title, draw

    def __repr__(self) -> str:
        """Text on one line with the title of the drawing."""
        return f"Picture({self.title!r})"

    def _repr_html_(self) -> str:
        return notebook.page(self.of("svg").decode())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the drawing to a file with the suffix .svg, .png or .pdf.

        Raises
        ------
        ValueError
            The name has another suffix.
        """
        kind = os.path.splitext(os.fspath(path))[1][1:].lower()
        if kind not in ("svg", "png", "pdf"):
            raise ValueError(f"{os.fspath(path)}: the suffix must be one of .svg, .png, .pdf")
        write_file(os.fspath(path), self.of(kind))


def write_file(path: str, content: bytes) -> None:
    """Write bytes to a regular file.

    Raises
    ------
    ValueError
        The path is a named pipe, a socket or a device, to which writing could block.
    """
    if kind := special_file(path):
        raise ValueError(f"cannot write {path}: {kind}; accepted: a regular file")
    with open(path, "wb") as file:
        file.write(content)


# ---------------------------------------------------------------------- a check
@dataclass(frozen=True, repr=False, eq=False)
class CheckResult(Mapping[str, Row]):
    """Result of `check`: a mapping of row ids to rows, in the order of the JSON report.

    `findings` contains everything that the reports show. `model` is the argument `model` of `check`, and `day` is the
    date for which the waivers were judged.
    """

    findings: MissionFindings
    model: str | None
    day: date

    def __repr__(self) -> str:
        """Text on one line with the name of the mission, its status and the number of rows of each status."""
        counts = ", ".join(f"{count} {status}" for status, count in self.findings.summary.items())
        return f"<check of {self.findings.name!r}: {self.status}; {counts}>"

    def __getitem__(self, row_id: str) -> Row:
        """Return the row with the id `row_id`, such as `receiver.velocity.y`."""
        try:
            return self._rows[row_id]
        except KeyError:
            raise KeyError(f"{row_id}: {unknown_id(row_id, self._rows, self.findings.file)}") from None

    def __iter__(self) -> Iterator[str]:
        """Iterate over the ids of the rows."""
        return iter(self._rows)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self._rows)

    @cached_property
    def _rows(self) -> Mapping[str, Row]:
        return {row.id: row for row in self.findings.rows}

    @property
    def status(self) -> str:
        """Verdict on the mission: fail, not_evaluated, waived, warn, pass_with_autofocus or pass."""
        return self.findings.status

    @property
    def waived_by(self) -> tuple[str, ...]:
        """Ids of the waivers for rows or requirements, written as in the mission file, such as `receiver.*`."""
        return tuple(waiver.id for waiver in self.findings.waived_by)

    @property
    def exit_code(self) -> int:
        """Exit code of `bisar-budget check`: 0 if every requirement is judged, and is met or waived; otherwise 1."""
        return exit_code({self.status}, False)

    @property
    def requirements(self) -> Mapping[str, JudgedRequirement]:
        """Requirements of the mission file by key; each has its status and the row that determines this status."""
        return {requirement.key: requirement for requirement in self.findings.requirements}

    def to_dict(self) -> JsonDocument:
        """Return the document that `check --format json` writes, as a dictionary."""
        document: JsonDocument = json.loads(render("json", self._report, Style()))
        return document

    def to_dataframe(self, library: str | None = None) -> DataFrame:
        """Return the rows as a data frame of pandas or polars; numbers are in SI and radians.

        Raises
        ------
        MissingPackageError
            The requested library is not installed, or, if none is requested, neither library is.
        """
        (mission,) = self.to_dict()["missions"]
        rows = [{key: value for key, value in row.items() if key not in _NESTED} for row in mission["rows"]]
        return _frame_of_rows(rows, library)

    def report(self, path: str | os.PathLike[str], detail: str = "summary") -> None:
        """Write a report; the suffix .html, .md, .json, .csv, .xlsx, .xml, .sarif or .txt selects the format.

        Parameters
        ----------
        path : path
            Path of the file. Pictures of a .md report are written to a folder next to it.
        detail : str
            `summary`, or `full` for a report with its annex.

        Raises
        ------
        ValueError
            There is no report format with this suffix.
        MissingExtraError
            The format needs a package that is not installed.
        """
        name = os.fspath(path)
        form = format_of(name)
        if form is None:
            suffixes = ", ".join(suffix for known_format in FORMATS.values() for suffix in known_format.suffixes)
            raise ValueError(f"{name}: the suffix must be one of {suffixes}")
        folder = f"{os.path.splitext(name)[0]}.assets" if FORMATS[form].has_pictures else ""
        style, shown = Style(detail=detail, assets=os.path.basename(folder)), self._report
        if FORMATS[form].is_illustrated:
            from bisar_budget.questions.checks import with_sheets, with_work_trees

            missions = tuple(with_sheets(shown.missions, self.model, self.day))
            shown = with_work_trees(shown._replace(missions=missions))
        data = content(form, shown, style)
        for picture, drawing in pictures(form, shown, style).items():
            os.makedirs(folder, exist_ok=True)
            write_file(os.path.join(folder, picture), drawing)
        write_file(name, data)

    @property
    def _report(self) -> Report:
        return Report(version=__version__, missions=(self.findings,))

    def _repr_html_(self) -> str:
        from bisar_budget.report.answers.check_answer import brief
        from bisar_budget.report.renderers.notebook_fragment import fragment

        return fragment(brief(self.findings))


_NESTED = ("displacement_m", "notes", "requirement_ids")  # fields of a row that fit in no cell of a table


# ---------------------------------------------------------------------- answers to other questions
class AnswerResult:
    """Base class of results that can be written in every output format of a command.

    The class attribute `COMMAND` is the name of the command, such as `solve`.
    """

    COMMAND: ClassVar[str] = ""

    @property
    def answers(self) -> Sequence[object]:
        """The result in the form that the command's module in `report.answers` accepts."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        from bisar_budget.report.renderers.notebook_fragment import fragment

        return fragment(module_of(self.COMMAND).document(self.answers, Style()))

    def to_dict(self) -> JsonDocument:
        """Return the document that the corresponding command writes with `--format json`, as a dictionary."""
        document: JsonDocument = json.loads(written(self.COMMAND, "json", self.answers, Style()))
        return document

    def to_dataframe(self, library: str | None = None) -> DataFrame:
        """Return the lines that the command writes with `--format csv`, as a data frame of pandas or polars.

        Numbers are in SI and radians.

        Raises
        ------
        MissingPackageError
            The requested library is not installed, or, if none is requested, neither library is.
        """
        records = records_of(self.COMMAND, self.answers)
        return frame_of({name: records.column(name) for name in records.columns}, library)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the result to a file; its suffix selects the format, such as .html, .md, .json, .csv, .xlsx or .txt.

        Drawings of a .md file are written to a folder next to it.

        Raises
        ------
        ValueError
            The command has no output format with this suffix.
        MissingExtraError
            The format needs a package that is not installed.
        """
        name = os.fspath(path)
        form = format_of_file(self.COMMAND, name)
        if form is None:
            raise ValueError(f"{name}: the suffix must be one of {', '.join(suffixes(self.COMMAND))}")
        for file, data in files(self.COMMAND, form, self.answers, Style(), name).items():
            if folder := os.path.dirname(file):
                os.makedirs(folder, exist_ok=True)
            write_file(file, data if isinstance(data, bytes) else data.encode())


@dataclass(frozen=True, repr=False, eq=False)
class _FindingsResult(AnswerResult):
    """Base class of results that wrap the findings of an analysis.

    The findings are in the field `found`. All attributes of `found` are also attributes of the result.
    """

    found: Any

    def __getattr__(self, name: str) -> Any:
        """Return the attribute `name` of `found`; called only if the result itself does not have this attribute."""
        if name.startswith("_") or name == "found":
            raise AttributeError(name)
        return getattr(self.found, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self.found)} - set(dir(tuple)))

    @property
    def answers(self) -> Sequence[object]:
        """The findings `found` as the only entry of a list."""
        return [self.found]


def _waived(waivers: Sequence[Sequence[str]]) -> str:
    """Phrase with the number of waived cases and the ids of their waivers; empty if no case is waived.

    `waivers` contains the ids of the waivers for each waived case. The phrase begins with a comma.
    """
    ids = tuple(dict.fromkeys(waiver for case in waivers for waiver in case))
    return f", {waived_count(len(waivers), ids)}" if waivers else ""


class SolveResult(_FindingsResult):
    """Result of `solve`: the values of a key at which the mission begins or ceases to comply.

    If the value of the key is a number, the result has the attributes `value` in SI, `crossings`, `status` and
    `nearest`. If the key names a part of the catalogue, the attributes are `parts` (complying parts first),
    `complying` and `status`.
    """

    COMMAND: ClassVar[str] = "solve"
    found: "Solution | Comparison"

    def __repr__(self) -> str:
        """Text on one line with the mission, the key, the result of the search, and the number of waived cases.

        The result is a value, the number of complying parts, or a note that all or no values comply.
        """
        return f"<solve of {self.found.key} for {self.found.name!r}: {self._summary}>"

    @property
    def _summary(self) -> str:
        if (parts := getattr(self.found, "parts", None)) is not None:
            waived = [part.standing.waived_by for part in parts if part.standing.status == "waived"]
            return f"{len(self.complying)} of {len(parts)} parts comply{_waived(waived)}"
        waived_words = f", {waived_count(self.waived, self.waived_by)}" if self.waived else ""
        if self.value is None:
            return f"{'every' if self.status == 'all' else 'no'} value of the range complies{waived_words}"
        return f"{self.value:.6g} {self.unit}{waived_words}"


class SensitivityResult(_FindingsResult):
    """Result of `sensitivity`: the effect of each number of the mission on the worst utilization.

    The attribute `slopes` lists these effects, the largest first.
    """

    COMMAND: ClassVar[str] = "sensitivity"
    found: "Sensitivity"

    def __repr__(self) -> str:
        """Text on one line that names the number of the mission with the largest effect."""
        first = self.found.slopes[0].key if self.found.slopes else "none"
        return f"<sensitivity of {self.found.name!r}: {len(self.found.slopes)} numbers, first {first}>"

    def plot(self) -> Picture:
        """Draw a bar chart; the length of each bar is the effect of one number on the worst utilization."""
        from bisar_budget.report.drawing.figure import drawing_file
        from bisar_budget.report.drawing.tornado import tornado

        return Picture(f"sensitivity of {self.found.name}", partial(drawing_file, tornado(self.found)))


@dataclass(frozen=True, repr=False, eq=False)
class AllocateResult(_FindingsResult):
    """Result of `allocate`: specifications that together meet every requirement.

    The specification sheet `found` has the attributes `specifications`, `complies` and `requirements`, which are also
    attributes of the result. If `allocate` was given the mission of a supplier, `offer` compares the errors declared
    in that mission with the specifications; otherwise `offer` is None.
    """

    COMMAND: ClassVar[str] = "allocate"
    found: SpecificationSheet
    offer: "Offer | None" = None

    def __repr__(self) -> str:
        """Text on one line with the number of specifications, and whether the mission complies with them."""
        verdict_words = "complies" if self.found.complies else "does not comply"
        return f"<allocate of {self.found.name!r}: {len(self.found.specifications)} specifications, {verdict_words}>"

    @property
    def answers(self) -> Sequence[object]:
        """The pair of the specification sheet and the offer, as the only entry of a list."""
        return [(self.found, self.offer)]


class VerifyResult(_FindingsResult):
    """Result of `verify`, which checks limits by means of simulated images.

    The attribute `rows` has a verdict for each limit, and `status` summarizes the verdicts.
    """

    COMMAND: ClassVar[str] = "verify"
    found: VerifiedMission

    def __repr__(self) -> str:
        """Text on one line that states how many limits have each verdict."""
        counts = Counter(row.verdict for row in self.found.rows)
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        return f"<verify of {self.found.name!r}: {verdicts}>"


@dataclass(frozen=True, repr=False, eq=False)
class PassesResult(_FindingsResult):
    """Result of `passes`: a sequence of the passes of a satellite, each with a verdict on the mission.

    `mission` and `model` are the arguments of the function `passes`.
    """

    COMMAND: ClassVar[str] = "passes"
    found: "Passes"
    mission: Mission
    model: str | None = None

    def __repr__(self) -> str:
        """Text on one line with the total number of passes, and the numbers of complying and waived passes."""
        answer = self.found
        waived = _waived([each.waived_by for each in answer.found if each.status == "waived"])
        return f"<passes of {answer.name!r}: {len(answer.complying)} of {len(answer.found)} comply{waived}>"

    def __len__(self) -> int:
        """Number of passes."""
        return len(self.found.found)

    def __getitem__(self, index: int) -> "SatellitePass":
        """Return the pass at an index; the first pass has the index 0."""
        return self.found.found[index]

    def mission_text(self, satellite_pass: "SatellitePass", folder: str | os.PathLike[str]) -> str:
        """Text of a mission file in which the middle of the aperture is at the mid-time of a pass.

        File names in the text are relative to `folder`, the folder for the new mission file.
        """
        from bisar_budget.mission.edited import in_folder, with_values
        from bisar_budget.questions.passes import center_time

        of_model = [SetValue("allocation.model", self.model)] if self.model else []
        at_mid_time = [] if satellite_pass.center is None else center_time(satellite_pass.center)
        changes = [*self.mission.changes, *of_model, *in_folder(self.mission, os.fspath(folder)), *at_mid_time]
        return with_values(self.mission.data.decode("utf-8-sig"), changes)

    def plot(self) -> Picture:
        """Draw the tracks of the satellite in the sky of the scene, and the resolutions of the passes over time."""
        from bisar_budget.report.answers.passes_answer import verdict
        from bisar_budget.report.drawing.figure import drawing_file
        from bisar_budget.report.drawing.sky_plot import sky_plot

        title = f"Passes over the scene of {self.found.name}"
        return Picture(title, partial(drawing_file, sky_plot(self.found, title, verdict(self.found))))


class MonteCarloResult(_FindingsResult):
    """Result of `monte_carlo`: the probabilities that the requirements are met, each with a confidence interval.

    `probability` is the probability that all requirements are met together. `requirements` has the probability for
    each requirement.
    """

    COMMAND: ClassVar[str] = "monte_carlo"
    found: MonteCarlo

    def __repr__(self) -> str:
        """Text on one line with the number of draws, and the probability that all requirements are met."""
        answer = self.found
        if answer.probability is None:
            return f"<monte_carlo: {answer.draws} draws, no requirement to hold>"
        interval = f"{answer.probability_low:.4g} to {answer.probability_high:.4g}"
        return f"<monte_carlo: {answer.draws} draws, all hold in {answer.probability:.4g} ({interval})>"

    def to_dict(self) -> JsonDocument:
        """Return the Monte Carlo results as `check --monte-carlo --format json` writes them, as a dictionary."""
        return {key: value for key, value in super().to_dict().items() if key not in ("format", "version")}


class SimulateResult:
    """Result of `simulate`: images of a point, simulated with the declared errors.

    `image` is the image with these errors; `images` contains this and all other simulated images.
    """

    def __init__(self, images: "PointImages", mission: Mission) -> None:
        self.images, self._mission = images, mission

    def __repr__(self) -> str:
        """Text on one line with the shape of the image in pixels, and the pixel spacings."""
        x, y = self.images.scene_spacing
        return f"<simulate of {self._mission.name!r}: image {self.image.shape}, pixels {x:.3g} m by {y:.3g} m>"

    @property
    def image(self) -> Complexes:
        """Complex image (nx, ny) in the axes of the scene; x is east and y is north."""
        return self.images.in_scene

    def plot(self, *, paper: bool = False) -> Picture:
        """Draw the range error of the mission, the images before and after autofocus, and cuts through these images.

        If `paper` is True, figures and equations are numbered as in Rigling & Moses, Figures 3 to 7.
        """
        from bisar_budget.report.drawing.point_plot import drawn

        name = self._mission.name
        return Picture(name, lambda kind: drawn(self.images, name, kind, is_paper=paper))

    def _repr_html_(self) -> str:
        drawn = b64encode(self.plot().of("png")).decode()
        return notebook.page(f'<img alt="images of a point" src="data:image/png;base64,{drawn}">')
