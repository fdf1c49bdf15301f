"""Replay of a run folder: poses of all links over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.frames import matrix_of
from seals.logs import Log
from seals.logs.native import read_native
from seals.logs.run_folder import log_folder, run_of
from seals.multibody.tree import forward
from seals.rendering.scene import Poses
from seals.robot.model import RobotModel
from seals.run.build import build_run
from seals.run.fleet import fleet_of
from seals.run.object_recorder import POSE, TURN
from seals.run.replay_config import recalled
from seals.view.stage import Stage, build_stage


class Track(NamedTuple):
    """Poses of one robot or object, row by row.

    Args:
        position: of its base, world [m], shape (T, 3).
        quaternion: q_WB_xyzw, neighbours on the same side, shape (T, 4).
        joints: [rad or m], shape (T, J).
    """

    position: Floats
    quaternion: Floats
    joints: Floats

    @classmethod
    def of(cls, log: Log, robot: RobotModel, lead: str) -> Track:
        """Return the poses that a log holds of the actor whose columns begin with ``lead``."""
        place = _columns(log, (f"{lead}{name}" for name in POSE))
        turn = _columns(log, (f"{lead}{name}" for name in TURN))[:, [1, 2, 3, 0]]
        names = (f"{lead}joint_position_{k + 1}" for k in range(robot.tree.joints))
        return cls(place, continuous(turn), _columns(log, names))


class Replay:
    """Replay of a run: its visual scene, and the poses of all links at any time.

    Args:
        folder: of the run; it may hold its surfaces and pictures.
        stage: robots and ground.
        time: of the rows [s], shape (T,).
        tracks: by actor, in the order of the stage.
    """

    def __init__(
        self, folder: Path, stage: Stage, time: Floats, tracks: Mapping[str, Track]
    ) -> None:
        self.folder, self.stage, self.time, self.tracks = folder, stage, time, dict(tracks)

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return float(self.time[-1])

    def poses(self, times: Floats | Sequence[float]) -> Poses:
        """Return the poses of all frames of the scene, interpolated between the rows.

        Args:
            times: [s], shape (N,); beyond the log its ends hold.

        Returns:
            Positions (N, F, 3) [m] and rotations (N, F, 3, 3), frames as in ``stage.scene``.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        found = []
        for name, robot in self.stage.robots.items():
            track = self.tracks[name]
            place, turn, joints = (
                np.stack([np.interp(wanted, self.time, values) for values in part.T], axis=1)
                if part.size
                else np.zeros((len(wanted), 0))
                for part in track
            )
            turn = turn / np.linalg.norm(turn, axis=1, keepdims=True)
            found.append(forward(robot.tree, place, matrix_of(turn), joints))
        origins, rotations = zip(*found, strict=True)
        return Poses(np.concatenate(origins, axis=1), np.concatenate(rotations, axis=1))


def open_replay(folder: str | Path, *, key: str = "replay") -> Replay:
    """Open a run folder for replay.

    Args:
        folder: of the run; it holds ``.hydra/config.yaml``, ``log.parquet`` and ``meta.yaml``. Or
            the log folder of one of its robots: all are shown.
        key: that named it, for messages.

    Raises:
        ConfigError: it is not a run, or has no log yet.
        RobotError: the robot's files have changed since.
    """
    place = run_of(Path(folder))
    settings = build_run(recalled(place, key=key))
    places = {name: log_folder(place, name) for name in fleet_of(settings)}
    if not all((at / "log.parquet").is_file() for at in places.values()):
        raise ConfigError(
            f"{key}={place}: this run has no log.parquet.\n"
            "It is still running, or was interrupted: wait, or resume it: seals run "
            f"resume={place}"
        )
    stage, logs = build_stage(settings), {name: read_native(at) for name, at in places.items()}
    time = np.asarray(next(iter(logs.values())).time, dtype=float)
    return Replay(place, stage, time, tracks_of(logs, stage))


def tracks_of(logs: Mapping[str, Log], stage: Stage) -> dict[str, Track]:
    """Return the motion of robots and objects by name.

    Args:
        logs: of the robots by name; that of the first one tells of the objects.
        stage: of their run.

    Raises:
        ConfigError: a log has no column of an actor.
    """
    first = next(iter(logs.values()))
    return {
        name: Track.of(logs.get(name, first), robot, "" if name in logs else f"object_{name}_")
        for name, robot in stage.robots.items()
    }


def _columns(log: Log, names: Iterator[str]) -> Floats:
    """Concatenate columns; rows without a reading are interpolated."""
    wanted = list(names)
    missing = [name for name in wanted if name not in log.columns]
    if missing:
        raise ConfigError(
            f"the log of '{log.name}' has no column '{missing[0]}'.\nGive the folder of a run."
        )
    time = np.asarray(log.time, dtype=float)
    filled = np.zeros((len(time), len(wanted)))
    for k, name in enumerate(wanted):
        values = np.asarray(log.columns[name], dtype=float)
        known = np.isfinite(values)
        if known.any():
            filled[:, k] = np.interp(time, time[known], values[known])
    return filled


def continuous(quaternion: Floats) -> Floats:
    """Return unit quaternions without sign flips along the rows, shape (T, 4)."""
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    unit = np.where(length > 0.0, quaternion / np.maximum(length, 1e-12), [0.0, 0.0, 0.0, 1.0])
    flips = np.sum(unit[1:] * unit[:-1], axis=1) < 0.0
    side = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    found: Floats = unit * side[:, None]
    return found
