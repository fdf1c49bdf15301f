"""Conversion of the log of a teleoperated run to a demonstration."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Singles
from seals.learn.demonstrations.folder import write
from seals.logs import Log
from seals.logs.channels import columns_of

FOLDER = "demonstration"
OBSERVED = (
    "position",
    "orientation",
    "velocity",
    "angular_velocity",
    "joint_position",
    "joint_velocity",
    "depth",
)
"""Channels of an observation, where the log has them; the body's are in body axes."""
ACTED = ("aim_velocity", "aim_yaw_rate", "joint_position_cmd", "aim_grip")
"""Channels of an action, where the log has them: the control interface of the guides."""


def sampled(log: Log, *, rate: float) -> dict[str, Floats]:
    """Return observations and actions of a log at the rate of the guide.

    Args:
        log: of a run with a guide.
        rate: decisions a second [Hz].

    Returns:
        Arrays of T rows by name: ``time``, then every channel of `OBSERVED` and `ACTED` that is
        there; T actions, each between one row and the next, need T + 1 rows of observations.

    Raises:
        LogError: the log has no guide's aims, or fewer than two decisions.
    """
    if "aim_velocity" not in log.channels():
        raise LogError(
            f"log '{log.name}' holds no setpoints of a guide.\n"
            "Make one with a guide: seals teleop, or seals run controller=NAME guide=NAME"
        )
    step = float(np.median(np.diff(log.time))) if log.rows > 1 else 1.0
    rows = np.arange(0, log.rows, max(1, round(1.0 / (rate * step))))
    if len(rows) < 2:
        raise LogError(
            f"log '{log.name}' is too short for a demonstration.\nRecord at least one second."
        )
    out = {"time": log.time[rows]}
    for stem in (*OBSERVED, *ACTED):
        if stem in log.channels():
            values = log.channel(stem)[rows]
            out[stem] = values if values.ndim == 2 else values[:, None]
    return out


def write_demonstration(
    log: Log, folder: Path, *, rate: float, origin: Origin, seed: int = 0
) -> Path:
    """Write a log as a folder of demonstrations, of one episode.

    Columns of the observation and the action are named as in the log. They are in SI units: an
    environment scales its actions, a session does not. There is no task, hence no reward.

    Args:
        log: of a run with a guide.
        folder: of the run; the files go into a folder of their own below it.
        rate: decisions a second [Hz].
        origin: where the session comes from; names and rate are filled in.
        seed: of the run.

    Raises:
        MissingExtra: safetensors is not installed.
        LogError: the log holds no demonstration.
    """
    columns = sampled(log, rate=rate)
    observation, seen = _flat(columns, OBSERVED, log)
    action, done = _flat(columns, ACTED, log)
    count = len(columns["time"]) - 1
    last = np.arange(count) == count - 1
    # a session is a whole episode: its last step is the end
    ended = bool(log.meta.get("guide", {}).get("outcome"))
    episode = Episode(
        observation=observation,
        action=action[:-1],
        reward=np.zeros(count, dtype=np.float32),
        terminated=last & ended,
        truncated=last & (not ended),
        success=ended,
        seed=seed,
    )
    named = dataclasses.replace(origin, observation=tuple(seen), action=tuple(done), rate=rate)
    return write(Demonstrations(origin=named, episodes=[episode]), folder / FOLDER)


def _flat(
    columns: dict[str, Floats], stems: tuple[str, ...], log: Log
) -> tuple[Singles, list[str]]:
    """Concatenate channels, and return their column names."""
    found = [stem for stem in stems if stem in columns]
    names = [name for stem in found for name in columns_of(stem, log.columns)]
    values = np.concatenate([columns[stem] for stem in found], axis=1).astype(np.float32)
    # what the log never had, such as the third axis of a flat world, is not a column
    kept = np.flatnonzero(~np.isnan(values).all(axis=0))
    values = values[:, kept]
    # gaps hold the reading before, or the first one at the start
    rows = np.arange(len(values))[:, None]
    there = np.isfinite(values)
    before = np.maximum.accumulate(np.where(there, rows, -1), axis=0)
    from_row = np.where(before < 0, there.argmax(axis=0), before)
    return np.take_along_axis(values, from_row, axis=0), [names[k] for k in kept]
