"""Sphinx: what the program says of itself, written into the pages when they are built.

Words stand in the page, facts come from the program, and a directive that joins the two fails where one of them is
missing: a status without a meaning, the meaning of a key that no report has.
"""

import ast
import json
import math
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from blocks import ROOT
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from bisar_budget.catalogue import SYMBOLS
from bisar_budget.error_kinds.kind import AS_STATED, BOUND, NORMAL, PEAK_AMPLITUDE, RELATIVE_LEVEL, SourceKind
from bisar_budget.error_kinds.registry import kinds
from bisar_budget.findings.status import STATUS
from bisar_budget.mission import readers
from bisar_budget.mission.model import MISSION
from bisar_budget.mission.parts import PART_SECTIONS
from bisar_budget.phrases import CODES
from bisar_budget.report import FORMATS
from bisar_budget.units import DIMENSIONS

MISSIONS = ROOT / "specs" / "missions"
_SUBJECT = re.compile("^(Sentence for|Text after) ")  # of a docstring, before what the sentence is about
_QUANTITY = re.compile(r"\{(\w+)(?:[^{}]|\{\w+\})*\}")  # a field of a sentence, with its format


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a Markdown table."""
    lines = [list(heads)]
    lines += [["---"] * len(lines[0])]
    lines += [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


class Generated(SphinxDirective):
    """A part of a page that a function of this module writes as Markdown, from the words in the directive's body."""

    has_content = True
    optional_arguments = 1
    final_argument_whitespace = True
    write: Callable[["Generated"], str]
    folder: str  # of the finished site

    def run(self) -> list[nodes.Node]:
        """Write and parse it."""
        try:
            text = type(self).write(self)
        except ValueError as error:
            raise self.error(str(error)) from error
        return self.parse_text_to_nodes(text, allow_section_headings=True)

    def words(self) -> dict[str, str]:
        """The body: lines `name: meaning`; a line that is indented goes on with the one before."""
        found: dict[str, str] = {}
        name = ""
        for line in self.content:
            if line.startswith(" ") and name:
                found[name] += " " + line.strip()
            elif line.strip():
                name, _, meaning = line.partition(": ")
                found[name] = meaning.strip()
        return found


def joined(names: Iterable[str], words: Mapping[str, str], what: str) -> list[tuple[str, str]]:
    """Names with their words; raises a ValueError where one is without the other."""
    names = list(names)
    silent, unknown = [name for name in names if name not in words], [name for name in words if name not in names]
    if silent or unknown:
        raise ValueError(f"{what}: without a meaning here: {silent}; here and not in the program: {unknown}")
    return [(name, words[name]) for name in names]


# Statuses, formats, JSON


def statuses(directive: Generated) -> str:
    """Every status, worst first, with the words of the body."""
    rows = []
    for name, text in joined(STATUS, directive.words(), "statuses"):
        status = STATUS[name]
        code = "1" if status.fails else "1 with `--strict`" if status.fails_strict else "0"
        code = "2" if name == "error" else code
        rows.append((f"`{name}`", f"`{status.text}`", code if status.gates else "", text))
    return table(("status", "in the text", "exit code", "means"), rows)


def formats(directive: Generated) -> str:
    """Every format of a report, with the names of files that choose it."""
    rows = joined(FORMATS, directive.words(), "formats")
    ends = {name: ", ".join(f"`{suffix}`" for suffix in one.suffixes) for name, one in FORMATS.items()}
    return table(("`--format`", "`--report` with", "is"), [(f"`{name}`", ends[name], text) for name, text in rows])


def json_keys(directive: Generated) -> str:
    """Every key of `check --format json`, with type and an example, and the words of the body."""
    found: dict[str, Any] = {}
    for document in _documents():
        for path, value in _leaves(document, ()):
            if found.get(path) is None:
                found[path] = value
    parts = {path.rpartition(".")[0].removesuffix("[]") for path in found}
    found = {path: value for path, value in found.items() if path not in parts}  # a part that is null in one of them
    groups: dict[str, list[tuple[str, str, str]]] = {}
    for path, text in joined(found, directive.words(), "keys of the JSON"):
        part, _, key = path.rpartition(".")
        groups.setdefault(part, []).append((f"`{key}`", _example(found[path]), text))
    heads = ("key", "example", "means")
    return "\n".join(
        f"## {f'`{part}`' if part else 'The report'}\n\n{table(heads, rows)}" for part, rows in groups.items()
    )


