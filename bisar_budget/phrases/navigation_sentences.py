"""Sentences about navigations in which a GNSS receiver aids an inertial unit."""

NAVIGATION_SENTENCES: dict[str, str] = {
    "navigation-is-smoothed": "smoothed, with the fixes up to {before:s} before and {after:s} after the aperture",
    "navigation-is-filtered": "output of the filter, with the fixes up to {before:s} before the aperture",
    "gnss-errors-are-white": (
        "GNSS errors taken as white: a new one at each fix; gnss.correlation_time states for how long they stay"
    ),
    "navigation-is-shifted": "its covariance is shifted by {level_db:g} dB",
    "navigation-has-no-fix": (
        "no fix from {start:s} to {end:s}: the inertial unit runs free from an error of 10 m, 1 m/s and 1°"
    ),
    "navigation-has-not-converged": (
        "the filter has not converged: at mid-aperture {share:percent .0f} of its error of {quantity} at the start "
        "remains; more flight before or after the aperture, or more fixes, would tell"
    ),
}
