"""Joint drives of a robot in the world: implicit or explicit, with a check of their gains."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import EffectSet
from seals.effects.evaluation import Evaluation
from seals.effects.joint_inertia import armature_of, felt_inertia
from seals.errors import ConfigError
from seals.motion import Inputs, JointDrive
from seals.robot.model import RobotModel

HEAVIEST = 100.0
"""Largest ratio of a servo's part in the inertia of its joint over a step, h kd + h^2 kp, to the
inertia of the joint itself [1].

A joint held by a contact finds the force of its servo with a time constant of the step times this
ratio, 0.4 s at 4 ms; beyond, an implicit servo is no longer a servo but a brake.
"""


class Servoing:
    """Joint drives of one robot.

    Args:
        effects: of the robot.
        robot: the robot.
        implicit: whether its body takes joint drives implicitly.
    """

    def __init__(self, effects: EffectSet, robot: RobotModel, *, implicit: bool) -> None:
        self.effects, self.armature = effects, armature_of(effects, robot)
        steep = effects.joint_drives or effects.joint_resistances
        self.implicit = implicit and bool(steep and robot.tree.joints)

    def drives(self, inputs: Inputs) -> bool:
        """Return whether drives or resistances act that the body takes implicitly."""
        commanded = inputs.joint_command is not None or self.armature is not None
        return self.implicit and (commanded or bool(self.effects.joint_resistances))

    def push(
        self, found: Evaluation, inputs: Inputs
    ) -> tuple[Floats, JointDrive | None, Floats | None]:
        """Return explicit joint forces, implicit joint drives, and the inertia of the drives."""
        force = found.joint_force(inputs.joint_torque)
        if not self.drives(inputs):
            return force, None, None
        return force, found.joint_drive, self.armature


def check_gains(robot: RobotModel, effects: EffectSet, step: float) -> None:
    """Refuse servos too stiff for the time step.

    Args:
        robot: the robot.
        effects: its effects.
        step: h of the world [s].

    Raises:
        ConfigError: h kd + h^2 kp of a joint is more than `HEAVIEST` times its inertia; the bound
            is printed.
    """
    for b in effects.joint_drives:
        servo: Any = b.effect
        if not robot.tree.joints or not hasattr(servo, "of_joints"):
            continue
        kp, kd, armature = (servo.of_joints(k, robot.tree.joints) for k in ("kp", "kd", "armature"))
        inertia = felt_inertia(robot) + armature
        # a joint that moves no mass, without an armature, has none
        ratio = (step * kd + step * step * kp) / np.maximum(inertia, np.finfo(float).tiny)
        worst = int(np.argmax(ratio))
        if ratio[worst] > HEAVIEST:
            _refuse(b.name, robot, worst, (kp, kd, inertia), step)


def _refuse(
    name: str, robot: RobotModel, joint: int, table: tuple[Floats, Floats, Floats], step: float
) -> None:
    kp, kd, inertia = (float(x[joint]) for x in table)
    if not inertia:
        raise ConfigError(
            f"actuators.{name}: joint '{robot.joints[joint]}' moves no mass, and the drive states "
            "no armature.\nGive the link below it an <inertial> element, or state the armature."
        )
    bound = HEAVIEST * inertia
    longest = (-kd + np.sqrt(kd * kd + 4.0 * kp * bound)) / (2.0 * kp) if kp else bound / kd
    raise ConfigError(
        f"actuators.{name}: kp={kp:.4g}, kd={kd:.4g} at joint '{robot.joints[joint]}', whose "
        f"inertia is {inertia:.3g} kg m^2, are too stiff for time.step={step:g}.\n"
        f"Allowed: step*kd + step^2*kp up to {bound:.3g} kg m^2 ({HEAVIEST:g} times the inertia); "
        f"lower the gains, state the armature, or take time.step={longest:.2g} or less."
    )
