"""Turns a log led by a guide into a demonstration for learning: observations, actions, ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, MissingExtra
from seals.logs import Log

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
    """Return observations and actions of a log at the rate at which the guide decided.

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
            f"log '{log.name}' does not say what a guide wanted.\n"
            "Make one with a guide: seals teleop, or seals run controller=NAME guide=NAME"
        )
    step = float(np.median(np.diff(log.time))) if log.rows > 1 else 1.0
    rows = np.arange(0, log.rows, max(1, round(1.0 / (rate * step))))
    if len(rows) < 2:
        raise LogError(f"log '{log.name}' is too short for a demonstration.\nFly for a second.")
    out = {"time": log.time[rows]}
    for stem in (*OBSERVED, *ACTED):
        if stem in log.channels():
            values = log.channel(stem)[rows]
            out[stem] = values if values.ndim == 2 else values[:, None]
    return out


def as_tensordict(log: Log, *, rate: float) -> Any:
    """Return a log as a TensorDict in the layout that torchrl's losses and buffers take.

    Keys: ``time``, ``observation`` and ``action`` with one entry a channel, ``done``,
    ``terminated``, and ``next`` with observation, done and terminated. Values are float32.

    Args:
        log: of a run with a guide.
        rate: decisions a second [Hz].

    Raises:
        MissingExtra: tensordict is not installed.
        LogError: the log holds no demonstration.
    """
    tensordict = tensordict_of()
    import torch

    columns = sampled(log, rate=rate)
    count = len(columns["time"]) - 1
    now, following = slice(0, count), slice(1, count + 1)

    def nested(stems: tuple[str, ...], rows: slice) -> Any:
        found = {s: np.ascontiguousarray(columns[s][rows]) for s in stems if s in columns}
        tensors = {s: torch.from_numpy(x.astype(np.float32)) for s, x in found.items()}
        return tensordict.TensorDict(tensors, batch_size=[count])

    done = torch.zeros((count, 1), dtype=torch.bool)
    ended = done.clone()
    # a demonstration is a whole episode: its last step is the end
    done[-1], ended[-1] = True, bool(log.meta.get("guide", {}).get("outcome"))
    start = torch.zeros_like(done)
    return tensordict.TensorDict(
        {
            "time": torch.from_numpy(np.array(columns["time"][now])),
            "observation": nested(OBSERVED, now),
            "action": nested(ACTED, now),
            "done": start,
            "terminated": start.clone(),
            "next": tensordict.TensorDict(
                {
                    "observation": nested(OBSERVED, following),
                    "done": done,
                    "terminated": ended,
                },
                batch_size=[count],
            ),
        },
        batch_size=[count],
    )


def write_demonstration(log: Log, folder: Path, *, rate: float) -> Path:
    """Write a log as a TensorDict in memory-mapped files: ``TensorDict.load_memmap(PATH)``.

    Args:
        log: of a run with a guide.
        folder: of the run; the files go into a folder of their own below it.
        rate: decisions a second [Hz].

    Raises:
        MissingExtra: tensordict is not installed.
        LogError: the log holds no demonstration.
    """
    path = folder / FOLDER
    as_tensordict(log, rate=rate).memmap(path)
    return path


def tensordict_of() -> Any:
    """Return the module ``tensordict``.

    Raises:
        MissingExtra: it is not installed.
    """
    try:
        import tensordict
    except ImportError as cause:
        raise MissingExtra(
            "export=[tensordict] needs tensordict, which is not installed.\n"
            "Install it: pip install 'aam-seals[learn]'; the log itself is written in any case."
        ) from cause
    return tensordict
