"""Readers: one file for each kind of measured log."""
