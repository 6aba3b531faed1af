"""Files of cases, read with other people's readers: pandas' and Python's CSV, pyarrow, xarray."""

import csv
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bisar_budget as bb
from bisar_budget.extras import MissingExtraError
from bisar_budget.faults import SetValue
from bisar_budget.findings.case_table import Cases, Column, Part, Swept, Values
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.cases import grid, grid_of, table
from bisar_budget.report import tables
from bisar_budget.report.tables import TABLES, Described, slabs, writer_of
from tests.conftest import ROOT

FILE = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
MISSION = load_mission(str(FILE), changes=[SetValue("radar.bandwidth", "150MHz")])
TREE: dict[str, Any] = read_tree(FILE.read_bytes(), "m.yaml").root
DAY = date(2026, 1, 1)
TIME, AZIMUTH = "collection.aperture_time", "platforms.receiver.azimuth"
GRID = grid(TREE, [f"{TIME}=1:2s:3", f"{AZIMUTH}=-30,60,90,180deg", "radar.bandwidth=100,200MHz"])
TABLE = table(TREE, f"{TIME} [ms],{AZIMUTH} [deg]\n" + "".join(f"{100 * i},{i}\n" for i in range(1, 25)), "c.csv")


def swept(cases: Cases, size: int) -> Swept:
    """24 cases of made-up values, in parts of a size."""
    number = np.arange(24)
    found: dict[str, Values] = {
        **cases.values(0, 24),
        "utilization": np.where(number % 5 == 4, np.nan, number / 7),
        "status": np.array(["pass", "fail", "error"], object)[number % 3],
        "worst_row": np.array(["", "receiver.velocity.x", "clock drift"], object)[number % 3],
        "reason": np.array([f'case {n}, "bad"' if n % 3 == 2 else "" for n in number], object),
    }
    columns = (
        *(Column(one.key, one.unit and "SI", f"the key {one.key}", not one.unit) for one in cases.varied),
        Column("utilization", "", "what is declared over what is allowed"),
        Column("status", "", "status of the mission", True),
        Column("worst_row", "", "row of the highest utilization", True),
        Column("reason", "", "why there is no mission", True),
    )

    def parts() -> Iterator[Part]:
        for start in range(0, 24, size):
            stop = min(start + size, 24)
            yield Part(start, stop, {name: values[start:stop] for name, values in found.items()})

    keys = tuple(number.key for number in cases.varied)
    return Swept("A =name", "ab" * 32, keys, 24, columns, parts())


def written(suffix: str, cases: Cases, tmp_path: Path, size: int = 7) -> Path:
    path = tmp_path / f"t{suffix}"
    made = swept(cases, size)
    writer_of(suffix).write(Described(made, cases, MISSION, "1.2.3"), made.parts, str(path))
    return path


FACTS = {
    "format": "bisar-budget/sweep/1",
    "mission": "A =name",
    "mission_sha256": "ab" * 32,
    "set": "--set radar.bandwidth=150MHz",
    "model": "published",
    "source": "bisar-budget 1.2.3",
}


@pytest.mark.parametrize("size", [1, 7, 24])
def test_csv(tmp_path: Path, size: int) -> None:
    text = written(".csv", GRID, tmp_path, size).read_text(encoding="utf-8")
    lines = text.splitlines()
    assert lines[:6] == [f"# {name}: {value}" for name, value in FACTS.items()]
    rows = list(csv.DictReader(lines[6:]))
    assert list(rows[0])[:4] == [f"{TIME} [s]", f"{AZIMUTH} [deg]", "radar.bandwidth [MHz]", "utilization"]
    assert [row[f"{AZIMUTH} [deg]"] for row in rows[:4]] == ["-30.0", "-30.0", "60.0", "60.0"]
    assert [row["utilization"] for row in rows] == ["" if n % 5 == 4 else repr(n / 7) for n in range(24)]
    assert rows[2]["reason"] == 'case 2, "bad"'
    assert (rows[1]["worst_row"], rows[1]["status"]) == ("receiver.velocity.x", "fail")


def test_the_keys_of_a_csv_are_a_table_of_cases(tmp_path: Path) -> None:
    """Values come back to the bit, in the units that they were asked for in."""
    lines = written(".csv", GRID, tmp_path).read_text(encoding="utf-8").splitlines()
    cut = "".join(",".join(line.split(",")[:3]) + "\n" for line in lines)
    again = table(TREE, cut, "again.csv")
    for key, values in GRID.values(0, 24).items():
        assert again.values(0, 24)[key].tolist() == values.tolist()


