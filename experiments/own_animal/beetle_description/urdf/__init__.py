"""URDF of the example beetle, written by make_beetle.py."""
