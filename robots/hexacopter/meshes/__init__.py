"""Meshes of the hexacopter, written by make_meshes.py."""
