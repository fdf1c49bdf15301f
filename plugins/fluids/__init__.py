"""Fluid solvers coupled to the rigid bodies.

`solver` is the protocol of particle solvers and `solvers` holds them; `sampling` turns solids into
boundary samples; `coupling` is the shared part of the two domains, `tank` and `moving_domain`.
"""
