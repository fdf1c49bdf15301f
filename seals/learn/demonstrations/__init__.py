"""Demonstrations: episodes with metadata, stored memory-mapped or exported as HDF5."""
