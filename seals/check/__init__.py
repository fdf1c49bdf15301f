"""Plausibility checks of a robot folder for ``seals check``."""
