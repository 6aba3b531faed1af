"""Element sets, messages and ephemerides that the tests of orbits read, change and break."""

import json
import math
from collections.abc import Callable, Sequence

from bisar_budget.geometry import Vector
from bisar_budget.paths.instant import Instant, parse_instant


def checked(line: str) -> str:
    """A line of an element set with the checksum that it should have."""
    return line[:68] + str(sum(int(one) if one.isdigit() else one == "-" for one in line[:68]) % 10)


def instant(text: str) -> Instant:
    found = parse_instant(text)
    assert found is not None
    return found


# A low orbit as that of Sentinel-1A; the figures are of no day in particular.
LINE_1 = checked("1 39634U 14016A   26151.42515188  .00000355  00000+0  84975-4 0  9990")
LINE_2 = checked("2 39634  98.1813 159.9312 0001309  84.7034 275.4315 14.59199573539990")
TLE = f"SENTINEL-1A\n{LINE_1}\n{LINE_2}\n"
EPOCH = instant("2026-05-31T10:12:13.122432Z")
CENTER = instant("2026-06-01T05:20:31.250Z")

# The same elements as a message.
MESSAGE = {
    "OBJECT_NAME": "SENTINEL-1A",
    "OBJECT_ID": "2014-016A",
    "EPOCH": "2026-05-31T10:12:13.122432",
    "MEAN_MOTION": 14.59199573,
    "ECCENTRICITY": 0.0001309,
    "INCLINATION": 98.1813,
    "RA_OF_ASC_NODE": 159.9312,
    "ARG_OF_PERICENTER": 84.7034,
    "MEAN_ANOMALY": 275.4315,
    "EPHEMERIS_TYPE": 0,
    "CLASSIFICATION_TYPE": "U",
    "NORAD_CAT_ID": 39634,
    "ELEMENT_SET_NO": 999,
    "REV_AT_EPOCH": 53999,
    "BSTAR": 8.4975e-05,
    "MEAN_MOTION_DOT": 3.55e-06,
    "MEAN_MOTION_DDOT": 0,
}
CONSTANTS = {"CENTER_NAME": "EARTH", "REF_FRAME": "TEME", "TIME_SYSTEM": "UTC", "MEAN_ELEMENT_THEORY": "SGP4"}


def omm_json(**changed: object) -> bytes:
    """As CelesTrak writes it; Space-Track writes every value as a text."""
    return json.dumps([{**MESSAGE, **changed}]).encode()


def omm_csv() -> bytes:
    return (",".join(MESSAGE) + "\r\n" + ",".join(str(one) for one in MESSAGE.values()) + "\r\n").encode()


def omm_xml() -> bytes:
    def lines(*keys: str) -> str:
        values = {**MESSAGE, **CONSTANTS}
        return "\n".join(f"<{key}>{values[key]}</{key}>" for key in keys)

    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ndm xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<omm id="CCSDS_OMM_VERS" version="2.0">
