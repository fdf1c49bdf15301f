"""Viewers: live views and recordings of a run."""
