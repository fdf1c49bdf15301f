"""Divergence-free smoothed-particle hydrodynamics (DFSPH); `solver.SolverDfsph` is the entry."""
