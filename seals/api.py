"""Public functions of the package: build, simulate, load logs and robots, list plug-ins.

Users import them from ``seals``; nothing inside of SEALS imports this module.
"""

from __future__ import annotations

import dataclasses
import fnmatch
import numbers
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from seals import registry
from seals.errors import ConfigError, LogError, refuse_unlisted, suggestion

if TYPE_CHECKING:
    from seals.arrays import Array
    from seals.batch import BatchDynamics, TwinState
    from seals.logs.log import Log
    from seals.robot.model import RobotModel
    from seals.world import World

_MOST_ROBOTS = 10_000_000
"""Limit of the robots of a batch: beyond, the mistake is in the number."""


def make(overrides: Sequence[str] = ()) -> World:
    """Build a world from the overrides that ``seals run`` takes.

    The world is reset to the initial state and ready for `World.step`.

    Args:
        overrides: such as ``["robot=ball", "water=fossen", "initial.position=[0, 0, 1]"]``.

    Raises:
        SealsError: an override is not allowed, or the robot or the initial state cannot be used.

    Example:
        >>> world = make(["robot=ball", "initial.position=[0, 0, 1]", "time.step=0.001"])
        >>> world.step()
        >>> world.time
        0.001
        >>> world.close()
    """
    from seals.run import build_world
    from seals.run.build import run_settings

    return build_world(run_settings(overrides))


def make_batch(
    overrides: Sequence[str] = (),
    *,
    batch: int = 1,
    like: Array | None = None,
    values: Mapping[str, Any] | None = None,
) -> tuple[BatchDynamics, TwinState]:
    """Build batch dynamics and their initial state from the overrides that ``seals run`` takes.

    Args:
        overrides: such as ``["robot=ball", "water=fossen"]``.
        batch: number of robots B, at least 1.
        like: array whose library, type and device to use; NumPy float64 when left out.
        values: ``"effect.parameter"`` to a number or an array of shape (B,), in place of the
            configured values.

    Raises:
        SealsError: an override or a value is not allowed, or the run has a simulated fluid.

    Example:
        >>> dynamics, state = make_batch(["robot=ball", "initial.position=[0, 0, 1]"], batch=3)
        >>> state, rates = dynamics.step(state, time=0.0, step=0.004)
        >>> state.position.shape
        (3, 3)
    """
    from seals.run import build_twin
    from seals.run.build import run_settings

    given: Any = batch
    whole = isinstance(given, numbers.Integral) and not isinstance(given, bool)
    if not whole or not 0 < batch <= _MOST_ROBOTS:
        raise ConfigError(
            f"batch={batch!s:.50} is not allowed.\nAllowed: an integer, 1 to {_MOST_ROBOTS:,}"
        )
    return build_twin(run_settings(overrides), batch=int(batch), like=like, values=values)


def simulate(overrides: Sequence[str], out: str | Path) -> Log:
    """Simulate a run, write its folder as ``seals run`` does, and return its log.

    Args:
        overrides: such as ``["experiment=drop_test", "time.duration=0.5"]``.
        out: folder to write; it must be absent or empty.

    Raises:
        ConfigError: an override is not allowed, or the folder is not empty.
        SealsError: the run failed; the steps before the failure have been written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:  # doctest: +ELLIPSIS
        ...     log = simulate(["robot=ball", "time.duration=0.02"], out=f"{folder}/fall")
        run: simulated 0.02 s in ...
        >>> round(float(log.time[-1]), 3)
        0.02
    """
    from seals.config.compose import compose
    from seals.logs.native import read_native
    from seals.run.application import run_into
    from seals.run.build import build_run
    from seals.run.folder import write_config

    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(f"out={folder}: this folder or file already exists.\nGive a new folder.")
    config = compose(overrides)
    settings = build_run(config)
    (folder / ".hydra").mkdir(parents=True, exist_ok=True)
    write_config(folder, config)
    run_into(folder, settings, overrides=list(overrides)).checked()
    return read_native(folder)


def load_logs(source: str | Path, *, reader: str | None = None, **options: Any) -> list[Log]:
    """Read all logs of a file or a folder.

    Args:
        source: path, or the name of a log that comes with SEALS: ``hidden_effect/flight_a``.
        reader: name of the reader plug-in; when left out, the content decides, and a folder is
            read as a log folder.
        options: fields of the reader, such as ``columns`` of ``csv``.

    Raises:
        ConfigError: the source is no path, there is no such file, no such reader, or the reader has
            no such field.
        LogError: the content cannot be used.

    Example:
        >>> len(load_logs("hidden_effect/flight_a"))
        1
    """
    from seals.logs.reader import reader_of
    from seals.logs.shipped import find_log

    if not isinstance(source, str | Path):
        raise ConfigError(
            f"a log is read from a path, not from {source!r:.60}.\n"
            "Give a file or a folder: load_log('flights/log_3.ulg')"
        )
    place = find_log(source, key="source")
    name = reader or reader_of(place)
    cls = registry.get("reader", name).load()
    fields = [field.name for field in dataclasses.fields(cls) if field.init]
    for option in options:
        refuse_unlisted(option, fields, f"'{option}' is not a field of the reader '{name}'")
    logs: list[Log] = cls(**options).read(place)
    return logs


def load_log(
    source: str | Path, *, only: str = "*", reader: str | None = None, **options: Any
) -> Log:
    """Read one log from a file or a folder.

    Args:
        source: path, or the name of a log that comes with SEALS: ``hidden_effect/flight_a``.
        only: name of the log, or a pattern such as ``run_3*``, where the source holds several.
        reader: name of the reader plug-in, see `load_logs`.
        options: fields of the reader.

    Raises:
        ConfigError: there is no such file, no such reader, or the reader has no such field.
        LogError: the content cannot be used, or not exactly one log has the name.

    Example:
        >>> log = load_log("hidden_effect/flight_a")
        >>> log.channel("position").shape[1]
        3
    """
    logs = load_logs(source, reader=reader, **options)
    kept = [log for log in logs if fnmatch.fnmatch(log.name, only)]
    if len(kept) != 1:
        names = suggestion(only, [log.name for log in logs], label="Present")
        raise LogError(f"'{source}' holds {len(kept)} logs named '{only}', not one.\n{names}")
    return kept[0]


def load_robot(source: str | Path) -> RobotModel:
    """Read a robot's model: links, joints, mass properties and hulls.

    Args:
        source: name of an installed robot or animal, or a folder with a ``robot.yaml``.

    Raises:
        UnknownPlugin: no robot of that name is installed, and there is no such folder.
        RobotError: the robot's files cannot be used.

    Example:
        >>> load_robot("ball").links
        ('base',)
    """
    from seals.robot.build import build_robot
    from seals.run.build import run_settings

    return build_robot(run_settings([f"robot={source}"]).robot)


def list_plugins(kind: str) -> dict[str, str]:
    """Return name and summary of the installed plug-ins of one kind.

    Args:
        kind: ``effect``, ``sensor``, ``robot``, ``reader`` ...: a key of `seals.registry.GROUPS`.

    Raises:
        ConfigError: there is no such kind.
        BrokenPlugin: a plug-in's module or folder is missing.

    Example:
        >>> "wind" in list_plugins("effect")
        True
    """
    return {name: plugin.summary for name, plugin in registry.plugins(kind).items()}
