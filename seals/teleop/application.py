"""``seals teleop``: a session controlled by a person or a script, recorded as a run.

Its log becomes a demonstration for learning.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.compose import job_overrides, output_folder
from seals.config.overrides import key_of, typed
from seals.control.key_events import read_track, write_track
from seals.errors import ConfigError, LogError, suggestion
from seals.file_names import short_path
from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Singles
from seals.learn.demonstrations.folder import write
from seals.logs import Log
from seals.logs.channels import columns_of
from seals.run.application import run_into
from seals.run.assembly import build_model
from seals.run.build import build_run
from seals.run.folder import write_config
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record
from seals.schema import check_value, parameters_of
from seals.teleop.device import Device, Script
from seals.teleop.settings import Export, TeleopSettings

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
            f"log '{log.name}' contains no references of a guide.\n"
            "Record one with a guide: seals teleop, or seals run controller=NAME guide=NAME"
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


def _write_demonstration(
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


KEYS = "keys.csv"
"""File of the session's events in the run folder."""
OWN = ("device", "script", "speed", "export")
"""Keys of a session that a run does not have."""
AFTER = 1.0
"""Time that a script's run goes on after its last event [s]."""


def execute(config: Any) -> int | None:
    """Teleoperate a robot manually or by a script, and fill the run folder.

    Args:
        config: composed by Hydra from the root ``teleop``.

    Raises:
        SealsError: the session cannot start, or failed on the way; what there is has been written.
        MissingExtra: a device or an export needs a package that is not installed.
    """
    folder, overrides = output_folder(), job_overrides()
    exporting = Export.safetensors in config.export
    if exporting:
        from seals.learn.tensor_file import library

        library()  # before the session, which nobody flies twice
    check_value("speed", config.speed, parameters_of(TeleopSettings)["speed"])
    settings = build_run(config)
    guide: Any = settings.guide
    if not hasattr(guide, "use"):
        raise ConfigError(
            f"guide={type(guide).__name__.lower()} takes no keys.\nLeave it out, or use guide=stick"
        )
    timed = any(key_of(word) == "time.duration" for word in overrides)
    device = _device(config, settings, timed)
    guide.use(device)
    try:
        record = run_into(folder, settings, overrides=overrides)
    finally:
        device.close()
    path = folder / KEYS
    write_track(path, device.recorded)
    script = {"script": str(path.resolve())}
    keep_session(folder, config, record, own=OWN, section="guide", changes=script)
    print(f"to repeat: seals run {typed('repeat', str(short_path(folder)))}")
    again = typed("script", str(short_path(path)))
    print(f"the same keys with another robot or sea: seals teleop {again}")
    if exporting:
        origin = _origin(config, by=str(config.script or config.device.value))
        made = _write_demonstration(
            record.log, folder, rate=guide.rate, origin=origin, seed=settings.seed
        )
        print(f"demonstration: {short_path(made)}")
    if record.ending is not Ending.interrupted:
        record.checked()
    return None


def _origin(config: Any, *, by: str) -> Origin:
    """Source of a demonstration: a person, or a script of keys."""
    from omegaconf import OmegaConf

    from seals.learn.demonstrations.episode import Origin, Who
    from seals.learn.metadata import config_hash

    kept: Any = OmegaConf.masked_copy(config, [key for key in config if key not in OWN])
    plain: Any = OmegaConf.to_container(kept, enum_to_str=True)
    who = Who.scripted if config.script else Who.human
    return Origin(env="teleop", config_hash=config_hash(plain), who=who, by=by, config=plain)


def _device(config: Any, settings: RunSettings, timed: bool) -> Device:
    """Return the input device, script or person; a script also sets the duration."""
    if config.script == "":
        raise ConfigError(
            "script= has no value.\nGive a file: script=keys.yaml; or leave it out to fly by hand."
        )
    script = str(config.script or getattr(settings.guide, "script", ""))
    if not script:
        from seals.control.plant import build_plant
        from seals.teleop.person import Person

        robot, effects = build_model(settings)
        plant = build_plant(robot, effects, settings.environment)
        return Person(config.device.value, speed=float(config.speed), plant=plant)
    events = read_track(Path(script))
    if not events and not timed:
        beside = [str(p) for p in Path(script).parent.glob(KEYS)]
        raise ConfigError(
            f"script {script} contains no "
            f"events.\n{suggestion(script, beside, label='Files there')}"
        )
    if not timed:
        settings.time.duration = events[-1].time + AFTER
    return Script(events)


def keep_session(
    folder: Path,
    config: Any,
    record: Record,
    *,
    own: Sequence[str],
    section: str,
    changes: Mapping[str, Any],
) -> None:
    """Write the configuration of a session as that of a run, which repeats it.

    Args:
        folder: of the run.
        config: of the session.
        record: of the run, for its duration.
        own: keys that a run does not have.
        section: that changes, such as ``guide``.
        changes: in it, such as the script that it follows.
    """
    from omegaconf import OmegaConf, open_dict

    kept = OmegaConf.masked_copy(config, [key for key in config if key not in own])
    with open_dict(kept):
        kept[section] = OmegaConf.merge(kept[section], changes)
        kept.time.duration = float(record.log.time[-1])
    write_config(folder, kept)
