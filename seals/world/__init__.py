"""World: robots with effects and sensors in a rigid-body backend, stepped together."""

from seals.world.actor import Actor as Actor
from seals.world.drivetrain import Drivetrain as Drivetrain
from seals.world.ledger import Ledger as Ledger
from seals.world.world import World as World
