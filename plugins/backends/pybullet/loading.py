"""Loading of a robot into PyBullet, without the engine's hidden damping and motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import RobotError
from seals.frames import conjugate
from seals.robot.model import RobotModel

MOST_LINKS = 128
"""Links of which the engine hands out the state (MAX_DEGREE_OF_FREEDOM, Bullet 3.25)."""


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """Identifiers of a robot's parts in PyBullet, and its principal axes.

    Args:
        body: PyBullet's number of the robot.
        index: PyBullet's link number of every link, -1 for the base.
        joints: PyBullet's numbers of the movable joints, in PyBullet's order.
        order: coordinate of each of those joints.
        base_centre: centre of mass of the base in its link frame [m], shape (3,).
        base_turn: q of the base link frame in the principal axes, xyzw, shape (1, 4).
        moments: principal moments of every link [kg m^2], shape (L, 3).
    """

    body: int
    index: list[int]
    joints: list[int]
    order: NDArray[np.int64]
    base_centre: Floats
    base_turn: Floats
    moments: Floats


def load_robot(p: Any, client: int, robot: RobotModel) -> Loaded:
    """Load the URDF of a robot with the inertias of the file and no hidden damping.

    Raises:
        RobotError: PyBullet cannot load the file, or loads other links than the robot has.
    """
    if len(robot.links) > MOST_LINKS:
        raise RobotError(
            f"{robot.urdf} has {len(robot.links)} links, PyBullet supports {MOST_LINKS} at most.\n"
            "Take another engine: backend=mujoco"
        )
    flags = p.URDF_USE_INERTIA_FROM_FILE
    if np.isinf(robot.upper).any():
        # what turns without end may be a wheel: the engine makes a cylinder of 32 faces otherwise
        flags |= p.URDF_USE_IMPLICIT_CYLINDER
    try:
        body = p.loadURDF(
            robot.urdf, useFixedBase=robot.tree.fixed_base, flags=flags, physicsClientId=client
        )
    except p.error as cause:
        raise RobotError(
            f"PyBullet cannot load {robot.urdf}: {cause}.\nRun: seals check robot=..."
        ) from cause
    names = {p.getBodyInfo(body, physicsClientId=client)[0].decode(): -1}
    joint_names = {}
    for i in range(p.getNumJoints(body, physicsClientId=client)):
        info = p.getJointInfo(body, i, physicsClientId=client)
        names[info[12].decode()] = i
        joint_names[info[1].decode()] = i
    if set(names) != set(robot.links):
        raise RobotError(
            f"PyBullet finds the links {sorted(names)} in {robot.urdf}, "
            f"the robot has {sorted(robot.links)}.\n"
            "Give every link a unique name."
        )
    index = [names[link] for link in robot.links]
    numbers = sorted((joint_names[j], k) for k, j in enumerate(robot.joints))
    _strip(p, client, body, index, [n for n, _ in numbers])
    _weigh(p, client, body, index, robot)
    _surface(p, client, body, index, robot)
    for k, link in enumerate(index):
        # the engine gives a link without <inertial> a mass of one kilogram
        if robot.mass[k] == 0.0 and not (link == -1 and robot.tree.fixed_base):
            p.changeDynamics(
                body, link, mass=0.0, localInertiaDiagonal=[0.0, 0.0, 0.0], physicsClientId=client
            )
    info = [p.getDynamicsInfo(body, i, physicsClientId=client) for i in index]
    return Loaded(
        body=int(body),
        index=index,
        joints=[n for n, _ in numbers],
        order=np.array([k for _, k in numbers], dtype=np.int64),
        base_centre=np.array(info[0][3]),
        base_turn=conjugate(np.array(info[0][4])[None]),
        moments=np.array([i[2] for i in info]),
    )


def _weigh(p: Any, client: int, body: int, index: list[int], robot: RobotModel) -> None:
    """Set the model's masses where they differ from the URDF's; scale inertia in proportion."""
    for k, link in enumerate(index):
        info = p.getDynamicsInfo(body, link, physicsClientId=client)
        mass, there = float(robot.mass[k]), float(info[0])
        if mass > 0.0 and there > 0.0 and abs(mass - there) > 1e-9 * there:
            moments = [float(m) * mass / there for m in info[2]]
            p.changeDynamics(
                body, link, mass=mass, localInertiaDiagonal=moments, physicsClientId=client
            )


def _surface(p: Any, client: int, body: int, index: list[int], robot: RobotModel) -> None:
    """Set the contact coefficients that the model states in place of the URDF's."""
    s = robot.surface
    if s is None:
        return
    stated = {
        "lateralFriction": s.friction,
        "rollingFriction": s.rolling,
        "spinningFriction": s.spinning,
        "restitution": s.restitution,
    }
    given = {key: value for key, value in stated.items() if value is not None}
    for link in index:
        p.changeDynamics(body, link, **given, physicsClientId=client)


def _strip(p: Any, client: int, body: int, index: list[int], joints: list[int]) -> None:
    """Remove hidden damping, sleeping and the default joint motors."""
    for link in index:
        p.changeDynamics(
            body,
            link,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            physicsClientId=client,
        )
        # in one call with a largest speed, the engine leaves the damping of the file as it is
        p.changeDynamics(body, link, maxJointVelocity=1e3, physicsClientId=client)
    p.changeDynamics(
        body, -1, activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=client
    )
    for joint in joints:
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
