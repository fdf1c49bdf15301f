"""Interface of fluid plug-ins: simulated water with two-way coupling to bodies.

Order of one step of the world, from t to t + h:

1. Every actor evaluates its effects at t; their sum is known before the fluid moves.
2. The fluid gets the bodies where they are at t, with their velocity, what the known loads do to
   them, and how easily they move. It advances itself to t + h and returns the impulse it gave
   to every body on the way.
3. Impulse over h is a wrench that the backend holds for the step. The momentum handed over is
   exact; the instant is not: the wrench is the mean over the step, an error of first order in h.

A backend that keeps velocities at half steps (leapfrog) moves from t to t + h with the velocity
that the kick at t makes of the one at t - h/2. The fluid does the same, so it gets the velocities
at t - h/2. The velocity at t that such a backend reports is that one and half of the last kick
more; a fluid that answered to it would push against its own last push.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

from seals.arrays import Array, Floats
from seals.environment.ground import Solid
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.environment.waves import Sea, Waves
from seals.robot.pieces import Piece
from seals.state_records import state_record


class FluidBody(NamedTuple):
    """A rigid body in the fluid: one link, or several rigidly connected ones.

    Args:
        name: ``actor/link``, for messages.
        pieces: what keeps the fluid out, in axes of the body about its reference point.
    """

    name: str
    pieces: tuple[Piece, ...]


class BodyStates(NamedTuple):
    """All bodies at the start of a step, in the order given to `Fluid.open`; K of them.

    Args:
        position: of the reference points, world [m], shape (K, 3).
        rotation: R_WB, shape (K, 3, 3).
        velocity: of the reference points, world axes [m/s], shape (K, 3).
        spin: angular velocity, world axes [rad/s], shape (K, 3).
        inverse_mass: how easily the reference point moves [1/kg], shape (K,).
        inverse_inertia: how easily the body turns, world axes [1/(kg m^2)], shape (K, 3, 3).
        acceleration: of the reference points by everything but the fluid, world axes [m/s^2],
            shape (K, 3).
    """

    position: Floats
    rotation: Floats
    velocity: Floats
    spin: Floats
    inverse_mass: Floats
    inverse_inertia: Floats
    acceleration: Floats


@state_record
class MomentumBalance(NamedTuple):
    """Linear momentum over the last step, world axes [N s], shape (3,) each.

    before + gravity + sources = after + bodies + walls, up to the rounding of the fluid.

    Args:
        before: of the fluid at the start.
        after: of the fluid at the end.
        gravity: given by gravity.
        sources: given by what the scene does to the fluid: beaches, wind, particles in and out.
        bodies: taken by the bodies.
        walls: taken by everything that stands still or is moved from outside.
        gross: sum of the magnitudes of all impulses exchanged, a number to compare a gap with.
    """

    before: Floats
    after: Floats
    gravity: Floats
    sources: Floats
    bodies: Floats
    walls: Floats
    gross: float

    @property
    def gap(self) -> Floats:
        """Return the residual of the balance [N s], shape (3,)."""
        gain = self.before + self.gravity + self.sources
        return gain - self.after - self.bodies - self.walls


class Surrounding(NamedTuple):
    """Environment, waves and step with which a fluid is opened.

    Args:
        environment: gravity, water and its level.
        waves: motion of the sea outside the simulated part.
        solids: that stand still.
        step: of the world [s].
    """

    environment: EnvironmentSettings
    waves: Waves
    solids: Sequence[Solid]
    step: float


class FluidOptions:
    """Optional attributes of a fluid and their defaults."""

    lacks_drag: bool = False
    """Whether the stated drag of a robot is added as far as the fluid does not resolve it."""


@runtime_checkable
class Fluid(Protocol):
    """A fluid plug-in: a keyword-only dataclass, opened once for each world."""

    name: ClassVar[str]
    """Its name in the ledger."""

    accounts_for: ClassVar[tuple[str, ...]]
    """Phenomena in water that no effect may own beside it, see `seals.effects.Effect`."""

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return the static solids that the fluid adds, such as tank walls."""

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Prepare the fluid and the boundaries.

        Raises:
            SealsError: it does not fit, says what does.
        """

    def initialise(self, states: BodyStates) -> None:
        """Fill the domain at rest around the bodies, at time zero; the state is reset."""

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance from ``time`` by ``step`` [s]; return the impulses on the bodies.

        Returns:
            Force and torque times step about the reference points, world axes [N s, N m s],
            shape (K, 6).
        """

    def surface(self, position: Array) -> Sea:
        """Return surface and flow at points (N, 3), as known from the last step."""

    def momentum_balance(self) -> MomentumBalance | None:
        """Return the momentum balance of the last step; None before the first."""

    def diagnostics(self) -> Mapping[str, float]:
        """Return diagnostics by name: particles, compression, losses; unit in the name."""

    def particles(self) -> tuple[Floats, Floats]:
        """Return positions [m] and velocities [m/s] for viewers, (n, 3) each; may be empty."""

    def snapshot(self) -> Any:
        """Return an opaque copy of the complete state."""

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""

    def close(self) -> None:
        """Release memory and devices."""


class SeaOfFluid:
    """Adapter of a fluid's surface to the interface of waves, for effects and sensors.

    Args:
        fluid: open.
    """

    def __init__(self, fluid: Fluid) -> None:
        self.fluid = fluid

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points, as the last step left it."""
        return self.fluid.surface(position)
