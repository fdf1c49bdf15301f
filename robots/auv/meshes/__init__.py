"""Meshes of the underwater vehicle, written by make_meshes.py."""
