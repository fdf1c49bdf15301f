"""Example recordings: two flights of one quadrotor, by its autopilot and by ROS 2."""
