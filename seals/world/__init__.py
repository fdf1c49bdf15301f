"""World: robots with effects and sensors in a rigid-body backend, stepped together."""

from seals.world.actor import Actor
from seals.world.drivetrain import Drivetrain
from seals.world.ledger import Ledger
from seals.world.world import World

__all__ = ["Actor", "Drivetrain", "Ledger", "World"]
