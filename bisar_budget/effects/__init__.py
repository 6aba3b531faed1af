"""What errors do to range history and image, by the published model, the full one and exact ranges."""

# What other rooms may use.
__all__ = [
    "combine",
    "correlation",
    "echoes",
    "effect",
    "exact_arrays",
    "exact_ranges",
    "models",
    "pieces",
    "point_path",
    "slow_vibration",
    "sources",
    "subject",
    "vibration_lines",
]
