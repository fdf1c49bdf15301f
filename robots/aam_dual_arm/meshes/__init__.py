"""Meshes of the two-armed manipulator, written by make_meshes.py."""
