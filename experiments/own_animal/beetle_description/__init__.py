"""The beetle as a package of ROS would hold it."""
