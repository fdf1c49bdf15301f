"""Calibration: parameters of a robot, estimated from its logs."""
