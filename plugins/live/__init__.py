"""Outputs of a run while it goes on, to other programs."""
