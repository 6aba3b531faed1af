"""Effects of errors on range history and image, according to the published model, the full model and exact ranges."""

# Names that other packages may import.
__all__ = [
    "aided_navigation",
    "air_delays",
    "combined",
    "declared",
    "effect",
    "error_quantiles",
    "navigation_errors",
    "oscillator_acceleration",
    "oscillator_tones",
    "oscillators",
    "random_effect",
    "random_errors",
    "range_processes",
    "slow_tones",
    "sources",
    "spectra",
    "vibration",
]
