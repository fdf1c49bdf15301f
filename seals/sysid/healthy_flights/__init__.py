"""Comparison of a flight with healthy flights of the same vehicle, by the balance of its drives."""
