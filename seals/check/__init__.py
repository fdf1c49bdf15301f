"""Checks of a robot folder, as ``seals check`` asks them: masses, hulls, joints, drives, meshes."""
