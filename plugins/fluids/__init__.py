"""Fluid solvers coupled to the rigid bodies."""
