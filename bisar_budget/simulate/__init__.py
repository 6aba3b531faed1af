"""Images of point scatterers with motion errors, from exact ranges: the referee of the limits. Needs NumPy."""
