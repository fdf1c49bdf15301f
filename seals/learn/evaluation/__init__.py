"""Judges policies on starts that no training has seen, in their own world and in others."""
