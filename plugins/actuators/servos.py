"""Position servos of the joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats
from seals.effects.effect import Effect, Parameters
from seals.motion import Inputs, JointDrive, Joints
from seals.multibody.servo import limited
from seals.plugins.actuators.layout import numbers
from seals.schema import param

_EACH = {
    "kp": ("kp_each", "not negative"),
    "kd": ("kd_each", "not negative"),
    "torque_limit": ("torque_limit_each", "positive"),
    "armature": ("armature_each", "not negative"),
}
"""List that rules over each number, and its sign."""


@dataclass(kw_only=True)
class Servos(Effect):
    """Position servos with proportional and derivative gain, one on every joint.

    Equation:
        tau = clip(kp (command - q) + kd (rate - q'), -torque_limit, torque_limit), the joint drive
        F = Kd (Vd - V) + Ks (Pd - P); the commanded rate is zero unless given; zero torque without
        a command. The caller makes the command from what is asked: delay, then a change by no more
        than speed_limit.

    Args:
        kp: stiffness of all joints [N m/rad].
        kd: damping of all joints [N m s/rad].
        torque_limit: largest torque of all joints [N m].
        armature: inertia of motor and gear seen at the joint [kg m^2]; not part of the torque, the
            caller adds it to the joint's inertia.
        kp_each: stiffness joint by joint in the order of the robot's joints, in place of ``kp``
            [N m/rad]; empty to leave it.
        kd_each: damping, likewise [N m s/rad].
        torque_limit_each: largest torque, likewise [N m].
        armature_each: inertia of motor and gear, likewise [kg m^2].
        speed_limit: largest change of the command [rad/s], one number for all joints or one a
            joint; empty for none.
        links: not used; servos act on joints.

    Assumptions:
        The current loop is far faster than the joint; motor and link are one, see
        ``joint_backlash``; the servo's own profile limits its speed.

    Valid range:
        Hobby and industrial servos. Steps take the law implicitly: they stay stable with any gains
        and follow it to second order; gains far beyond what a step resolves are refused.

    Limitations:
        No integral part; the torque does not fall with speed.

    References:
        Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics: Modelling, Planning and Control,
        ch. 8; Tan, Liu, Turk 2011, IEEE Computer Graphics and Applications 31(4) (stable
        proportional-derivative controllers).

    Example:
        >>> Servos(kp=9.0, kd=0.2).kp
        9.0
        >>> Servos(kp_each=[9.0, 0.5]).of_joints("kp", 2)
        array([9. , 0.5])
    """

    kp: float = param(
        10.0, "N m/rad", bounds=(0.0, 1e6), tolerance=0.1, relative=True, source="chosen"
    )
    kd: float = param(
        0.2, "N m s/rad", bounds=(0.0, 1e5), tolerance=0.1, relative=True, source="chosen"
    )
    torque_limit: float = param(
        2.5, "N m", bounds=(1e-6, 1e6), tolerance=0.0, source="chosen", fit=False
    )
    armature: float = param(
        0.0,
        "kg m^2",
        bounds=(0.0, 1e3),
        tolerance=0.0,
        source="zero unless stated for the vehicle",
        fit=False,
    )
    kp_each: list[float] = field(default_factory=list)
    kd_each: list[float] = field(default_factory=list)
    torque_limit_each: list[float] = field(default_factory=list)
    armature_each: list[float] = field(default_factory=list)
    speed_limit: list[float] = field(default_factory=list)
    accounts_for: ClassVar[tuple[str, ...]] = ("joint drive",)

    def __post_init__(self) -> None:
        """Check the values of all lists; their lengths are checked once the joints are known."""
        for key, sign in (*_EACH.values(), ("speed_limit", "positive")):
            values = getattr(self, key)
            if values:
                numbers(f"servos.{key}", values, len(values), sign=sign, what="joint")

    def of_joints(self, gain: str, joints: int) -> Floats:
        """Return one gain at every joint, shape (joints,).

        Args:
            gain: ``kp``, ``kd``, ``torque_limit`` or ``armature``.
            joints: number of joints.

        Raises:
            ConfigError: its list has another number of entries.
        """
        key, sign = _EACH[gain]
        values = getattr(self, key) or [getattr(self, gain)]
        return numbers(f"servos.{key}", values, joints, sign=sign, what="joint")

    def speeds(self, joints: int) -> Floats:
        """Return the largest speed of the command at every joint [rad/s], shape (joints,).

        Raises:
            ConfigError: the list has another number of entries.
        """
        values = self.speed_limit or [np.finfo(float).max]
        return numbers("servos.speed_limit", values, joints, sign="positive", what="joint")

    def constants(self) -> dict[str, Floats]:
        """Return the gains that are given joint by joint."""
        lists = {name: getattr(self, key) for name, (key, _) in _EACH.items()}
        return {f"{name}_each": np.array([v]) for name, v in lists.items() if v}

    @staticmethod
    def joint_drive(joints: Joints, inputs: Inputs, params: Parameters) -> JointDrive:
        """Unlimited torque of the servos [N m], its gains and the limit."""
        kp, kd, limit = (
            params.get(f"{name}_each", params[name]) for name in ("kp", "kd", "torque_limit")
        )
        if inputs.joint_command is None:
            none = joints.velocity * 0.0
            return JointDrive(none, none, none, limit + none)
        lag = -joints.velocity if inputs.joint_rate is None else inputs.joint_rate - joints.velocity
        force = kp * (inputs.joint_command - joints.position) + kd * lag
        return JointDrive(force, kp, kd, limit)

    @staticmethod
    def joint_loads(
        joints: Joints, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Torque of the servos [N m]."""
        return limited(Servos.joint_drive(joints, inputs, params)), memory
