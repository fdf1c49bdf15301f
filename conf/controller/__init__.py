"""Tuned gaits: values of controllers that were found by search."""
