"""Comparison of a model with measurements: cases, starts, fits, model variants and the report."""
