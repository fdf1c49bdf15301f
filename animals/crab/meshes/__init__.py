"""Meshes of the crab, written by make_crab.py."""