<header><CREATION_DATE/><ORIGINATOR/></header>
<body><segment>
<metadata>
{lines("OBJECT_NAME", "OBJECT_ID", *CONSTANTS)}
</metadata>
<data>
<meanElements>
{lines("EPOCH", "MEAN_MOTION", "ECCENTRICITY", "INCLINATION", "RA_OF_ASC_NODE", "ARG_OF_PERICENTER", "MEAN_ANOMALY")}
</meanElements>
<tleParameters>
{lines("EPHEMERIS_TYPE", "NORAD_CAT_ID", "BSTAR", "MEAN_MOTION_DOT", "MEAN_MOTION_DDOT")}
</tleParameters>
</data>
</segment></body>
</omm>
</ndm>
""".encode()


def omm_text() -> bytes:
    """As CCSDS has it, a keyword and a value in each line, some with their unit."""
    units = {"MEAN_MOTION": "rev/day", "INCLINATION": "deg", "BSTAR": "1/ER"}
    lines = ["CCSDS_OMM_VERS = 2.0", "CREATION_DATE = 2026-05-31T12:00:00", "ORIGINATOR = TESTS", "COMMENT a comment"]
    for key, value in {**CONSTANTS, **MESSAGE}.items():
        lines.append(f"{key:<20} = {value}" + (f" [{units[key]}]" if key in units else ""))
    return ("\n".join(lines) + "\n").encode()


def omm_with_covariance(form: str, rows: Sequence[str], frame: str = "RTN", **changed: object) -> bytes:
    """The message as text, xml, json or csv with the rows of a covariance; a key that is None is left out."""
    axes = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
    stated: dict[str, object] = {"COV_REF_FRAME": frame}
    for row, cells in zip(axes, rows, strict=True):
        stated.update({f"C{row}_{column}": cell for column, cell in zip(axes, cells.split(), strict=False)})
    stated = {key: value for key, value in {**stated, **changed}.items() if value is not None}
    if form == "text":
        return omm_text() + "".join(f"{key} = {value}\n" for key, value in stated.items()).encode()
    if form == "xml":
        block = "".join(f"<{key}>{value}</{key}>" for key, value in stated.items())
        return omm_xml().replace(b"</data>", f"<covarianceMatrix>{block}</covarianceMatrix></data>".encode())
    if form == "json":
        return omm_json(**stated)
    rows_of_csv = omm_csv().decode().split("\r\n")
    return "\r\n".join(
        [f"{rows_of_csv[0]},{','.join(stated)}", f"{rows_of_csv[1]},{','.join(map(str, stated.values()))}", ""]
    ).encode()


RADIUS, TURN_RATE = 7_071_000.0, 1.0617e-3  # m, rad/s
START = instant("2026-06-01T05:00:00Z")


def on_circle(seconds: float) -> tuple[Vector, Vector]:
    """Place and velocity on a circle, inclined by 98°, which stands still in the axes of a message. [m], [m/s]"""
    angle, tilt = 0.3 + TURN_RATE * seconds, math.radians(98)
    cosine, sine = RADIUS * math.cos(angle), RADIUS * math.sin(angle)
    place = (cosine, math.cos(tilt) * sine, math.sin(tilt) * sine)
    velocity = (-TURN_RATE * sine, math.cos(tilt) * TURN_RATE * cosine, math.sin(tilt) * TURN_RATE * cosine)
    return place, velocity


def written(moment: Instant) -> str:
    """An instant to a nanosecond, without the letter of its time zone; a leap second as such."""
    second = min(int(moment.seconds), 86399)
    day = Instant(moment.day, 0.0).as_text()[:10]
    rest = moment.seconds - second
    base = second % 60 + (1 if rest >= 1 else 0)
    return f"{day}T{second // 3600:02d}:{second // 60 % 60:02d}:{base:02d}.{round(rest % 1 * 1e9):09d}"


def oem(
    *,
    frame: str = "ITRF2014",
    system: str = "UTC",
    interpolation: Sequence[str] = (),
    step: float = 60.0,
    count: int = 21,
    path: Callable[[float], tuple[Vector, Vector]] = on_circle,
    times: Callable[[float], Instant] | None = None,
    extra: Sequence[str] = (),
    name: str = "CIRCLE",
    heading: bool = True,
) -> str:
    """An ephemeris of a path; `times` says how seconds of the path are written, from `START` without it."""
    clock = times or START.after
    lines = ["CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2026-05-30T00:00:00", "ORIGINATOR = TESTS"] if heading else []
    lines += [
        "META_START",
        f"OBJECT_NAME = {name}",
        "OBJECT_ID = 2026-001A",
        "CENTER_NAME = EARTH",
        f"REF_FRAME = {frame}",
        f"TIME_SYSTEM = {system}",
        f"START_TIME = {written(clock(0.0))}",
        f"STOP_TIME = {written(clock(step * (count - 1)))}",
        *interpolation,
        *extra,
        "META_STOP",
        "",
        "COMMENT one line for each time",
    ]
    for n in range(count):
        place, velocity = path(step * n)
        numbers = " ".join(f"{one / 1000:.12f}" for one in (*place, *velocity))
        lines.append(f"{written(clock(step * n))} {numbers}")
    return "\n".join(lines) + "\n"


def oem_xml(text: str) -> bytes:
    """The same message in XML."""
    metadata, rows = [], []
    inside = False
    for line in text.splitlines():
        if line in ("META_START", "META_STOP"):
            inside = line == "META_START"
        elif inside:
            key, _, value = line.partition(" = ")
            metadata.append(f"<{key}>{value}</{key}>")
        elif line[:2] == "20":
            epoch, *numbers = line.split()
            keys = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
            values = "".join(
                f'<{key} units="{"km/s" if "_" in key else "km"}">{one}</{key}>'
                for key, one in zip(keys, numbers, strict=True)
            )
            rows.append(f"<stateVector><EPOCH>{epoch}</EPOCH>{values}</stateVector>")
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<oem id="CCSDS_OEM_VERS" version="2.0">\n<header/>\n'
    return (
        head
        + "<body><segment>\n<metadata>\n"
        + "\n".join(metadata)
        + "\n</metadata>\n<data>\n"
        + "\n".join(rows)
        + "\n</data>\n</segment></body>\n</oem>\n"
    ).encode()
