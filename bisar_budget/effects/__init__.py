"""Effects of errors on range history and image, by the published model, the full one and exact ranges."""

# What other rooms may use.
__all__ = [
    "clocks",
    "combined",
    "declared",
    "echoes",
    "effect",
    "models",
    "oscillators",
    "pieces",
    "random_errors",
    "sources",
    "spectra",
    "subject",
    "tones",
    "vibration",
]
