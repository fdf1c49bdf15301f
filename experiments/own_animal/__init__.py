"""Example to start from: a beetle as a bare URDF of cylinders and boxes."""
