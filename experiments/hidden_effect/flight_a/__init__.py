"""Flight a of the quadrotor."""
