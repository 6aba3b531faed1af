"""Every sentence that warns of a mission file, in one place, as in `phrases`: its name is its code."""

from collections.abc import Sequence

from bisar_budget.phrases import phrase
from bisar_budget.units import format_quantity


# ---------------------------------------------------------------------- what is checked
@phrase
def another_mission(changes: str) -> str:
    """Of a mission that options changed."""
    return f"checked is not the mission of the file: {changes}"


@phrase
def nothing_declared() -> str:
    """Of a mission that states no error."""
    return "no error is declared: nothing was judged"


@phrase
def full_model_gates(model: str) -> str:
    """Of a mission with a direct path, which asks for another model."""
    return f"allocation.model {model}: the published model does not know the direct path; the full model gates"


# ---------------------------------------------------------------------- how platforms fly
@phrase
def path_is_doubtful(platform: str, doubt: str) -> str:
    """Of a path by an orbit or a log."""
    return f"platforms.{platform}: {doubt}"


@phrase
def satellite_flies_straight(platform: str, speed: float, acceleration: Sequence[float], has_axes: bool) -> str:
    """Of a satellite's path without the acceleration of its orbit. [m/s, m/s²]"""
    parts = ", ".join(f"{part + 0.0:.3f} m/s^2" for part in acceleration)
    if has_axes:
        how = "(gravity of a point mass, less what the Earth's rotation adds)"
    else:
        how = (
            "(towards the Earth's centre; the Earth's rotation changes it by up to 1.1 m/s^2, which needs the "
            "latitude)"
        )
    return (
        f"platforms.{platform}: {speed / 1e3:.3g} km/s is the speed of a satellite, and the path is straight. "
        f"A circular orbit has acceleration: [{parts}] {how}"
    )


# ---------------------------------------------------------------------- how errors are stated
@phrase
def stated_twice(platform: str) -> str:
    """Of a platform with an acceleration error and an accelerometer bias."""
    return f"platforms.{platform}.motion_error: acceleration and the accelerometer bias are both stated; they add"


@phrase
def correlations_not_used(platform: str) -> str:
    """Of a covariance where each error is judged alone."""
    return (
        f"platforms.{platform}.motion_error.covariance: correlations are not used where each error is judged alone; "
        "combine: rss uses them"
    )


@phrase
def no_power_law_fits(key: str, misfit: float) -> str:
    """Of an oscillator's Allan deviation."""
    return f"{key}: no power law fits the Allan deviation; the fit is off by {100 * misfit:.3g} %"


@phrase
def exchanges_are_rare(aperture_time: float) -> str:
    """Of clocks that are synchronised less than once in an aperture. [s]"""
    return (
        f"synchronization.interval: pulses are exchanged less than once in an aperture of {aperture_time:g} s; "
        "straight lines between them may make the phase worse than it is without"
    )


# ---------------------------------------------------------------------- autofocus
@phrase
def walks_over_range_cells(n_pull: float, cells: float, cap: str) -> str:
    """Of a pull-in range that range walk does not leave; `cap` is the `n_pull` of half a cell, rounded down."""
    return (
        f"autofocus.n_pull: {n_pull:g} counts as {cap}, f0/B, where an error walks half a range cell; one of "
        f"{n_pull:g}π rad walks {cells:.3g} cells, which correction along one dimension does not take out"
    )


@phrase
def smears_beyond_the_scene(
    n_pull: float, smear: float, algorithm: str, room: float, radius: float, held: str
) -> str:
    """Of a pull-in range that the scene's size does not leave. [m]"""
    return (
        f"autofocus.n_pull: an error of {n_pull:g}π rad smears a point over {format_quantity(smear, 'm')}; "
        f"{algorithm} needs {room:g} times that. A scene of {format_quantity(2 * radius, 'm')} across holds "
        f"n_pull {held}"
    )


# ---------------------------------------------------------------------- ids of rows
@phrase
def id_of_no_row(row_id: str) -> str:
    """Of a key of `requirement_ids`."""
    return f"requirement_ids: {row_id} is the id of no row"


@phrase
def waiver_matches_nothing(row_id: str) -> str:
    """Of a waiver."""
    return f"waiver {row_id}: matches no row"


@phrase
def waiver_matches_everything(row_id: str) -> str:
    """Of a waiver."""
    return f"waiver {row_id}: names every row and would hide any new failure"


@phrase
def waiver_not_used(row_id: str) -> str:
    """Of a waiver."""
    return f"waiver {row_id}: not used: no row that it names fails"


# ---------------------------------------------------------------------- images
@phrase
def limit_is_optimistic(row_id: str, shown: str) -> str:
    """Of a limit of no row of the check that an image refutes."""
    return f"{row_id}: optimistic limit: {shown}"


@phrase
def nothing_verified(rows: int) -> str:
    """Of a mission of whose limits no image gave a verdict."""
    return (
        f"nothing was verified: {rows} row{'s' if rows != 1 else ''} with a limit, and no image gave a verdict on any"
    )