@cache
def _documents() -> list[dict[str, Any]]:
    """Reports that between them have every part that a report can have."""
    checked = (
        ("specs/missions/one_stationary_spotlight.yaml", "--verify"),
        ("specs/missions/drones_same_gnss.yaml", "--monte-carlo", "1000"),
        (
            "specs/missions/tandem_x.yaml",
            "--set",
            "requirement_ids.receiver.velocity.x=SYS-1",
            "--set",
            "requirement_texts.SYS-1=The image is sharp.",
        ),
        (
            "specs/missions/drones_same_gnss.yaml",
            "--guard",
            "--set",
            "common_motion_error.position=0.5 m ± 20 %",
            "--set",
            "timing_error.quadratic=1e-13 1/s ± 10 %",
        ),
        ("specs/missions/gps_aircraft_direct_path.yaml",),
        ("specs/missions/sentinel1_aircraft_log.yaml",),
        ("specs/missions/uav_stim300.yaml",),
        ("no such file.yaml",),
        ("specs/missions/rigling_moses_section_v.yaml", "--set", "radar.bandwidth=200 m"),
    )
    texts = [_output("check", *arguments, "--format", "json") for arguments in checked]
    more = "scene: { radius: 250 m }\nwaivers: [{ id: timing.linear, until: 2000-01-01, reason: expired }]\n"
    text = (MISSIONS / "rigling_moses_section_v.yaml").read_text(encoding="utf-8") + more
    texts.append(_output("check", "-", "--set", "radar.bandwidth=200 MHz", "--format", "json", given=text))
    return [json.loads(text) for text in texts]


# Mappings whose keys are names of the mission or probabilities in percent.
_NAMED = ("summary", "requirement_texts", "percentiles", "percentiles_range", "percentiles_azimuth")


