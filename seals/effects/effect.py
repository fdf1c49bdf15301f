"""The base class of effect plug-ins, and the hooks they may define."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias, runtime_checkable

from seals.arrays import Array, Floats
from seals.effects.derived import default_additions
from seals.effects.identification import (
    Addition,
    Identification,
    Residual,
    Subject,
)
from seals.field_roles import roles
from seals.motion import MediumKind as MediumKind  # noqa: PLC0414  offered to authors here
from seals.motion import (
    Timing,
)

if TYPE_CHECKING:
    from seals.environment.settings import EnvironmentSettings
    from seals.robot.model import RobotModel

Parameters: TypeAlias = Mapping[str, Array]
"""Parameter arrays: scalars of shape (1 or N, 1).

``stem_x``, ``stem_y``, ``stem_z`` are joined into ``stem`` of shape (1 or N, 3).
"""


class EffectOptions:
    """Optional attributes of an effect and their defaults."""

    medium: MediumKind | None = None
    """Medium in which it acts; None for an effect that knows no medium, such as gravity."""

    sensors: Sequence[str] = ()
    """Names of the sensors of which it is a fault; none for all inertial ones."""

    order: ClassVar[int] = 0
    """Place among the effects that change a reading: those of lower order act first."""

    actuator: ClassVar[str] = "rotors"
    """Actuator on which it is tried out, for an effect of drives."""

    material: ClassVar[Mapping[str, Any]] = {}
    """Values with which it is tried out, where defaults and natural scales are no good ones."""

    log_words: ClassVar[Mapping[str, Enum]] = {}
    """Words of fields in which a log that states none means another than the field's default."""

    @property
    def full_voltage(self) -> float | None:
        """Voltage of the full battery [V]; None for an effect that knows no battery."""
        return None


