"""What errors do to range history and image, by the published model, the full one and exact ranges."""

# What other rooms may use.
__all__ = [
    "clocks",
    "collections",
    "combined",
    "declared",
    "echoes",
    "effect",
    "exact_arrays",
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
