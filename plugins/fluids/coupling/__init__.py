"""What basin and window share: bodies as samples, their place in the engine, the account."""

from seals.plugins.fluids.coupling.account import account, shown
from seals.plugins.fluids.coupling.bodies import Immersed, add_samples

__all__ = ["ACCOUNTS", "Immersed", "account", "add_samples", "shown"]

ACCOUNTS = (
    "buoyancy",
    "centre of buoyancy",
    "added mass",
    "slamming",
    "linear drag",
    "quadratic drag",
    "angular drag",
    "lift",
    "radiation damping",
    "steady current",
)
"""Phenomena in water that particles account for."""
