"""Readers of measured logs, one file per format or data set."""
