"""Sentences about navigations in which a GNSS receiver aids an inertial unit."""

NAVIGATION_SENTENCES: dict[str, str] = {
    "navigation-is-smoothed": "smoothed, with the fixes up to {before:s} before and {after:s} after the aperture",
    "navigation-is-filtered": "output of the filter, with the fixes up to {before:s} before the aperture",
    "gnss-errors-are-white": (
        "GNSS errors taken as white: a new one at each fix; gnss.correlation_time states for how long they stay"
    ),
    "navigation-is-shifted": "its covariance is shifted by {level_db:g} dB",
    "navigation-has-no-fix": (
        "platforms.{platform}.motion_error.navigation: no fix from {start:s} to {end:s}: the inertial unit runs free "
        "from an error of 10 m, 1 m/s and 1°"
    ),
    "navigation-has-not-converged": (
        "platforms.{platform}.motion_error.navigation: the filter has not converged: at mid-aperture "
        "the {quantity} error is {share:percent .0f} of the one assumed at the start; add flight before or after the "
        "aperture, or fixes"
    ),
    "scale-factor-in-a-turn": (
        "platforms.{platform}.motion_error.navigation.imu: the path accelerates within the aperture, and the scale "
        "factor makes a QPE of up to {phase:rad} of it, which no row contains"
    ),
    "sensor-runs-free": (
        "platforms.{platform}.motion_error: the figures of the inertial sensor run free over the aperture, and make "
        "a QPE of {free:rad}; if GNSS aids the sensor, use navigation"
    ),
    "sensor-runs-free-not-aided": (
        "platforms.{platform}.motion_error: the figures of the inertial sensor run free over the aperture, and make "
        "a QPE of {free:rad}; aided by the GNSS receiver, with {rate:g} fix a second and smoothed, they leave "
        "{aided:rad}: use navigation"
    ),
    "position-and-velocity-contradict": (
        "{platforms:and platforms.*.motion_error}: sigmas of {position:m} and {velocity:m/s} contradict each other, "
        "{way:m} in half an aperture: use navigation"
    ),
}
