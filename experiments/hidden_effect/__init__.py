"""Two flights of one quadrotor whose nominal model lacks an effect."""
