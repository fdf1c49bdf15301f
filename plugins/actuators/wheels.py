"""Motors that turn wheels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.motion import Inputs, JointDrive, Joints
from seals.multibody.servo import limited
from seals.schema import param

_NONE = 1e-9
"""Smallest limit of a drive, at its no-load speed and of joints that it does not turn [N m]."""
MOST = 64
"""Wheels of one actuator."""


@roles(data="wheels")
@dataclass(kw_only=True)
class Wheels(Effect):
    """Speed-controlled DC motors with gears, one on each of some continuous joints.

    The command of such a joint is a speed, not an angle. The force on the robot is that of the
    ground on the wheels: grip, slip and the weight on each wheel are those of the contacts.

    Equation:
        tau = clip(k (w_d - w), -L, L), L = min(torque_limit, tau_s (1 - s w / w_0)), s the sign of
        the torque: the torque-speed line of a DC motor at its full voltage. Zero torque without a
        command.

    Args:
        wheels: numbers of the joints that it turns, counted from 1 in the order of the robot's
            joints.
        stall_torque: tau_s, at the wheel and standstill, at full voltage [N m].
        no_load_speed: w_0 of the wheel, at full voltage [rad/s].
        torque_limit: largest torque that the electronics allow, by their limit of the current
            [N m].
        gain: k of the speed loop [N m s/rad].
        armature: inertia of rotor and gear seen at the wheel [kg m^2]; not part of the torque, the
            caller adds it to the joint's inertia.
        radius: rolling radius of the wheels, for controllers [m].
        links: not used; motors act on joints.

    Assumptions:
        The current loop is far faster than the wheel; the gear has no losses of its own, see
        ``joint_friction``.

    Valid range:
        Brushed and brushless motors without field weakening. Steps take the speed loop implicitly;
        the torque-speed line is explicit: time.step below 2 I w_0 / tau_s, I with the armature.

    Limitations:
        The voltage of a battery does not change it, and it draws no current of one. A joint has
        either a wheel motor or a servo: set the gains of ``servos`` to zero there.

    References:
        Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics: Modelling, Planning and Control,
        ch. 5.2 (velocity-controlled electric drives).

    Example:
        >>> Wheels(wheels=[1, 2], stall_torque=1.4).stall_torque
        1.4
    """

    wheels: list[int] = field(default_factory=lambda: [1, 2])
    stall_torque: float = param(
        1.4,
        "N m",
        bounds=(1e-6, 1e6),
        tolerance=0.1,
        relative=True,
        source="a geared motor of 57 g, XL430-W250 at 11.1 V",
    )
    no_load_speed: float = param(
        5.97,
        "rad/s",
        bounds=(1e-3, 1e5),
        tolerance=0.1,
        relative=True,
        source="57 rev/min, XL430-W250 at 11.1 V",
    )
    torque_limit: float = param(
        1e6, "N m", bounds=(1e-6, 1e6), tolerance=0.0, source="none unless stated", fit=False
    )
    gain: float = param(
        1.0, "N m s/rad", bounds=(0.0, 1e5), tolerance=0.1, relative=True, source="chosen"
    )
    armature: float = param(
        0.0,
        "kg m^2",
        bounds=(0.0, 1e3),
        tolerance=0.0,
        source="zero unless stated for the vehicle",
        fit=False,
    )
    radius: float = param(
        0.033, "m", bounds=(1e-4, 10.0), tolerance=0.0, source="the URDF's wheels", fit=False
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("wheel drive",)

    def __post_init__(self) -> None:
        """Refuse what is no list of joints."""
        numbers: list[Any] = list(self.wheels)
        plain = all(type(k) is int and 1 <= k <= 10_000 for k in numbers)
        if not plain or not 1 <= len(set(numbers)) == len(numbers) <= MOST:
            raise ConfigError(
                f"wheels.wheels={numbers} is not allowed.\n"
                f"Allowed: numbers of 1 to {MOST} joints, counted from 1, each once"
            )

    @property
    def joints(self) -> tuple[int, ...]:
        """Indices of the joints that it turns."""
        return tuple(k - 1 for k in self.wheels)

    def of_joints(self, gain: str, joints: int) -> Floats:
        """Return one gain at every joint, shape (joints,); zero where there is no wheel.

        Args:
            gain: ``kp``, which is zero, ``kd``, ``torque_limit`` or ``armature``.
            joints: number of joints.

        Raises:
            ConfigError: it turns a joint that the robot does not have.
        """
        if max(self.wheels) > joints:
            raise ConfigError(
                f"wheels.wheels={self.wheels}: the robot has {joints} joints.\n"
                "Allowed: their numbers, counted from 1; see: seals check robot=..."
            )
        most = min(self.torque_limit, self.stall_torque)
        value = {"kp": 0.0, "kd": self.gain, "torque_limit": most, "armature": self.armature}[gain]
        found = np.zeros(joints)
        found[list(self.joints)] = value
        return found

    def constants(self) -> dict[str, Floats]:
        """Return the numbers of the joints, shape (1, wheels)."""
        return {"wheels": np.array([self.wheels], dtype=float)}

    @staticmethod
    def joint_drive(joints: Joints, inputs: Inputs, params: Parameters) -> JointDrive:
        """Unlimited torque of the motors [N m], its fall with the speed, and the limit."""
        rate = joints.velocity
        xp = namespace(rate)
        number = xp.cumulative_sum(xp.ones_like(rate[:1, :]), axis=1)
        chosen = 0.0 * number
        for k in range(params["wheels"].shape[1]):
            chosen = chosen + xp.astype(number == params["wheels"][:, k : k + 1], rate.dtype)
        none = rate * 0.0
        if inputs.joint_command is None:
            return JointDrive(none, none, none, none + _NONE)
        damping = chosen * params["gain"]
        force = damping * (inputs.joint_command - rate)
        # with the torque, the motor's own voltage takes from that of the supply
        along = xp.where(force < 0.0, -rate, rate)
        line = params["stall_torque"] * (1.0 - along / params["no_load_speed"])
        limit = chosen * xp.minimum(line, none + params["torque_limit"])
        return JointDrive(force, none, damping, xp.maximum(limit, none + _NONE))

    @staticmethod
    def joint_loads(
        joints: Joints, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Torque of the motors [N m]."""
        return limited(Wheels.joint_drive(joints, inputs, params)), memory
