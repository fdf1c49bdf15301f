"""Configuration groups that ship with SEALS, found through the seals.conf entry point."""
