"""What every format says alike, and how text is laid out and escaped."""
