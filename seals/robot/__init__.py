"""Robots: reading URDF and meshes, checking them, and the model that the physics sees."""
