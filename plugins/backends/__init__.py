"""Rigid-body backends: what moves the links."""
