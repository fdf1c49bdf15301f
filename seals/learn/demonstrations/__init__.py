"""Demonstrations: episodes with a card, in memory-mapped files inside and HDF5 outside."""
