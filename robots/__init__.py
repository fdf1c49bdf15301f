"""Robots that ship with SEALS: one folder each with robot.yaml, URDF and meshes."""
