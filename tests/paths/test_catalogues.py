"""Catalogues with an entry that cannot be used: it is left out and counted, unless it is the wanted one."""

import json

import pytest

from bisar_budget.paths.elements import read_omm, read_tle
from bisar_budget.paths.flight import Orbit, PathFileError
from tests.paths.orbit_files import CENTER, LINE_1, LINE_2, TLE, checked, omm_csv, omm_json, omm_text, omm_xml

OTHER_1, OTHER_2 = (checked(line.replace("39634", "25544")) for line in (LINE_1, LINE_2))
WRONG_SUM = OTHER_2[:-1] + str((int(OTHER_2[-1]) + 1) % 10)
BROKEN_SETS = {
    "checksum": f"OTHER\n{OTHER_1}\n{WRONG_SUM}\n",
    "no second line": f"OTHER\n{OTHER_1}\n",
    "no first line": f"OTHER\n{OTHER_2}\n",
    "no checksum": f"OTHER\n{OTHER_1[:-1]}\n{OTHER_2[:-1]}\n",
    "character": f"OTHER\n{OTHER_1.replace('U', chr(0xE4))}\n{OTHER_2}\n",
    "without a name": f"{OTHER_1}\n{WRONG_SUM}\n",
}


def tle(text: str, wanted: str | None) -> Orbit:
    return read_tle(text.encode(), "a.tle", wanted, CENTER)


@pytest.mark.parametrize("broken", BROKEN_SETS.values(), ids=BROKEN_SETS)
@pytest.mark.parametrize("is_first", [True, False])
def test_a_broken_set_of_another_object_is_left_out(broken: str, is_first: bool) -> None:
    text = broken + TLE if is_first else TLE + broken
    alone = tle(TLE, None)
    for wanted in ("SENTINEL-1A", "39634"):
        orbit = tle(text, wanted)
        assert orbit.place(CENTER) == alone.place(CENTER)
        assert "entries left out (a.tle:" in orbit.words


@pytest.mark.parametrize("wanted", [None, "25544", "OTHER"])
def test_a_broken_set_of_the_object_or_of_a_file_that_asks_for_the_only_one_is_refused(wanted: str | None) -> None:
    with pytest.raises(PathFileError, match=r"^a\.tle:6: the checksum is \d, its digits give \d$"):
        tle(TLE + BROKEN_SETS["checksum"], wanted)


def test_a_broken_set_of_another_epoch_of_the_object_is_refused() -> None:
    """Chosen by its name, found out by its number."""
    wrong = LINE_2[:-1] + str((int(LINE_2[-1]) + 1) % 10)
    with pytest.raises(PathFileError, match=r"^a\.tle:5: the checksum is"):
        tle(f"{TLE}{LINE_1}\n{wrong}\n", "SENTINEL-1A")


def test_a_set_without_its_checksums_says_so() -> None:
    with pytest.raises(PathFileError, match=r"^a\.tle:1: has 68 columns: the checksum, column 69, is missing$"):
        tle(f"{LINE_1[:-1]}\n{LINE_2[:-1]}\n", None)


def omm(data: bytes | str, wanted: str | None) -> Orbit:
    return read_omm(data.encode() if isinstance(data, str) else data, "a.omm", wanted, CENTER)


def catalogue(form: str) -> str:
    """Two messages, of which that of OTHER has no number as its drag."""
    if form == "json":
        (good,) = json.loads(omm_json())
        broken = good | {"OBJECT_NAME": "OTHER", "NORAD_CAT_ID": 25544, "BSTAR": "x"}
        return json.dumps([broken, good])
    text = {"xml": omm_xml, "text": omm_text, "csv": omm_csv}[form]().decode()
    other = text.replace("SENTINEL-1A", "OTHER").replace("39634", "25544")
    if form == "csv":
        header, row = text.strip().splitlines()
        cells = row.replace("SENTINEL-1A", "OTHER").replace("39634", "25544").split(",")
        cells[header.split(",").index("BSTAR")] = "x"
        return f"{header}\n{','.join(cells)}\n{row}\n"
    drag = next(line for line in other.splitlines() if "BSTAR" in line)
    wrong = "BSTAR = x" if form == "text" else "<BSTAR>x</BSTAR>"
    other = other.replace(drag, wrong)
    if form == "text":
        return f"{other}\n{text}"
    start, end = text.index("<omm"), text.index("</omm>") + len("</omm>")
    begin, finish = other.index("<omm"), other.index("</omm>") + len("</omm>")
    return f"<ndm>{other[begin:finish]}{text[start:end]}</ndm>"


@pytest.mark.parametrize("form", ["json", "xml", "text", "csv"])
def test_a_broken_message_of_another_object_is_left_out(form: str) -> None:
    data = catalogue(form)
    orbit = omm(data, "39634")
    assert orbit.place(CENTER) == omm(omm_json(), None).place(CENTER)
    assert "1 of 2 entries left out (a.omm" in orbit.words
    assert "BSTAR must be a number (got x)" in orbit.words
    for wanted in (None, "OTHER", "25544"):
        with pytest.raises(PathFileError, match=r"BSTAR must be a number \(got x\)"):
            omm(data, wanted)


def test_an_empty_message_is_left_out() -> None:
    text = omm_xml().decode()
    start, end = text.index("<omm"), text.index("</omm>") + len("</omm>")
    orbit = omm(f"<ndm><omm></omm>{text[start:end]}</ndm>", None)
    assert "1 of 2 entries left out" in orbit.words
    with pytest.raises(PathFileError, match="has no MEAN_ELEMENT_THEORY"):
        omm("<ndm><omm></omm></ndm>", None)
