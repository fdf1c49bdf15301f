"""Robots: reading and checking of URDF and meshes, and the physical model."""
