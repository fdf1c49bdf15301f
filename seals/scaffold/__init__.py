"""Scaffolds: a robot folder from a bare URDF, a package for an effect or a sensor."""
