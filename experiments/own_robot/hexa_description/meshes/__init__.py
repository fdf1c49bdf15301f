"""Meshes of the example hexacopter."""
