"""The protocol of sensor plug-ins, and the onboard state they may read: joints, rotors, battery."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import EffectSet
from seals.robot.model import RobotModel
from seals.sensors.surroundings import Surroundings, no_surroundings

if TYPE_CHECKING:
    from seals.rendering.camera_view import CameraView


class RobotEquipment(NamedTuple):
    """Equipment of a robot, passed to sensors by ``bind``.

    Args:
        joints: names of the movable joints, in the order of their coordinates.
        rotors: number of rotors, in the order of their commands.
        battery: whether it has one.
    """

    joints: tuple[str, ...] = ()
    rotors: int = 0
    battery: bool = False

    @classmethod
    def of(cls, robot: RobotModel, effects: EffectSet) -> RobotEquipment:
        """Return the equipment of a robot."""
        rotors = sum(int(b.hooks.count) for b in effects.actuators if spins(b.effect))
        return cls(robot.joints, rotors, bool(effects.batteries))


class OnboardState(NamedTuple):
    """Onboard state of the robot, evaluated on demand.

    Args:
        joints: joint coordinates [rad or m], shape (J,).
        rotors: speed of every rotor in the last step, as medium and motor leave it [rad/s].
        supply: voltage [V], current [A] and state of charge [1] of the battery.
    """

    joints: Callable[[], Floats]
    rotors: Callable[[], Floats]
    battery_state: Callable[[], tuple[float, float, float]]

    @classmethod
    def bare(cls) -> OnboardState:
        """Return the onboard state of a robot without joints, rotors and battery."""
        return cls(lambda: np.zeros(0), lambda: np.zeros(0), lambda: (0.0, 0.0, 0.0))


def spins(actuator: Any) -> bool:
    """Return whether an actuator's drives are rotors with reaction torque."""
    return "reaction_coefficient" in actuator.constants()


NO_CONTACT: Floats = np.zeros(6)
NO_CONTACT.setflags(write=False)
NOBODY: Mapping[str, Floats] = MappingProxyType({})
NOWHERE, NOTHING_ABOARD = no_surroundings(), OnboardState.bare()


class SensorInput(NamedTuple):
    """Motion, contact and surroundings of a sensor's link at one instant.

    Args:
        time: [s].
        step: time since the last call [s].
        position: link origin, world [m], shape (3,).
        rotation: R_WL, shape (3, 3).
        velocity: of the link origin, link axes [m/s], shape (3,).
        angular_velocity: link axes [rad/s], shape (3,).
        specific_force: acceleration of the link origin in the last step minus gravity, in link axes
            as they were at the start of that step [m/s^2], shape (3,), see `seals.world.felt`.
        angular_acceleration: likewise [rad/s^2], shape (3,).
        contact: force and torque of all contacts of the link in the last step, about the link
            origin, link axes [N, N m], shape (6,).
        pressing: sum of the normal forces of those contacts [N]; zero means nothing touches.
        others: origins of the scene's other bodies, world [m], by name.
        around: water, ground and other bodies, to be asked.
        board: joints, rotors and battery of the robot, to be asked.
        axis_misalignment: turn of a sensor's axes against the stated ones, shape (3, 3), or None.
        camera: view of the scene of a camera, None for other sensors.
        turning: angular velocity at the start of the last step, in link axes as they were then
            [rad/s], shape (3,): that of ``angular_acceleration``; None for ``angular_velocity``.

    Example:
        >>> import numpy as np
        >>> still, up = np.zeros(3), np.array([0.0, 0.0, 9.81])
        >>> felt = SensorInput(0.0, 0.004, still, np.eye(3), still, still, up, still)
        >>> felt.pressing, felt.specific_force.tolist()
        (0.0, [0.0, 0.0, 9.81])
    """

    time: float
    step: float
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    specific_force: Floats
    angular_acceleration: Floats
    contact: Floats = NO_CONTACT
    pressing: float = 0.0
    others: Mapping[str, Floats] = NOBODY
    around: Surroundings = NOWHERE
    board: OnboardState = NOTHING_ABOARD
    axis_misalignment: Floats | None = None
    camera: CameraView | None = None
    turning: Floats | None = None

    def row(self, k: int) -> SensorInput:
        """Return one of many instants, of arrays with a row each; contacts are those of all."""
        names = ("time", "position", "rotation", "velocity", "angular_velocity", "specific_force")
        own = {name: getattr(self, name)[k] for name in (*names, "angular_acceleration")}
        return self._replace(**own, turning=None if self.turning is None else self.turning[k])


@runtime_checkable
class Sensor(Protocol):
    """A sensor: a keyword-only dataclass with explicit memory and a random state passed in.

    `seals.sensors` holds bases with all that sensors share. What a sensor may have beside these,
    and the defaults: `seals.sensors.options.SensorOptions`; and ``sigmas()``, the standard
    deviation of a reading by channel, without drift and bias, for the log.
    """

    link: str
    rate: float

    def channels(self) -> dict[str, int]:
        """Return the channel names of the native log and their numbers of components."""

    def start(self, rng: np.random.Generator) -> Any:
        """Return the initial state."""

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return readings and the new state.

        There are none when none is due, or when the sensor is silent; it may leave out channels.

        Args:
            felt: motion of the sensor's link.
            memory: from the last call.
            rng: random state.
            due: whether a reading is wanted now; filters advance in either case.
        """
