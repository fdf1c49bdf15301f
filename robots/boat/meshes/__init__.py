"""Meshes of the boat."""
