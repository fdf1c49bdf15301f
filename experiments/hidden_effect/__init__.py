"""Two flights of one quadrotor whose stated model lacks an effect."""
