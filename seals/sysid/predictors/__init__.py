"""Predictions of the measurements by a model: linearised windows, whole runs, batch simulation."""
