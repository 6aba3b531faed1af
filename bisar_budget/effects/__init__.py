"""Effects of errors on range history and image, by the published model, the full one and exact ranges."""

# What other rooms may use.
__all__ = [
    "combined",
    "declared",
    "effect",
    "lever_arms",
    "navigation_errors",
    "oscillator_acceleration",
    "oscillators",
    "other_errors",
    "propagation",
    "random_effect",
    "random_errors",
    "sources",
    "spectra",
    "vibration",
    "vibration_spectra",
]
