"""Comparison of a model with measurements: cases, starts, fits, error ladders and the report."""
