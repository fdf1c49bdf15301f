"""Experiments: one runnable module per figure or table."""
