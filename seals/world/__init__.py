"""The world: robots under effects in a rigid-body backend, one step at a time."""

from seals.world.actor import Actor
from seals.world.drivetrain import Drivetrain
from seals.world.ledger import Ledger
from seals.world.world import World

__all__ = ["Actor", "Drivetrain", "Ledger", "World"]
