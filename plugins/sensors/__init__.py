"""Sensors: what an instrument really reports."""
