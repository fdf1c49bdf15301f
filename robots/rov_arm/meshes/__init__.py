"""Meshes of the arm's wrist, written by make_meshes.py; the others are those of the robot aam."""
