"""A hemisphere-nosed impactor of 44.45 mm, dropped into water with an accelerometer inside."""
