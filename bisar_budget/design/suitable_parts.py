"""Parts of the catalogue that keep to what is ordered, and the phase noise that an ordered level asks for."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget.design.row_uses import SpecifiedMission
from bisar_budget.design.specified import Specified
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.parts import Entry, OscillatorPart, PartError, entries, folders
from bisar_budget.units import format_quantity

_OFFSETS = (1.0, 10.0, 100.0, 1e3)  # at which the phase noise of an ordered level is said [Hz]
_PER_DECADE = 20  # offsets at which spectra are compared
_SLOW = 0.1  # cycles per aperture, from which on phase noise is seen
_SAME = 1 + 1e-9


def catalogue(of: SpecifiedMission) -> list[Entry]:
    """Parts that the file of a mission may name: those that come with the tool, and those of its project."""
    try:
        return list(entries(folders(folder_of(of.given.file))))
    except PartError:  # a folder of the project has a file that is no part; `sensors` says which
        return []


def suitable_parts(of: SpecifiedMission, one: Specified, most: float, among: Sequence[Entry]) -> Iterator[str]:
    """Ids of the parts that keep to a specification, whose ordered number is `most`.

    A sensor does with a figure of the same name that is no larger in any axis. An oscillator does whose phase noise
    is nowhere above the spectrum that is ordered, at the same frequency; one that says nothing of some offsets not.
    """
    *above, section, figure = parts_of(one.key)
    if section == "oscillator" and figure == "level":
        yield from _quiet_oscillators(of, above[-1], most, among)
    kind = {"motion_error": "gnss", "imu": "imu"}.get(section)
    for entry in among:
        value = getattr(entry.part, figure, None) if entry.part.kind == kind else None
        if value is not None and np.abs(value).max() <= most:
            yield entry.id


def _quiet_oscillators(of: SpecifiedMission, name: str, level: float, among: Sequence[Entry]) -> Iterator[str]:
    carrier, pieces = _spectrum(of, name)
    aperture = of.stated.collection.aperture_time
    last = max(piece.high for piece in pieces)
    first = min([_SLOW / aperture, *(piece.low for piece in pieces if piece.low)])
    offsets = np.geomspace(first, last * (1 - 1e-9), 1 + math.ceil(_PER_DECADE * math.log10(last / first)))
    most = density(pieces, offsets) * 10 ** (level / 10) * _SAME
    for entry in among:
        part = entry.part
        if not isinstance(part, OscillatorPart):
            continue
        alone = Oscillator(part.frequency, part.phase_noise, part.allan_deviation, part.power_law)
        noise = density(noise_of(alone, carrier, aperture).pieces, offsets)
        if np.all((noise > 0) & (noise <= most)):
            yield entry.id


def ordered_noise(of: SpecifiedMission, one: Specified, level: float) -> str:
    """The phase noise that a level of an oscillator asks for, where the file states it by its points; else empty."""
    _, name, *below = parts_of(one.key)
    if below != ["oscillator", "level"]:
        return ""
    carrier, pieces = _spectrum(of, name)
    found = zip(_OFFSETS, density(pieces, np.array(_OFFSETS)).tolist(), strict=True)
    points = [
        f"{10 * math.log10(size / 2) + level:.1f} dBc/Hz at {offset:g} Hz" for offset, size in found if size > 0
    ]
    return f"{', '.join(points)} from {format_quantity(carrier, 'Hz', 4)}" if points else ""


def _spectrum(of: SpecifiedMission, name: str) -> tuple[float, Sequence[PowerLawPiece]]:
    """Frequency of a platform's oscillator, else of the radar, and the spectrum of its phase there at 0 dB."""
    oscillator = getattr(of.stated.platforms, name).oscillator
    carrier = oscillator.frequency or of.stated.radar.center_frequency
    return carrier, noise_of(oscillator.noise_alone, carrier, of.stated.collection.aperture_time).pieces
