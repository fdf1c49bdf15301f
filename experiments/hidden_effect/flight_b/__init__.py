"""Flight b of the quadrotor."""
