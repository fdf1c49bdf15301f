"""Two flights of one quadrotor that holds something back from its model."""
