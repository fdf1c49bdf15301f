"""Judged episodes of trainings with several seeds, and their curves."""
