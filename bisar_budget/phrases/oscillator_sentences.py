"""Sentences about oscillators, clocks and their synchronisation."""

OSCILLATOR_SENTENCES: dict[str, str] = {
    "clocks-are-not-set": (
        "{row_ids:list}: free-running oscillators displace the image as they drift after they were set, and the "
        "file does not state how they were set; add synchronization.method holdover with age and averaging, or "
        "timing_error.constant and timing_error.linear, the residual clock error at mid-aperture"
    ),
    "drift-is-not-stated": (
        "in holdover a clock drifts with its oscillator, whose noise the file does not state: add "
        "{platforms:and platforms.*.oscillator}"
    ),
    "noise-between-pulses-is-not-stated": (
        "between exchanged pulses both clocks run free, but the file states only one oscillator: add "
        "{platforms:and platforms.*.oscillator}"
    ),
    "one-point-of-allan-deviation": (
        "one point of an Allan deviation does not give the kind of noise: the worst for this aperture is assumed"
    ),
    "flicker-is-assumed": (
        "an Allan deviation does not distinguish white from flicker phase noise: flicker is assumed"
    ),
    "allan-deviation-begins": (
        "the Allan deviation begins at {time:g} s; its power law is continued down to the aperture time"
    ),
    "allan-deviation-ends": (
        "the Allan deviation ends at {time:g} s; its power law is continued up to the aperture time"
    ),
    "mask-is-cut": (
        "phase noise counts up to `bandwidth`, {bandwidth:Hz 4}; the mask extends to {last:Hz 4}, with {beyond:rad} "
        "rms above"
    ),
    "mask-begins": "the mask begins at {frequency:g} Hz; below, it continues as f^(−{slope:.3g})",
    "rests-on-the-continuation": (
        "{percent:.0f} % of its power lies below the first point of the mask of "
        "{platforms:and platforms.*.oscillator}, where the noise is assumed to continue as f^-3: a mask down to "
        "{least:Hz 2 down} would state it"
    ),
    "mask-at-the-frequency-of-a-part": (
        "platforms.{platform}.oscillator.phase_noise: states no frequency, and is assumed at {frequency}, that of "
        "{part}: add oscillator.frequency"
    ),
    "no-power-law-fits": (
        "{key}: no power law fits the Allan deviation; the fit is off by {misfit:percent}: state phase_noise or "
        "power_law instead of allan_deviation"
    ),
    "power-law-fits": "the power law fits the Allan deviation to {misfit:percent .2g}",
    "noise-is-shifted": "its noise is shifted by {level_db:g} dB",
    "left-by-exchanges": "after synchronisation every {interval:s}",
    "points-are-sorted": "the points of the file are not in rising order: they are sorted",
    "setting-is-perfect": (
        "the file has no {missing:and synchronization.*}: the clocks are assumed to be set without that error"
    ),
    "mask-ends-within-the-band": (
        "phase noise counts up to the mask's last point, {last:Hz}: above it, up to the bandwidth of "
        "{bandwidth:Hz}, none is stated"
    ),
    "left-since-setting": (
        "drift since the clock was set {age:s} before mid-aperture, by a line fitted over {averaging:s}"
    ),
    "heard-twice": "only its change in the {delay:s} between the direct path and the echo counts",
    "another-for-each-pulse": "the error is independent from pulse to pulse: all of it adds to the ISLR",
}
