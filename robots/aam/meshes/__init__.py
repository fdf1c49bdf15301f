"""Meshes of the aerial-aquatic manipulator, written by make_meshes.py."""
