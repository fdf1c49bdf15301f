"""ROS package of the example beetle."""
