"""A small buoy: robot.yaml and URDF."""
