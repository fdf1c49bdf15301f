"""Configuration groups of this package."""
