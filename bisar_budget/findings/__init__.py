"""What a check finds, as frozen data: statuses, rows, missions, verdicts of images."""
