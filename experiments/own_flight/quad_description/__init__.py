"""ROS package of the example quadrotor."""