def _leaves(value: Any, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and not set(path[-1:]) & set(_NAMED):
        for key, item in value.items():
            yield from _leaves(item, (*path, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            yield from _leaves(item, (*path[:-1], f"{path[-1]}[]"))
    else:
        yield ".".join(path), value


def _example(value: Any) -> str:
    if isinstance(value, float):
        value = float(f"{value:.4g}")
    text = json.dumps(value, ensure_ascii=False)
    return f"`{text if len(text) < 40 else text[:36] + ' ...'}`"


def _output(*arguments: str, given: str = "") -> str:
    command = [sys.executable, "-m", "bisar_budget", *arguments]
    done = subprocess.run(command, cwd=ROOT, input=given, encoding="utf-8", capture_output=True, check=False)
    if done.returncode > 2:
        raise ValueError(done.stderr)
    return done.stdout


# The mission file


def mission_keys(_: Generated) -> str:
    """Every key of the mission file: what it takes, its default, its meaning; a section after the other."""
    return _sections(_all_sections())


def part_keys(_: Generated) -> str:
    """Every key of the file of a part, a kind after the other."""
    found: dict[str, readers.Section] = {}
    for kind, section in PART_SECTIONS.items():
        found[f"kind: {kind}"] = section
        # A section within it has its own file's place: `random[]`.
        found |= {path: inner for path, inner in _all_sections(section).items() if path}
    return _sections(found)


def _all_sections(root: readers.Section = MISSION) -> dict[str, readers.Section]:
    """Sections by the place where the file first has them, in the order of the file."""
    found: dict[str, readers.Section] = {}

    def walk(path: str, section: readers.Section) -> None:
        if any(section.kind is each.kind for each in found.values()):
            return
        path += ", second form" * (path in found)
        found[path] = section
        for name, key in section.keys.items():
            for reader in _forms(key.reader):
                mark = "[]" if isinstance(reader, readers.ListOf) else ""
                for inner in _entries(reader):
                    if isinstance(inner, readers.Section):
                        walk(f"{path}.{name}{mark}".lstrip("."), inner)

    walk("", root)
    return found


def _forms(reader: readers.Reader) -> list[readers.Reader]:
    if isinstance(reader, readers.OneOf):
        return [each for form in reader.forms for each in _forms(form)]
    return [reader]


def _entries(reader: readers.Reader) -> list[readers.Reader]:
    """Forms of each entry of a list; of anything else itself."""
    return _forms(reader.section) if isinstance(reader, readers.ListOf) else [reader]


def _sections(sections: Mapping[str, readers.Section]) -> str:
    parts = []
    places = {section.kind: path for path, section in sections.items()}
    for path, section in sections.items():
        rows = []
        for name, key in section.keys.items():
            inner = _inner(key.reader)
            takes = " or ".join(dict.fromkeys(_form(form) for form in _forms(key.reader)))
            for kind in inner:
                takes = re.sub(r"(?<!\[)section", f"[section](#{_anchor(places[kind])})", takes, count=1)
            means = key.description or " ".join(_first_line(kind) for kind in inner)
            rows.append((f"`{name}`", takes, _default(section, name), means))
        title, about = (f"`{path}`", _first_line(section.kind)) if path else ("The file", "")
        keys = table(("key", "takes", "default", "means"), rows)
        parts.append(f"({_anchor(path)})=\n\n## {title}\n\n{about}\n\n{keys}")
    return "\n".join(parts)


def _inner(reader: readers.Reader) -> list[type[Any]]:
    """The sections that a key takes."""
    forms = [entry for form in _forms(reader) for entry in _entries(form)]
    return [form.kind for form in forms if isinstance(form, readers.Section)]


def _anchor(path: str) -> str:
    return "key-" + re.sub(r"\W+", "-", path)


def _first_line(kind: type[Any]) -> str:
    return (kind.__doc__ or "").partition("\n")[0]


def _default(section: readers.Section, name: str) -> str:
    if name in section.required:
        return "required"
    value = section.defaults.get(name)
    reader = section.keys[name].reader
    if isinstance(reader, readers.Quantity) and isinstance(value, float):
        return _quantity(value, reader.dimension.si)
    return f"`{value}`" if isinstance(value, str | int) else ""


def _form(reader: readers.Reader) -> str:
    """What a key takes, in words: unit and range of a quantity, the words of a choice."""
    if isinstance(reader, readers.Quantity):
        return _range(reader)
    if isinstance(reader, readers.Triple):
        return f"{'one, or ' if reader.or_scalar else ''}`[a, b, c]`, each: {_range(reader.component)}"
    if isinstance(reader, readers.Choice):
        return ", ".join(f"`{name}`" for name in reader.names)
    if isinstance(reader, readers.TextList):
        return "list of texts"
    if isinstance(reader, readers.Words) and isinstance(reader.word, readers.Text):
        return "text, or a list of texts"
    if isinstance(reader, readers.Words):
        return "some of " + ", ".join(f"`{name}`" for name in reader.word.names)
    if isinstance(reader, readers.Whole):
        return f"whole number, {_quantity(reader.low, '')} to {_quantity(reader.high, '')}"
    if isinstance(reader, readers.ListOf):
        return f"list, each {' or '.join('a section' for _ in _entries(reader))}"
    words = {
        readers.Section: "section",
        readers.Version: "`1`",
        readers.Day: "date, such as `2027-03-31`",
        readers.Text: "text",
    }
    if isinstance(reader, readers.TextMap):
        return f"{reader.of}: text"
    if isinstance(reader, readers.IdMap):
        return "id of a row or a requirement: text, or list of texts"
    for kind, word in words.items():
        if isinstance(reader, kind):
            return word
    if getattr(reader, "accepted", "") == "true or false":
        return "`true` or `false`"
    if example := getattr(reader, "accepted", ""):
        return f"such as `{example.removesuffix(' and the like')}`"
    # Of a reader that only its own module knows, the schema says what it takes.
    schema = reader.schema({})
    words_of_json = {"array": "6 × 6 matrix", "object": "`ERROR-ERROR: number` for each pair"}
    return " or ".join(words_of_json[form["type"]] for form in schema.get("anyOf", [schema]))


def _range(reader: readers.Quantity) -> str:
    dimension = reader.dimension
    gt, ge, lt, le = reader.bounds
    low = f"> {_quantity(gt, dimension.si)}" if gt >= ge else f"≥ {_quantity(ge, dimension.si)}"
    high = f"< {_quantity(lt, dimension.si)}" if lt <= le else f"≤ {_quantity(le, dimension.si)}"
    name = re.sub("^an? ", "", dimension.name)
    limits = [low if max(gt, ge) > -math.inf else "", high if min(lt, le) < math.inf else ""]
    return ", ".join([name, *filter(None, limits)])


def _quantity(value: float, si: str) -> str:
    """A value as one writes it: powers of ten, an angle in degrees."""
    if si == "rad" and abs(value) > 1e-3:
        value, si = math.degrees(value), "deg"
    text = f"{value:.6g}".replace("-", "−")
    if "e" in text or abs(value) >= 1e5:
        power = math.floor(math.log10(abs(value)))
        digits = f"{value / 10**power:.4g}".replace("-", "−")
        raised = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        text = f"{digits} · 10{raised}".replace("−1 · ", "−").removeprefix("1 · ")
    return f"{text} {si}".strip()


def units(_: Generated) -> str:
    """Every kind of quantity with the units that may stand behind a number."""
    rows = [
        (
            dimension.name,
            ", ".join(f"`{unit}`" for unit in dimension.units if unit),
            "refused, except 0" if dimension.usual else dimension.si or "a ratio",
        )
        for dimension in DIMENSIONS
    ]
    return table(("quantity", "units", "unit of a bare number"), rows)


# Missions of the gallery


def _about(file: Path) -> tuple[str, str]:
    """Source and assumptions, and the finding: the comments that a mission file begins with."""
    lines = []
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("# expect:"):
            lines.append(line[1:].strip())
    sources, _, finding = "\n".join(lines).partition("Finding:")
    if not finding:
        raise ValueError(f"{file.name} does not say its finding")
    # Sources and assumptions are paragraphs of their own, or stay one where they go on indented.
    return re.sub(r"\n(?=\S[^\n]{0,40}: )", "\n\n", sources.strip()), finding.strip()


@cache
def _found(name: str) -> tuple[dict[str, Any], list[str], bytes]:
    """Of a mission: its findings as JSON, the drawings of its report, and the report as a page."""
    with TemporaryDirectory() as folder:
        reports = [Path(folder, f"report.{suffix}") for suffix in ("json", "md", "html")]
        _output("check", "-q", f"specs/missions/{name}.yaml", *(f"--report={report}" for report in reports))
        found = json.loads(reports[0].read_text(encoding="utf-8"))["missions"][0]
        # The plan before the elevation.
        drawings = sorted(Path(folder).glob("*.assets/*.svg"), reverse=True)
        return found, [file.read_text(encoding="utf-8") for file in drawings], reports[2].read_bytes()


def finding(directive: Generated) -> str:
    """What a mission's file says is found, drawings of the collection, what `check` prints, the report to sign."""
    name = directive.arguments[0]
    directive.env.note_dependency(str(MISSIONS / f"{name}.yaml"))
    _, drawings, page = _found(name)
    report = Path(Generated.folder, "reports", f"{name}.html")
    report.parent.mkdir(parents=True, exist_ok=True)
    report.write_bytes(page)
    up = "../" * directive.env.docname.count("/")
    _, says = _about(MISSIONS / f"{name}.yaml")
    parts = [says[0].upper() + says[1:]]
    parts += [f"```{{raw}} html\n<figure class='drawing'>{svg}</figure>\n```" for svg in drawings]
    parts.append(f"```console\n$ bisar-budget check specs/missions/{name}.yaml\n$ echo $?\n```")
    link = f"<a href='{up}reports/{name}.html'>The report to sign</a>"
    parts.append(f"```{{raw}} html\n<p>{link}, as <code>--report report.html</code> writes it.</p>\n```")
    return "\n\n".join(parts)


def sources(directive: Generated) -> str:
    """What a mission's file says of where its numbers come from."""
    says, _ = _about(MISSIONS / f"{directive.arguments[0]}.yaml")
    return "\n".join(f"> {line}" if line else ">" for line in says.splitlines())


def missions(directive: Generated) -> str:
    """The gallery's table of contents: a line for each mission of the project, each with a page."""
    rows = []
    for name, text in joined([file.stem for file in sorted(MISSIONS.glob("*.yaml"))], directive.words(), "missions"):
        found = _found(name)[0]
        rows.append((f"[{found['name']}]({name}.md)", f"`{STATUS[found['status']].text}`", text))
    return table(("mission", "result", "shows"), rows)


# Theory and architecture


@cache
def _derivation() -> dict[str, str]:
    """What `derive` prints, by the first word of each of its headings."""
    parts = re.split(r"(?m)^## (.*)$", _output("derive", "--format", "markdown"))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def derived(directive: Generated) -> str:
    """A part of what `derive --format markdown` prints: the one whose heading begins with the argument."""
    found = [text for head, text in _derivation().items() if head.startswith(directive.arguments[0])]
    if len(found) != 1:
        raise ValueError(f"{len(found)} headings of the derivation begin with this: {list(_derivation())}")
    return found[0]


# A symbol of one platform along one axis stands for those of both, along all axes.
_OF_A_PLATFORM = re.compile(r"_[xyz]?[tr]$")
_OF_A_PLATFORM_IN_LATEX = re.compile(r"_\{[xyz]?[tr]\}$")


def symbols(directive: Generated) -> str:
    """Every symbol of the formulas, as they draw it, with the words of the body."""
    latex = {_OF_A_PLATFORM.sub("_k", name): text for name, (text, _) in SYMBOLS.items()}
    rows = joined(latex, directive.words(), "symbols")
    return table(
        ("symbol", "is"), [(f"${_OF_A_PLATFORM_IN_LATEX.sub('_{k}', latex[name])}$", text) for name, text in rows]
    )


def note_codes(_: Generated) -> str:
    """Codes of the sentences of findings, warnings and verdicts, with the sentence or its subject."""
    return table(
        ("code", "sentence, or what it is about"),
        [(f"`{code}`", _QUANTITY.sub(r"{\1}", _SUBJECT.sub("", about))) for code, about in sorted(CODES.items())],
    )


_SIZE_WORDS = {
    NORMAL: "one sigma",
    BOUND: "largest magnitude",
    AS_STATED: "as `distribution` states",
    PEAK_AMPLITUDE: "amplitude",
    RELATIVE_LEVEL: "level",
}


def error_kinds(_: Generated) -> str:
    """Every kind of error source, with the keys, the units and the meaning of its sizes."""
    rows = []
    for kind in kinds():
        if not isinstance(kind, SourceKind) or kind.is_registered:
            continue
        description = kind.description
        for axis, size in kind.sizes.items():
            forms = [form for form in (size.section_form or kind.key_form, kind.common_key_form) if form]
            keys = [
                f"{form}.{size.key}".rstrip(".").format(owner="NAME", kind=kind.name, axis=axis, index="N")
                for form in forms
            ]
            keys_text = " or ".join(f"`{key}`" for key in keys)
            rows.append((f"`{kind.name}`", keys_text, size.unit, _SIZE_WORDS[size.distribution], description))
            description = ""
    return table(("kind", "key", "unit", "size", "is"), rows)


def rooms(_: Generated) -> str:
    """The rooms of the package from the lowest floor up, with the first line of what each says of itself."""
    structure = ast.parse((ROOT / "tests" / "house" / "test_structure.py").read_text(encoding="utf-8"))
    (floors,) = [
        ast.literal_eval(node.value)
        for node in structure.body
        if isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["FLOORS"]
    ]
    rows = []
    for number, floor in enumerate(floors):
        for name in sorted(floor - {"", "__main__"}):
            says = (import_module(f"bisar_budget.{name}").__doc__ or "").partition("\n\n")[0]
            is_folder = (ROOT / "bisar_budget" / name).is_dir()
            rows.append((str(number), f"`{name}/`" if is_folder else f"`{name}.py`", says))
    return table(("floor", "room", "holds"), rows)


DIRECTIVES = {
    "statuses": statuses,
    "formats": formats,
    "json-keys": json_keys,
    "note-codes": note_codes,
    "mission-keys": mission_keys,
    "part-keys": part_keys,
    "units": units,
    "finding": finding,
    "sources": sources,
    "missions": missions,
    "derived": derived,
    "symbols": symbols,
    "error-kinds": error_kinds,
    "rooms": rooms,
}


def setup(app: Sphinx) -> dict[str, bool]:
    """Register a directive for each function."""
    Generated.folder = str(app.outdir)
    for name, write in DIRECTIVES.items():
        app.add_directive(name, type(f"{write.__name__.title()}Directive", (Generated,), {"write": write}))
    return {"parallel_read_safe": True}
