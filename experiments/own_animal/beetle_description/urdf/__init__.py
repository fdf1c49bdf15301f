"""Written by make_beetle.py."""
