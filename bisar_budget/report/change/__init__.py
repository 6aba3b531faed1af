"""Changes between two missions."""
