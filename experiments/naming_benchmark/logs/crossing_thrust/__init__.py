"""Public log of `seals benchmark`: crossing_thrust."""