@roles(data="links correction")
@dataclass(kw_only=True)
class Effect(EffectOptions):
    """Base of all effect plug-ins: a keyword-only dataclass with pure, batch-first hooks.

    A hook is a static method that names what it takes, in any order, of ``motion, medium, joints,
    inputs, memory, params`` and returns ``(output, new memory)``:

    - ``loads``: `Wrench` about the link origin, link axes [N, N m], each shape (N, 3).
    - ``inertia``: `AddedInertia`, a 6x6 matrix [linear, angular] about the link origin, link axes,
      and its weight; the integrator makes the Coriolis and Munk terms from it, but not from its
      part ``more``, relative to the flow of the effect's medium.
    - ``flow``: velocity of the effect's medium, world axes [m/s], shape (N, 3); effects add up.
    - ``drive_loads``: `Wrench` of what the actuators cause; their `Drives` are named ``drives``.
    - ``joint_loads``: generalised force on the joints [N m or N], shape (N, J).

    ``loads`` and ``flow`` may also name ``scene``, a `seals.effects.scene.Scene`: the fluid at any
    place, and the rotors of other robots. Machine code does not have it.

    Joints have a row for every row of the motion, or one for all. In ``joint_loads``, motion and
    medium are those of the links that the joints move, rows joint by joint (J N, k), whatever
    ``links`` says; `seals.by_joint` turns a column of them into (N, J). Physical parameters and
    `constants` are in ``params``. Arguments whose names resemble none of these are given by their
    order: ``motion, medium, inputs, memory, params``, with ``drives`` before them in
    ``drive_loads``, and ``joints, inputs, memory, params`` in ``joint_loads``.

    Hooks of other signatures, given with each:

    - ``joint_drive(joints, inputs, params) -> JointDrive``, beside ``joint_loads``: the same law
      before its limit, with its slopes, so that steps can take it implicitly.
    - ``joint_resistance(joints, inputs, params) -> Array``, beside ``joint_loads``: the share of
      the rates in them, force = -share q' [N m s/rad or N s/m], not negative, shape (N, J); steps
      take it implicitly, so that resistance never drives a joint.
    - ``drives(inputs, params) -> Drives`` of an actuator: thrusts and reaction torques.
    - ``actuation(drives, motion, medium, inputs, params) -> Drives``: what the actuators really do.
    - ``command(command, radius, params) -> command``: what the drives of an actuator on the link
      are told of a command, before their lag, in their unit, shape (1 or N, n); ``radius`` as in
      `Drives`.
    - ``battery_update(power, inputs, memory, params) -> new memory`` of a battery under the
      power of all drives [W], and ``state(memory, params) -> (voltage, current, charge)`` of it.
    - ``timing(params) -> Timing``: later commands, slower actuators, late sensors.
    - ``measure(reading, params) -> Reading``: what the inertial sensors really report.
    - ``pose_turn(params) -> rotation vector``: turn of the measured against the true attitude, body
      axes [rad], shape (N, 3); a fit knows it, a simulation records the true attitude.
    - ``axis_misalignment(params) -> rotation matrix``: turn of the axes of other sensors on the
      link against the stated ones, shape (N, 3, 3).
    - ``inertia_change(body, params) -> matrix``: change of the rigid inertia of the link, 6x6 about
      its origin; weight and centre of mass follow from it.

    Args:
        links: link names; ``root`` is the base link and ``*`` every link.
        correction: True for a deliberate addition to an effect of the same kind on the same link,
            for example a change found by comparison with measurements.

    Example:
        >>> from seals.plugins.effects.linear_drag import DragLinear
        >>> issubclass(DragLinear, Effect), DragLinear(coefficient_x=0.2).coefficient_x
        (True, 0.2)
    """

    links: list[str] = field(default_factory=lambda: ["root"])
    correction: bool = False

    accounts_for: ClassVar[tuple[str, ...]] = ()
    """Phenomena this effect owns; two owners of one phenomenon on one link are refused."""

    memory_size: ClassVar[int] = 0
    """Numbers of memory per link, zero at reset."""

    identification: ClassVar[Identification] = Identification()
    """What system identification must know of the effect: plausible sizes, traits."""

    stiff: ClassVar[bool] = False
    """Whether the law changes so steeply with speed that explicit steps of a log's length fail."""

    zero_when_dry: ClassVar[bool] = False
    """Whether nothing is left of the effect in water where nothing of the robot is submerged."""

    @property
    def surveying(self) -> bool:
        """Whether a hook that names ``scene`` uses it: then the robot has no machine code."""
        return True

    def ambient(self) -> Effect | None:
        """Return the effect for the other bodies of the scene; None if it is the robot's own."""
        return None

    def spring(self) -> float:
        """Return the stiffness between robot and world [N/m], for the check of the time step.

        Zero for none, and for springs that water or ground make.
        """
        return 0.0

    def constants(self) -> dict[str, Floats]:
        """Return additional arrays for ``params``, from options that are not parameters.

        Shape (1, 1) for a number, so that it broadcasts along the rows: the index of a joint.
        """
        return {}

    @classmethod
    def of_log(
        cls,
        name: str,
        parameters: Mapping[str, float],
        medium: str | None,
        environment: EnvironmentSettings,
    ) -> tuple[str, Effect]:
        """Return instance name and effect for an entry of a log's stated model.

        Args:
            name: under which the effect is installed.
            parameters: as the log states them.
            medium: water, air or any; None if the log states none.
            environment: of the log.
        """
        # a log states a medium for every effect, though some have none
        own = {} if medium is None or cls.medium is None else {"medium": MediumKind(medium)}
        options: dict[str, Any] = {**cls.log_words, **parameters, **own}
        return name if medium is None else f"{name}_{medium}", cls(**options)

    @classmethod
    def of_surroundings(
        cls, name: str, robot: RobotModel, environment: EnvironmentSettings
    ) -> dict[str, Effect]:
        """Return the instances that the environment adds to every robot.

        Args:
            name: under which the effect is installed.
            robot: on which they act.
            environment: air, water, ground.
        """
        return {}

    @classmethod
    def options_on(
        cls, robot: RobotModel, effects: Mapping[str, Effect], medium: MediumKind | None
    ) -> dict[str, Any]:
        """Return the options that a candidate has on a robot, such as the shape of its body.

        Args:
            robot: on which it may be missing.
            effects: of the stated model by instance.
            medium: in which the candidate acts; None for an effect that knows no medium.
        """
        return {}

    @classmethod
    def additions(cls, name: str, subject: Subject) -> Sequence[Addition]:
        """Return the candidates: the variants in which the effect may be missing on a vehicle.

        The default derives them from the fields, the hooks and ``identification``.

        Args:
            name: under which the effect is installed.
            subject: the vehicle of a diagnosis.
        """
        return default_additions(cls, name, subject)

    @staticmethod
    def guesses(residual: Residual) -> list[dict[str, float]]:
        """Return starting values of a fit by parameter, best first, from the residual force.

        Args:
            residual: the force that a model without the effect leaves over.
        """
        return []

    @staticmethod
    def plausible(position: Floats) -> dict[str, float]:
        """Return plausible parameters, where ``scales`` do not state them.

        Args:
            position: mean place of the vehicle, world axes [m], shape (3,).
        """
        return {}

    def as_stated(
        self, values: Mapping[str, float], changes: Mapping[str, float], rates: Floats
    ) -> dict[str, float]:
        """Convert fitted parameters to those of the documented law, where the fit smooths it.

        Args:
            values: of the reported parameters.
            changes: fitted changes of all parameters of this instance.
            rates: of the joints along the log [rad/s], shape (T, J).
        """
        return dict(values)


def number_lists(effect: Effect) -> tuple[str, ...]:
    """Return the names of the fields that hold lists or matrices of numbers.

    Args:
        effect: a dataclass; its parameters are single numbers.

    Example:
        >>> from seals.registry import get
        >>> number_lists(get("effect", "added_mass").load()())
        ('coupling', 'floating')
    """
    kinds = ("list[float]", "list[list[float]]")
    return tuple(f.name for f in fields(effect) if str(f.type) in kinds)


@runtime_checkable
class Timed(Protocol):
    """An effect with the hook ``timing``."""

    @staticmethod
    def timing(params: Parameters) -> Timing:
        """Change of delays and time constants."""


class ActuatorOptions:
    """Optional attributes of an actuator and their defaults; see `options_of`."""

    voltage_power: ClassVar[float] = 1.0
    """Power of the battery's voltage to which the drives' limits are proportional [1]."""
    scaled_by: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Parameter for a relative change of all drives, and unit, by the list that it scales."""
    turned_by: ClassVar[Mapping[str, str]] = {}
    """List of the drives' directions by the list whose effect changes its sign with them."""

    @property
    def fall(self) -> Floats | None:
        """Spin-down time constants [s], shape (n,); None where equal to ``lag``."""
        return None

    @property
    def low(self) -> Floats | None:
        """Lowest commands of the drives, rad/s or N, shape (n,); None for the default.

        These are zero for rotors and the negative limit for thrusters.
        """
        return None
