"""Example to start from: a hexacopter as a ROS package, for `seals new robot`."""
