"""Sensors: models of instruments with noise, bias, delay and rate."""
