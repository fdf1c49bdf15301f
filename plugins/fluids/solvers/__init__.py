"""Particle solvers, one folder each, behind the protocol `fluids.solver.ParticleSolver`.

A further solver needs a dataclass of settings that fulfils `SolverSettings` and a subclass of
`FluidParticles` or `FluidWindow` whose ``physics`` is of that type, registered under its own name.
"""
