"""Sentences that explain why a row has no limit or no value."""

NO_LIMIT_SENTENCES: dict[str, str] = {
    "no-quadratic-term-of-position": "no quadratic term: a position error moves the image (Table I)",
    "no-component": "no quadratic term: the platform's {cause} has no component along {axis}",
    "no-common-component": "no quadratic term: the platforms' {cause} have no component along {axis}, or cancel",
    "no-quadratic-term-of-time-tag": "a straight path is displaced along itself: no quadratic term",
    "no-quadratic-term-of-registered": "no quadratic term: {kind} has no such motion along the line of sight",
    "no-quadratic-term-of-clock": "no quadratic term: the clock's {term} term has another order (Table I row 1)",
    "no-quadratic-term-of-setting": "no quadratic term: a {kind} between the clocks moves the image (Table I row 1)",
    "aging-is-followed": "the clocks are synchronised: aging has no effect",
    "no-quadratic-term-of-height": "no quadratic term: in the published model a height error moves the image",
    "no-size-reaches-the-limit": "no error up to a tenth of the slant range reaches the limit",
    "no-quadratic-phase": "no quadratic phase",
    "clock-is-heard": "the direct path is the clock: a timing error has no effect",
    "oscillators-drop-out": "the direct path is the receiver's clock: the transmitter's oscillator drops out",
    "no-phase-noise": "no phase noise",
    "across-the-line-of-sight": "no component along the line of sight: no phase",
    "nothing-spreads": "no quadratic phase, no cubic phase and no ISLR",
    "no-requirement-limits": "no requirement limits its {effects:and}",
    "same-all-over-the-scene": "in the published model an error has the same effect all over the scene",
    "no-ground-point": "with a declared error no ground point has the recorded range history",
    "no-image": "with a declared error no ground point has the recorded range history: no image",
    "no-image-to-place": "with a declared error no ground point has the recorded range history: there is no image",
    "no-displacement": (
        "(25) gives no displacement here: with the range held constant, range and Doppler gradients are "
        "{degrees:.2g} deg from parallel"
    ),
    "no-displacement-across": (
        "(25) gives no displacement here: the look vectors cancel to {gradient:.2g} on the ground at mid-aperture"
    ),
    "no-image-at-the-edge": "no image at the scene's edge, azimuth {azimuth_deg:.0f} deg: {why}",
    "platform-at-the-edge": "a platform is within {distance:g} m of it",
    "gradients-become-parallel": "on the way there range and Doppler gradients become parallel",
}
