"""Demonstrations: episodes with metadata, in memory-mapped files inside and HDF5 outside."""
