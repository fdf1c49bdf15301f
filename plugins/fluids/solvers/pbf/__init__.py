"""Position-based fluids (PBF): position-based dynamics with compliance, that is XPBD.

`solver.SolverPbf` is the entry. Nothing here imports Taichi before `engine.Engine` is started.
"""
