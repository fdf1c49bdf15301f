"""URDF of the example hexacopter."""
