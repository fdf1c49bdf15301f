"""A Crazyflie 2 quadrotor of 27 g."""
