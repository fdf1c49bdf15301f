"""Logs with a hidden physical effect, made by a simulator that shares nothing with the package.

Start with `generate`; README.md tells how each law differs from the catalogue's.
"""
