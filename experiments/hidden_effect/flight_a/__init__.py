"""Flight A of the quadrotor: the log to diagnose."""
