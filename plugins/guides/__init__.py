"""Guides (reference generators): the wanted motion of a robot over time."""
