"""What a check finds, as frozen data: statuses, rows, missions, verdicts of images."""

# What other rooms may use.
__all__ = ["images", "mission", "monte_carlo", "requirement", "row", "status", "trade"]