@pytest.mark.parametrize("size", [1, 7, 24])
def test_parquet(tmp_path: Path, size: int) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    read = pq.read_table(written(".parquet", GRID, tmp_path, size))
    metadata = {name.decode(): value.decode() for name, value in read.schema.metadata.items()}
    assert {name: metadata[name] for name in FACTS} == FACTS
    field = read.schema.field(AZIMUTH)
    assert field.metadata == {b"unit": b"deg", b"description": f"the key {AZIMUTH}".encode()}
    assert read.column(AZIMUTH).to_pylist()[:4] == [-30, -30, 60, 60]
    assert read.column("utilization").to_pylist() == [None if n % 5 == 4 else n / 7 for n in range(24)]
    assert pa.types.is_dictionary(read.schema.field("status").type)
    assert read.column("status").to_pylist() == ["pass", "fail", "error"] * 8
    assert read.column("worst_row").to_pylist()[:3] == [None, "receiver.velocity.x", "clock drift"]
    assert read.column("reason").to_pylist()[2] == 'case 2, "bad"'


def test_parquet_has_groups_of_many_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not one for each part, which would make a file of a million cases slow to read; nor one for all."""
    import pyarrow.parquet as pq

    from bisar_budget.report import tables

    monkeypatch.setattr(tables, "_MIN_GROUP_ROWS", 10)
    assert [part[-1].stop - part[0].start for part in tables._groups(swept(TABLE, 4).parts)] == [12, 12]
    file = pq.ParquetFile(written(".parquet", TABLE, tmp_path, 4))
    assert [file.metadata.row_group(group).num_rows for group in range(file.metadata.num_row_groups)] == [12, 12]
    assert file.read().column("utilization").to_pylist()[23] == 23 / 7


@pytest.mark.parametrize("size", [1, 5, 7, 24])
def test_netcdf_of_a_grid_keeps_its_axes(tmp_path: Path, size: int) -> None:
    import xarray

    with xarray.open_dataset(written(".nc", GRID, tmp_path, size)) as read:
        assert dict(read.sizes) == {TIME: 3, AZIMUTH: 4, "radar.bandwidth": 2}
        assert read[AZIMUTH].values.tolist() == [-30, 60, 90, 180]
        assert read[AZIMUTH].attrs == {"long_name": f"the key {AZIMUTH}", "units": "degree"}
        assert read["utilization"].attrs["units"] == "1"
        expected = np.where(np.arange(24) % 5 == 4, np.nan, np.arange(24) / 7).reshape(3, 4, 2)
        np.testing.assert_array_equal(read["utilization"].values, expected)
        status = read["status"]
        meanings = status.attrs["flag_meanings"].split()
        assert status.attrs["flag_values"].tolist() == list(range(len(meanings)))
        assert [meanings[code] for code in status.values.ravel()] == ["pass", "fail", "error"] * 8
        assert read["worst_row"].attrs["flag_meanings"] == "none receiver.velocity.x clock_drift"
        assert read["worst_row"].values.ravel().tolist() == [0, 1, 2] * 8
        assert read["reason"].values.ravel()[:3].tolist() == ["", "", 'case 2, "bad"']
        titled = {"title" if name == "mission" else name: value for name, value in FACTS.items()}
        assert read.attrs == {"Conventions": "CF-1.11", **titled}
        assert float(read["utilization"].sel({TIME: 1.5, AZIMUTH: 60, "radar.bandwidth": 200})) == 11 / 7


def test_netcdf_of_a_table_has_a_dimension_of_cases(tmp_path: Path) -> None:
    import xarray

    with xarray.open_dataset(written(".nc", TABLE, tmp_path)) as read:
        assert dict(read.sizes) == {"case": 24}
        assert read[TIME].values.tolist() == [100.0 * n for n in range(1, 25)]
        assert read[TIME].attrs["units"] == "ms"


def test_words_are_text_in_every_format(tmp_path: Path) -> None:
    """And the axis of a grid in NetCDF; no one model has found all the cases."""
    import pyarrow.parquet as pq
    import xarray

    cases = grid(TREE, [f"{TIME}=1:2s:8", "allocation.model=published,full,strictest"])
    lines = written(".csv", cases, tmp_path).read_text(encoding="utf-8").splitlines()
    assert "# model: varies" in lines
    rows = list(csv.DictReader(lines[6:]))
    assert [row["allocation.model"] for row in rows[:4]] == ["published", "full", "strictest", "published"]
    again = table(TREE, "".join(",".join(line.split(",")[:2]) + "\n" for line in lines), "again.csv")
    assert again.values(0, 24)["allocation.model"].tolist() == cases.values(0, 24)["allocation.model"].tolist()
    read = pq.read_table(written(".parquet", cases, tmp_path))
    assert read.column("allocation.model").to_pylist()[:3] == ["published", "full", "strictest"]
    with xarray.open_dataset(written(".nc", cases, tmp_path)) as dataset:
        assert dict(dataset.sizes) == {TIME: 8, "allocation.model": 3}
        assert dataset["allocation.model"].values.tolist() == ["published", "full", "strictest"]
        assert float(dataset["utilization"].sel({TIME: 1, "allocation.model": "full"})) == 1 / 7


class TestDatasets:
    """In memory, as xarray has them."""

    def test_arrays_go_in_and_a_dataset_comes_out(self) -> None:
        """By hand: the utilization goes with the square of the aperture time, 11.78 at 6 s."""
        mission = load_mission(str(FILE))
        times = np.linspace(1, 6, 11)
        cases = grid_of(TREE, {"allocation.model": ["published", "full"], TIME: times})
        found = bb.sweep(mission, cases, columns=["transmitter.acceleration.x.status"], date=DAY).to_xarray()
        assert dict(found.sizes) == {"allocation.model": 2, TIME: 11}
        published = found["utilization"].sel({"allocation.model": "published"})
        assert published.values == pytest.approx(11.78124183 * (times / 6) ** 2)
        assert found[TIME].values == pytest.approx(times)
        assert (found[TIME].attrs["units"], found["bistatic_angle"].attrs["units"]) == ("s", "rad")
        assert found.sel({"allocation.model": "full", TIME: 6.0})["status"].item() == "fail"
        assert found["transmitter.acceleration.x.status"].values[0].tolist() == found["status"].values[0].tolist()
        assert found.attrs["format"] == "bisar-budget/sweep/1"

    def test_pairs_of_values_are_cases(self) -> None:
        mission = load_mission(str(FILE))
        values = {TIME: [1, 6], AZIMUTH: np.radians([45, 45])}
        found = bb.sweep(mission, values, paired=True, date=DAY).to_xarray()
        assert dict(found.sizes) == {"case": 2}
        assert found["utilization"].values == pytest.approx([11.78124183 / 36, 11.78124183])
        assert found[AZIMUTH].values == pytest.approx([45, 45])  # in the unit of the file
        assert found[AZIMUTH].attrs["units"] == "deg"

    @pytest.mark.parametrize(
        ("values", "said"),
        [
            ({TIME: [[1.0]]}, "has values of the shape (1, 1); accepted: (n,)"),
            ({TIME: []}, "has values of the shape (0,)"),
            ({TIME: ["1 s"]}, "has words; accepted: numbers in SI"),
            ({"allocation.model": ["ful"]}, "'ful' is not a known choice"),
            ({"allocation.model": [1.0]}, "is no number with a unit"),
            ({"name": ["a"]}, "is no number with a unit"),
            ({}, "nothing would vary"),
        ],
    )
    def test_arrays_that_are_no_cases(self, values: Any, said: str) -> None:
        with pytest.raises(QuestionError) as error:
            grid_of(TREE, values)
        assert said in str(error.value)

    def test_pairs_of_different_length(self) -> None:
        with pytest.raises(QuestionError, match="differ in length; accepted: one value of each for every case"):
            bb.sweep(MISSION, {TIME: [1, 2], AZIMUTH: [1]}, paired=True)

    def test_without_xarray(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "xarray", None)
        with pytest.raises(MissingExtraError, match=r"needs xarray.*pip install netCDF4 pyarrow xarray"):
            bb.sweep(MISSION, GRID, date=DAY).to_xarray()


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.data())
def test_boxes_hold_the_elements_between_two(shape: list[int], data: st.DataObject) -> None:
    size = int(np.prod(shape))
    start = data.draw(st.integers(0, size))
    stop = data.draw(st.integers(start, size))
    elements = np.arange(size).reshape(shape)
    found = [element for slab in slabs(start, stop, tuple(shape)) for element in elements[slab].ravel().tolist()]
    assert found == list(range(start, stop))


@pytest.mark.parametrize("suffix", [".parquet", ".nc"])
def test_a_library_that_is_missing(suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(tables, "import_module", missing)
    with pytest.raises(MissingExtraError, match=r"pip install netCDF4 pyarrow xarray") as error:
        writer_of(suffix)
    assert TABLES[suffix].library in str(error.value)
