"""What changed between two missions."""
