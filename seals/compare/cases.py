"""Division of logs into cases, with start states estimated from the data and their uncertainty."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.compare.case import Case, Start, regimes_of_drop, regimes_of_height
from seals.compare.events import find_drop
from seals.compare.noise import noise_of
from seals.compare.predict import PREDICTABLE
from seals.compare.settings import CompareSettings, StartMode
from seals.environment.sampler import hulls_of
from seals.errors import ConfigError, LogError, suggestion
from seals.frames import matrix_of, quaternion_of_rpy
from seals.hydrostatics import Hull
from seals.logs import Log
from seals.robot.model import RobotModel
from seals.run.settings import InitialSettings

WIDE = {"position": 1.0, "attitude": 0.2, "velocity": 2.0, "spin": 2.0, "joints": 0.2, "rates": 2.0}
"""Prior of a measured start: wide, so that the data decide [m, rad, m/s, rad/s]."""


def _start_of_pose(log: Log, initial: InitialSettings, joints: int) -> Start:
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


def _lowest(robot: RobotModel, link: int, hull: Hull) -> float:
    """Height [m] of a link's lowest hull point above the base origin, joints at zero.

    Found by bisection on the wetted volume.
    """
    from seals.multibody.tree import poses_in_base

    origins, rotations = poses_in_base(robot.tree)
    up = rotations[link, 2]
    low, high = -hull.reach * 1.001, hull.reach * 1.001
    for _ in range(60):
        middle = 0.5 * (low + high)
        if hull.wetted(up, middle).volume > 0.0:
            high = middle
        else:
            low = middle
    return float(origins[link, 2] + low)


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


def make_cases(logs: Sequence[Log], settings: CompareSettings, robot: RobotModel) -> list[Case]:
    """Return one case per segment of the logs that ``train`` and ``held_out`` name.

    Raises:
        LogError: nothing in the logs can be predicted.
        ConfigError: a name matches no segment.
    """
    segments = [(s, name) for log in logs for s, name in _named(log)]
    names = [name for _, name in segments]
    train, held_out = (
        matching(k, getattr(settings, k), names, what="log or segment")
        for k in ("train", "held_out")
    )
    chosen = [
        p for p in segments if p[1] in held_out or (p[1] in train if settings.train else True)
    ]
    return [_case(log, name, settings, robot, held_out=name in held_out) for log, name in chosen]


def matching(key: str, patterns: Sequence[object], names: Sequence[str], *, what: str) -> set[str]:
    """Return the names that shell patterns mean.

    Args:
        key: under which the patterns were given.
        patterns: of names.
        names: that there are.
        what: has these names, for the message.

    Raises:
        ConfigError: a pattern means none of them.
    """
    found: set[str] = set()
    for pattern in map(str, patterns):
        hits = fnmatch.filter(names, pattern)
        if not hits:
            raise ConfigError(
                f"{key}: no {what} is called '{pattern}'.\n"
                f"{suggestion(pattern, names, label='Present')}"
            )
        found.update(hits)
    return found


def _named(log: Log) -> list[tuple[Log, str]]:
    segments = log.segments()
    if len(segments) == 1:
        return [(segments[0], log.name)]
    return [(s, f"{log.name}/{int(s.segment[0])}") for s in segments]


def _case(
    log: Log, name: str, settings: CompareSettings, robot: RobotModel, *, held_out: bool
) -> Case:
    channels = [c for c in log.channels() if c in PREDICTABLE and np.isfinite(log.channel(c)).any()]
    if robot.tree.joints == 0:
        channels = [c for c in channels if not c.startswith("joint_")]
    if settings.environment.water_level is None:
        channels = [c for c in channels if c != "depth"]
    if not channels:
        raise LogError(
            f"log '{name}' has no channel that the model predicts: {', '.join(log.channels())}.\n"
            f"Channels that can be compared: {', '.join(PREDICTABLE)}"
        )
    mode = settings.compare.start
    pose = any(
        c in channels for c in ("position", "depth", "joint_position", "orientation", "velocity")
    )
    if mode is StartMode.drop or (mode is StartMode.auto and not pose):
        return _drop_case(log, name, channels, settings, robot, held_out=held_out)
    return _pose_case(log, name, channels, settings, robot, held_out=held_out)


def _pose_case(
    log: Log,
    name: str,
    channels: list[str],
    settings: CompareSettings,
    robot: RobotModel,
    *,
    held_out: bool,
) -> Case:
    """A whole segment, started from its first samples."""
    stride = max(1, settings.compare.stride)
    sigma = {c: _sigma(log, c) for c in channels}
    # first row in which every pose channel has a sample
    good = np.ones(log.rows, dtype=bool)
    for channel in channels:
        if channel in ("position", "orientation", "joint_position"):
            good &= np.isfinite(log.channel(channel)).any(axis=1)
    first = int(np.argmax(good)) if good.any() else 0
    log = log.select(slice(first, None))
    start = _start_of_pose(log, settings.initial, robot.tree.joints)
    short = log.select(slice(0, None, stride))
    height = short.channel("position")[:, 2] if short.has("position") else np.zeros(short.rows)
    filled = (
        np.interp(short.time, short.time[np.isfinite(height)], height[np.isfinite(height)])
        if np.isfinite(height).any()
        else height * 0.0
    )
    reach = max((h.reach for h in robot.hulls if h is not None), default=0.0)
    regime = regimes_of_height(
        filled,
        np.gradient(filled, short.time) if short.rows > 1 else filled,
        water=settings.environment.water_level,
        reach=reach,
    )
    return Case(
        name=name,
        held_out=held_out,
        time=short.time - short.time[0],
        clock=float(short.time[0]),
        measured={c: short.channel(c) for c in channels},
        sigma=sigma,
        regime=regime,
        start=start,
    )


def _drop_case(
    log: Log,
    name: str,
    channels: list[str],
    settings: CompareSettings,
    robot: RobotModel,
    *,
    held_out: bool,
) -> Case:
    """The water entry of a drop seen by an accelerometer."""
    options, gravity = settings.compare, settings.environment.gravity
    level = settings.environment.water_level
    if level is None:
        raise ConfigError(
            "a drop into water needs a surface: environment.water_level is null.\nUse water=fossen."
        )
    force = log.channel("specific_force")
    events = find_drop(log.time, force, gravity=gravity)
    begin = events.entry - options.before
    end = min(
        events.entry + options.after, events.catch - options.margin if events.caught else np.inf
    )
    hulls = hulls_of(robot)
    before = options.before
    falling_speed = gravity * (events.fall - before)
    lowest = min(
        _lowest(robot, k, hull) for k, hull in enumerate(hulls) if robot.hulls[k] is not None
    )
    height = level - lowest + falling_speed * before + 0.5 * gravity * before**2
    joints = robot.tree.joints
    place, falling = [0.0, 0.0, height], [0.0, 0.0, -falling_speed]
    # held: a model that lacks a force would buy its fit by moving the contact
    start = Start(
        state=TwinState.at_rest(1, joints, np.zeros(1), position=place, velocity=falling),
        sigma=np.zeros(12 + 2 * joints),
        source=(
            f"release from rest {events.fall:.3f} s before the entry: "
            f"{falling_speed:.2f} +- {gravity * events.spread:.3f} m/s at first contact, "
            f"which is known to {1e3 * events.spread:.2f} ms"
        ),
    )
    step = float(np.median(np.diff(log.time)))
    rows = np.flatnonzero((log.time >= begin) & (log.time <= end))[:: max(1, options.stride)]
    fall = (log.time > events.release + 0.3 * events.fall) & (log.time < events.entry - 2 * step)
    sigma = {c: noise_of(log.channel(c)[fall], stated=_stated(log, c)) for c in channels}
    short = log.select(rows)
    measured = {c: short.channel(c).copy() for c in channels}
    # the offset seen in free fall is the sensor's own; across the fall axis nothing is predicted
    measured["specific_force"][:, 2] -= events.offset
    measured["specific_force"][:, :2] = np.nan
    speed = gravity * events.fall
    length = 2.0 * max(h.reach for h in hulls_of(robot))
    return Case(
        name=name,
        held_out=held_out,
        time=short.time - begin,
        clock=begin,
        measured=measured,
        sigma=sigma,
        regime=regimes_of_drop(short.time, events, entering=length / max(speed, 0.1)),
        start=start,
        speed=speed,
        notes=[
            f"release {events.release:.3f} s, entry {events.entry:.3f} s, "
            + (f"catch {events.catch:.3f} s" if events.caught else "no catch"),
            f"specific force in free fall {events.offset:+.3f} m/s^2",
            start.source,
        ],
    )


def _sigma(log: Log, channel: str) -> Floats:
    """Noise of a channel; components that the log lacks get 1, they have no samples."""
    values = log.channel(channel)
    if channel == "orientation":
        # the scatter of the residual is that of a rotation vector
        sign = np.sign(values[:, :1] + 1e-300)
        values = np.asarray(2.0 * (values * sign)[:, 1:])
    sigma = noise_of(values, stated=_stated(log, channel))
    sigma = sigma[:3] if channel == "orientation" else sigma
    return np.where(np.isfinite(sigma), sigma, 1.0)


def _stated(log: Log, channel: str) -> float | None:
    """Noise stated by the log's own description."""
    facts = log.meta.get("sensors", {}).get("channels", {}).get(channel, {})
    value = facts.get("sigma") if isinstance(facts, dict) else None
    return float(value) if isinstance(value, int | float) and value > 0 else None
