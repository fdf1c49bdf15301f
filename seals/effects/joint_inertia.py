"""Inertia at the joints: armature of the drives, and inertia of the robot."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import BoundEffect, EffectSet
from seals.motion import Inputs, Joints
from seals.multibody.equations import Assembly
from seals.multibody.kinematics import Kinematics
from seals.multibody.tree import forward
from seals.robot.model import RobotModel


def armature_of(effects: EffectSet, robot: RobotModel) -> Floats | None:
    """Return the armature of the joint drives, shape (J,); None where nothing states one.

    That of the robot's tree rules over what the effects state.

    Raises:
        ConfigError: a list of a servo has not one entry a joint.
    """
    joints = robot.tree.joints
    if robot.tree.drive_inertia:
        return np.asarray(robot.tree.drive_inertia, dtype=float)
    total = np.zeros(joints)
    for b in effects.joint_drives:
        if joints and hasattr(b.effect, "of_joints"):
            for gain in ("kp", "kd", "torque_limit"):
                b.effect.of_joints(gain, joints)
            total = total + b.effect.of_joints("armature", joints)
    return total if total.any() else None


def felt_inertia(robot: RobotModel) -> Floats:
    """Return the effective inertia of every joint at zero, all others and the base free, (J,).

    It is zero for a joint that moves no mass, whatever else moves: such a joint has the inertia of
    its drive alone.
    """
    tree = robot.tree
    at = np.zeros((1, tree.joints))
    poses = forward(tree, np.zeros((1, 3)), np.eye(3)[None], at)
    assembly = Assembly(robot.spatial_inertia[None])
    nothing = np.zeros((1, tree.links, 6))
    matrix, _ = assembly.system(Kinematics(tree, *poses), assembly.inertia, nothing, at)
    moved = np.diag(matrix[0]) > 0.0  # the row of a joint that moves no mass is zero
    felt = np.zeros(moved.size)
    felt[moved] = 1.0 / np.diag(np.linalg.inv(matrix[0][np.ix_(moved, moved)]))
    return felt[-tree.joints :]


def fastest_drive(effects: EffectSet, robot: RobotModel) -> float:
    """Return the largest eigenvalue magnitude of the joints under servos and friction [1/s].

    Equation:
        The largest root of I s^2 + kd s + kp in size, with I the inertia that a joint feels and kp,
        kd those of a servo, or kp = 0 and kd a resistance of the joint at rest; else zero.
    """
    joints = robot.tree.joints
    if not joints or not (effects.joint_drives or effects.joint_resistances):
        return 0.0
    zero = np.zeros((1, joints))
    still, inputs = Joints(zero, zero), Inputs(0.0, zero, joint_command=zero)
    stated = armature_of(effects, robot)
    inertia = felt_inertia(robot) + (0.0 if stated is None else stated)
    fastest = 0.0
    drives = [b.hooks.joint_drive(still, inputs, _plain(b)) for b in effects.joint_drives]
    steep = [(drive.stiffness, drive.damping) for drive in drives]
    for b in effects.joint_resistances:
        steep.append((zero, b.hooks.joint_resistance(still, inputs, _plain(b))))
    for stiffness, damping in steep:
        half = 0.5 * damping / inertia
        root = np.sqrt((half * half - stiffness / inertia).astype(complex))
        fastest = max(fastest, float(np.max(np.abs(half + root))))
    return fastest


def _plain(b: BoundEffect) -> dict[str, Floats]:
    """Parameters of an effect as arrays of NumPy."""
    return {n: np.asarray(x if type(x) is np.ndarray else x.tolist()) for n, x in b.params.items()}
