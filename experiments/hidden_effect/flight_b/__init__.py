"""Flight B of the quadrotor: the held-out log."""
