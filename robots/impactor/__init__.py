"""A hemisphere-nosed impactor of 44.45 mm diameter, as dropped into water with an accelerometer inside."""
