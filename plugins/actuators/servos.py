"""Position servos of the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import Array, namespace
from seals.effects.effect import Effect, Parameters
from seals.motion import Inputs, Joints
from seals.schema import param


@dataclass(kw_only=True)
class Servos(Effect):
    """Position servos with proportional and derivative gain, one on every joint.

    Equation:
        tau = clip(kp (command - q) - kd q', -torque_limit, torque_limit); zero without a command.

    Args:
        kp: stiffness [N m/rad].
        kd: damping [N m s/rad].
        torque_limit: largest torque [N m].
        armature: inertia of motor and gear seen at the joint [kg m^2]; not part of the torque, the
            caller adds it to the joint's inertia.
        links: not used; servos act on joints.
        correction: see `seals.effects.Effect`.

    Assumptions:
        The current loop is far faster than the joint; motor and link are one, see
        ``joint_backlash``.

    Valid range:
        Hobby and industrial servos away from their speed limit.

    Limitations:
        One set of gains for all joints; no integral part, no limit of the speed.

    References:
        Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics: Modelling, Planning and Control,
        ch. 8.

    Example:
        >>> Servos(kp=9.0, kd=0.2).kp
        9.0
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
        source="zero unless the vehicle states it",
        fit=False,
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("joint drive",)

    @staticmethod
    def joint_loads(
        joints: Joints, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Torque of the servos [N m]."""
        if inputs.joint_command is None:
            return joints.velocity * 0.0, memory
        error = inputs.joint_command - joints.position
        torque = params["kp"] * error - params["kd"] * joints.velocity
        limit = params["torque_limit"]
        return limit * namespace(torque).clip(torque / limit, -1.0, 1.0), memory
