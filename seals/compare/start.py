"""Initial estimate of the start state of a case, with its uncertainty."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.compare.case import Start
from seals.compare.events import DropEvents
from seals.frames import matrix_of, quaternion_of_rpy
from seals.hydrostatics import Hull
from seals.logs import Log
from seals.robot.model import RobotModel
from seals.run.settings import InitialSettings

WIDE = {"position": 1.0, "attitude": 0.2, "velocity": 2.0, "spin": 2.0, "joints": 0.2, "rates": 2.0}
"""Prior of a measured start: wide, so that the data decide [m, rad, m/s, rad/s]."""


def start_of_pose(log: Log, initial: InitialSettings, joints: int) -> Start:
    """Return the start state from the first samples of the pose.

    Components that the log lacks come from the settings and are held.

    Args:
        log: one segment.
        initial: settings for what the log does not know.
        joints: number of joints of the robot.
    """
    sigma = np.zeros(12 + 2 * joints)
    position = _filled(_first(log, "position", 3), initial.position, sigma[0:3], WIDE["position"])
    attitude = _attitude(log)
    if attitude is None:
        quaternion = quaternion_of_rpy(np.array([initial.rpy], dtype=float))[0]
    else:
        quaternion, sigma[3:6] = attitude, WIDE["attitude"]
    turn = matrix_of(quaternion[None])[0]
    world = np.asarray(initial.velocity, dtype=float).copy()
    slope = _slope(log, "position", 3)
    known = np.isfinite(slope)
    world[known] = slope[known]
    velocity = turn.T @ world
    measured = _first(log, "velocity", 3)
    velocity = np.where(np.isfinite(measured), measured, velocity)
    # of a body that is nearly upright
    seen_in_body = np.abs(turn.T) @ known.astype(float) > 0.9
    sigma[6:9] = np.where(seen_in_body | np.isfinite(measured), WIDE["velocity"], 0.0)
    turning = np.isfinite(_first(log, "angular_velocity", 3)).all() or attitude is not None
    spin = _filled(_first(log, "angular_velocity", 3), initial.angular_velocity, np.zeros(3), 0.0)
    sigma[9:12] = WIDE["spin"] if turning else 0.0
    q = _filled(
        _first(log, "joint_position", joints),
        initial.joint_position,
        sigma[12 : 12 + joints],
        WIDE["joints"],
    )
    rate = _slope(log, "joint_position", joints)
    seen = _first(log, "joint_velocity", joints)
    rate = np.where(np.isfinite(seen), seen, rate)
    rates = _filled(rate, initial.joint_velocity, sigma[12 + joints :], WIDE["rates"])
    parts = (position, quaternion, velocity, spin, q, rates)
    state = TwinState(*(x[None] for x in parts))
    return Start(state=state, sigma=sigma, source="first samples of the pose")


def start_of_drop(
    events: DropEvents,
    robot: RobotModel,
    hulls: list[Hull],
    *,
    water: float,
    gravity: float,
    before: float,
) -> Start:
    """Return the start state of a drop from rest, ``before`` seconds before water entry.

    Args:
        events: of the drop.
        robot: what falls, upright.
        hulls: of its links.
        water: surface height [m].
        gravity: [m/s^2].
        before: [s].
    """
    speed = gravity * (events.fall - before)
    lowest = min(
        _lowest(robot, k, hull) for k, hull in enumerate(hulls) if robot.hulls[k] is not None
    )
    height = water - lowest + speed * before + 0.5 * gravity * before**2
    joints = robot.tree.joints
    place, falling = [0.0, 0.0, height], [0.0, 0.0, -speed]
    # held: a model that lacks a force would buy its fit by moving the contact
    return Start(
        state=TwinState.at_rest(1, joints, np.zeros(1), position=place, velocity=falling),
        sigma=np.zeros(12 + 2 * joints),
        source=(
            f"release from rest {events.fall:.3f} s before the entry: "
            f"{speed:.2f} +- {gravity * events.spread:.3f} m/s at first contact, "
            f"which is known to {1e3 * events.spread:.2f} ms"
        ),
    )


def _lowest(robot: RobotModel, link: int, hull: Hull) -> float:
    """Height [m] of a link's lowest hull point above the base origin, joints at zero.

    Found by bisection on the wetted volume.
    """
    from seals.multibody.tree import forward

    origins, rotations = forward(
        robot.tree, np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, robot.tree.joints))
    )
    up = rotations[0, link, 2]
    low, high = -hull.reach * 1.001, hull.reach * 1.001
    for _ in range(60):
        middle = 0.5 * (low + high)
        if hull.wetted(up, middle).volume > 0.0:
            high = middle
        else:
            low = middle
    return float(origins[0, link, 2] + low)


def _first(log: Log, stem: str, width: int) -> Floats:
    """First finite value of each component; NaN where there is none."""
    out = np.full(width, np.nan)
    if log.has(stem):
        values = log.channel(stem)
        for k in range(min(width, values.shape[1])):
            found = values[np.isfinite(values[:, k]), k]
            if found.size:
                out[k] = found[0]
    return out


def _slope(log: Log, stem: str, width: int, samples: int = 7) -> Floats:
    """Rate of each component at the first row, by a parabola through the first samples.

    NaN where there are too few of them.
    """
    out = np.full(width, np.nan)
    if not log.has(stem):
        return out
    values, time = log.channel(stem), log.time - log.time[0]
    for k in range(min(width, values.shape[1])):
        good = np.flatnonzero(np.isfinite(values[:, k]))[:samples]
        if good.size >= 3:
            out[k] = np.polyfit(time[good], values[good, k], 2)[1]
    return out


def _attitude(log: Log) -> Floats | None:
    """First finite attitude, x y z w, of unit length."""
    if not log.has("orientation"):
        return None
    values = log.channel("orientation")
    good = np.flatnonzero(np.isfinite(values).all(axis=1))
    if not good.size:
        return None
    w, x, y, z = values[good[0]]
    out: Floats = np.array([x, y, z, w]) / np.linalg.norm(values[good[0]])
    return out


def _filled(measured: Floats, fallback: list[float], sigma: Floats, wide: float) -> Floats:
    """Measured values where there are any, else the settings'; ``sigma`` is filled in place."""
    known = np.isfinite(measured)
    base = np.zeros(measured.shape)
    base[: len(fallback)] = fallback[: len(base)]
    sigma[known] = wide
    return np.where(known, measured, base)
