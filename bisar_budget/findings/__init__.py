"""What a check finds, as frozen data: statuses, rows, missions, verdicts of images."""

__all__ = ["images", "mission", "monte_carlo", "row", "status"]  # what other rooms may use
