"""``seals teleop``: a session controlled by a person or a script, recorded as a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from seals.config.overrides import typed
from seals.control.key_events import read_track, write_track
from seals.errors import ConfigError, suggestion
from seals.file_names import short_path
from seals.run.application import run_into
from seals.run.assembly import build_model
from seals.run.build import build_run
from seals.run.folder import write_config
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record
from seals.schema import check_value, parameters_of
from seals.teleop.device import Device, Script
from seals.teleop.settings import Export, TeleopSettings

if TYPE_CHECKING:
    from seals.learn.demonstrations.episode import Origin

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
    from hydra.core.hydra_config import HydraConfig

    hydra = HydraConfig.get()
    folder, overrides = Path(hydra.runtime.output_dir), list(hydra.overrides.task)
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
    timed = any(word.lstrip("+").startswith("time.duration=") for word in overrides)
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
    print(f"the same again: seals run {typed('repeat', str(short_path(folder)))}")
    again = typed("script", str(short_path(path)))
    print(f"its keys with another robot or sea: seals teleop {again}")
    if exporting:
        from seals.teleop.demonstration import write_demonstration

        origin = _origin(config, by=str(config.script or config.device.value))
        made = write_demonstration(
            record.log, folder, rate=guide.rate, origin=origin, seed=settings.seed
        )
        print(f"demonstration: {short_path(made)}")
    if record.error is not None and record.ending is not Ending.interrupted:
        raise record.error
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
            f"script {script} holds no events.\n{suggestion(script, beside, label='Files there')}"
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
