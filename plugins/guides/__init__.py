"""Guides: what a robot shall do, from moment to moment."""
