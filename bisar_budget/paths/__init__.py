"""Paths of platforms from orbits, logs of flights and geodetic places, in the scene's axes."""
