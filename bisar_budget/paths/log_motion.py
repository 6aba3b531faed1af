"""Logs that no platform can have flown: those that stand still, repeat places, or jump.

A receiver that has frozen goes on writing its last place; one that is slower than its log writes each place several
times; a filter that is set anew, or a cell that is wrong, makes a step that no platform takes. A polynomial through
such places is smooth all the same, and wrong. What is below the limits here is noise, and counts as the residual.
"""

import numpy as np
from numpy.typing import NDArray

from bisar_budget.paths.flight import PathFileError
from bisar_budget.units import format_quantity

_STILL_M = 1e-3  # over a whole aperture; the noise of any receiver is more
_SAME_M = 1e-6  # between two places; the same numbers, turned to the scene's axes, are rounded to 1e-9 m
_LEAST_M = 0.1  # of what is missed or jumped: six decimals of a degree are rounded by as much
_HARDEST = 30.0  # m/s², 3 g; and no platform takes that back within three samples
_USUAL = 20  # times the median; the largest of thousands of normal numbers is 4 times it, that of rough noise 10
_BESIDE = 3  # steps on each side that a step is compared with
_BEYOND = 10  # samples beyond each end of the aperture that say what is usual

_Numbers = NDArray[np.float64]


def hold_to_motion(times: _Numbers, places: _Numbers, aperture_time_s: float, name: str) -> None:
    """Refuse a log that no platform can have flown.

    Parameters
    ----------
    times : (n,) ndarray
        Slow time, rising; what is far outside the aperture is not looked at. [s]
    places : (n, 3) ndarray
        In any axes. [m]
    aperture_time_s : float
        Length of the aperture. [s]
    name : str
        What messages call the log.

    Raises
    ------
    PathFileError
        The places in the aperture are one place to 1 mm. Or places are those before them while the platform moves by
        more than 0.1 m, at its mean speed in the aperture. Or a step is off the median of seven around it by more
        than 0.1 m, by more than 3 g would make it, and by more than 20 times what is usual.
    """
    half = aperture_time_s / 2 * (1 + 1e-9)
    first, last = int(np.searchsorted(times, -half, "left")), int(np.searchsorted(times, half, "right"))
    at, flown = times[first:last], places[first:last]
    if at.size < 2 * _BESIDE - 1:  # too few for a path, too
        return
    extent = float(np.linalg.norm(flown - flown[0], axis=1).max())
    if extent <= _STILL_M:
        raise PathFileError(
            f"{name}: stands still: its {at.size} places in the aperture are the same to {1e3 * _STILL_M:g} mm",
            "accepted: the log of a platform that moves",
            "A fixed platform needs no log: give its place, and speed 0",
        )
    _hold_to_new_places(at, flown, extent, name)
    near = slice(max(first - _BEYOND, 0), last + _BEYOND)
    _hold_to_small_steps(times[near], places[near], half, name)


def _hold_to_new_places(at: _Numbers, flown: _Numbers, extent: float, name: str) -> None:
    """Refuse places that are the same as those before them, while the platform moves."""
    is_held = np.linalg.norm(np.diff(flown, axis=0), axis=1) <= _SAME_M
    if not is_held.any():
        return
    edges = np.diff(np.concatenate([[0], is_held.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    durations = at[ends] - at[begins]
    longest = int(durations.argmax())
    missed = extent * float(durations[longest] / (at[-1] - at[0]))
    if missed > _LEAST_M:
        raise PathFileError(
            f"{name}: repeats places: {int(is_held.sum())} of {at.size} in the aperture are the place before; from "
            f"{at[begins[longest]]:+.4g} s of mid-aperture on for {durations[longest]:.3g} s, in which the platform "
            f"moves {format_quantity(missed, 'm')}",
            f"accepted: repeats in which it moves at most {_LEAST_M:g} m",
            "Leave out places that were not measured anew, or write more digits",
        )


def _hold_to_small_steps(times: _Numbers, places: _Numbers, half: float, name: str) -> None:
    """Refuse steps between neighbouring places that those around them do not allow."""
    steps = np.diff(times)
    velocities = np.diff(places, axis=0) / steps[:, None]
    around = np.pad(velocities, ((_BESIDE, _BESIDE), (0, 0)), mode="reflect")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * _BESIDE + 1, axis=0), axis=-1)
    off = np.linalg.norm(velocities - usual, axis=1) * steps
    allowed = np.maximum(np.maximum(_LEAST_M, _HARDEST * steps**2), _USUAL * np.median(off))
    is_jump = (off > allowed) & (times[1:] >= -half) & (times[:-1] <= half)
    if is_jump.any():
        worst = int(np.where(is_jump, off / allowed, 0.0).argmax())
        jump, least = format_quantity(float(off[worst]), "m"), format_quantity(float(allowed[worst]), "m", 2)
        raise PathFileError(
            f"{name}: jumps by {jump} within {steps[worst]:.3g} s, {times[worst]:+.4g} s from mid-aperture; the "
            f"steps beside it allow {least}",
            "accepted: the log of a flight without steps",
            "Take out the places that are wrong, or smooth the log before",
        )
