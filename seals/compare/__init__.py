"""Comparison of a model with measurements: cases, fits, model variants, report."""
