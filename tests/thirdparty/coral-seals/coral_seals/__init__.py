"""Plug-ins for reefs, made outside SEALS."""
