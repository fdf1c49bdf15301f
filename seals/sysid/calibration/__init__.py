"""Calibration of stated numbers of a robot from its logs."""
