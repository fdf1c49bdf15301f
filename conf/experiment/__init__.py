"""Whole recipes."""
