"""ROS package of the example hexacopter."""
