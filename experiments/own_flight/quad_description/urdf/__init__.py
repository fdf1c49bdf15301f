"""URDF of the example quadrotor."""
