"""Logs that are broken: nothing but places or one line comes out of any bytes."""

import struct
from collections import Counter
from pathlib import Path
from time import process_time

import pytest

from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.log_places import NO_KEYS
from bisar_budget.paths.path_formats import log_format, read_log
from tests.hostile_commands import log_read
from tests.paths.log_files import message


@pytest.mark.parametrize("first", range(0, 600, 100))
def test_nothing_else_comes_out(first: int, tmp_path: Path) -> None:
    """Some of what `docs/prove_hostile.py` reads."""
    tried = Counter[str]()
    for seed in range(first, first + 100):
        assert list(log_read(seed, tmp_path, tried)) == [], seed
    assert 3 < tried["usable logs"] < 90


FIELDS = b"uint64_t timestamp;double lat;double lon;float alt;"
N = 200_000  # characters that a pattern may not go over again and again
LONG = {
    "blanks in a header of RTKLIB": (b"%  GPST" + b" " * N + b"x\n% UTC latitude(" + b"(" * N, "pos"),
    "blanks in a header of CSV": (b"time [s]," + b" " * N + b"(,x [m]\n", "csv"),
    "brackets in a header of CSV": (b"x" + b"[" * N + b",latitude", "csv"),
    "digits of a point": (b'<gpx><trk><trkpt lat="' + b"1" * N + b'x"><time>2026</time></trkpt></trk></gpx>', "gpx"),
    "letters of a time": (b"<gpx><trk><trkpt><time>" + b"T" * 9999 + b"</time></trkpt></trk></gpx>", "gpx"),
    "a track in a track": (b"<gpx>" + b"<trk>" * N, "gpx"),
    "a sentence without end": (b"$GPGGA," * N, "nmea"),
    "stars": (b"$GPGGA," + b"*" * N, "nmea"),
    "sentences": (b"$GPGGA,,,,,0,,,,,,,,*4A\n" * 20_000, "nmea"),
    "formats of a ULog": (b"ULog\x01\x12\x35" + bytes(9) + b"\x02\0F:;" * N, "ulog"),
    "fields of a ULog": (
        b"ULog\x01\x12\x35"
        + bytes(9)
        + b"\xe2\xfdFsensor_gps:"
        + b"char x;" * 9284
        + b"\x0d\0A\0\0\0sensor_gps" * 9999,
        "ulog",
    ),
    "numbers of a topic": (
        b"ULog\x01\x12\x35"
        + bytes(9)
        + message("F", b"vehicle_global_position:" + FIELDS + b"char x;" * 9000)
        + b"".join(message("A", struct.pack("<BH", 0, n) + b"vehicle_global_position") for n in range(65536)),
        "ulog",
    ),
}


@pytest.mark.parametrize(("data", "kind"), LONG.values(), ids=LONG)
def test_what_is_long_is_soon_refused(data: bytes, kind: str) -> None:
    """What takes the square of its length would take minutes."""
    begin = process_time()
    log_format(data)
    with pytest.raises(PathFileError):
        read_log(data, "a", kind, NO_KEYS)
    assert process_time() - begin < 3
