"""Division of logs into cases with start states."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case
from seals.compare.events import find_drop
from seals.compare.noise import noise_of
from seals.compare.predict import PREDICTABLE
from seals.compare.regimes import regimes_of_drop, regimes_of_height
from seals.compare.settings import CompareSettings, StartMode
from seals.compare.start import start_of_drop, start_of_pose
from seals.environment.sampler import hulls_of
from seals.errors import ConfigError, LogError, suggestion
from seals.logs import Log
from seals.robot.model import RobotModel


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
    start = start_of_pose(log, settings.initial, robot.tree.joints)
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
            "a drop into water needs a surface: environment.water_level is null.\nSay water=fossen."
        )
    force = log.channel("specific_force")
    events = find_drop(log.time, force, gravity=gravity)
    begin = events.entry - options.before
    end = min(
        events.entry + options.after, events.catch - options.margin if events.caught else np.inf
    )
    start = start_of_drop(
        events, robot, hulls_of(robot), water=level, gravity=gravity, before=options.before
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
    sigma = noise_of(_as_vector(log, channel), stated=_stated(log, channel))
    sigma = sigma[:3] if channel == "orientation" else sigma
    return np.where(np.isfinite(sigma), sigma, 1.0)


def _as_vector(log: Log, channel: str) -> Floats:
    """Samples with the scatter of the residual; an attitude as a rotation vector.

    Twice the vector part of an attitude is a rotation.
    """
    values = log.channel(channel)
    if channel != "orientation":
        return values
    sign = np.sign(values[:, :1] + 1e-300)
    return np.asarray(2.0 * (values * sign)[:, 1:])


def _stated(log: Log, channel: str) -> float | None:
    """Noise stated by the log's own description."""
    facts = log.meta.get("sensors", {}).get("channels", {}).get(channel, {})
    value = facts.get("sigma") if isinstance(facts, dict) else None
    return float(value) if isinstance(value, int | float) and value > 0 else None
