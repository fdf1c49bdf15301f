"""The world: robots under effects in a rigid-body backend, one step at a time."""

from seals.world.actor import Actor
from seals.world.ledger import Ledger
from seals.world.world import World

__all__ = ["Actor", "Ledger", "World"]
