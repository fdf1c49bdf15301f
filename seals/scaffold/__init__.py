"""Generators behind ``seals new``: robot folder from a URDF, data sheet, plug-in package."""
