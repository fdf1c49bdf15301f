"""``seals autopilot``: runs that an external autopilot flies, in lockstep."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.config.compose import job_overrides, output_folder
from seals.config.overrides import typed
from seals.errors import ConfigError
from seals.file_names import short_path
from seals.run.application import run_into
from seals.run.build import build_run
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record
from seals.schema import check_fields, check_tree
from seals.teleop.application import keep_session
from seals.teleop.autopilot.ardupilot import PORT, ArduPilot
from seals.teleop.autopilot.link import OUTPUTS, allowed_peer
from seals.teleop.autopilot.settings import OWN, AutopilotSettings, Protocol


def execute(config: Any) -> int | None:
    """Let an autopilot fly runs until it falls silent; one that restarts begins another run.

    Args:
        config: composed by Hydra from the root ``autopilot``.

    Raises:
        SealsError: the run cannot start, no autopilot speaks, or the run failed on the way.
        KeyboardInterrupt: the run was interrupted; what there is has been written.
    """
    from omegaconf import OmegaConf

    first, overrides = output_folder(), job_overrides()
    settings = build_run(config)
    check_fields(AutopilotSettings, {k: config[k] for k in ("timeout", "speed")}, where="")
    check_tree(OmegaConf.to_object(config.hil), where="hil")
    for kind, usual, needed in (
        ("controller", "channels", "recorded"),
        ("guide", "external", "use"),
    ):
        chosen = getattr(settings, kind)
        if not hasattr(chosen, needed):
            raise ConfigError(
                f"{kind}={type(chosen).__name__.lower()} cannot be used with an autopilot.\n"
                f"Leave it out, or give {kind}={usual}"
            )
    if not settings.actuators:
        raise ConfigError(
            "robot: it has no actuators, so there is nothing for an autopilot to command.\n"
            "Give a robot with rotors or thrusters, such as robot=hexacopter or robot=auv"
        )
    link = _open_link(config, settings.time.step)
    try:
        print(f"listening on {link.where}", flush=True)
        link.meet()
        number = 1
        while True:
            folder = first if number == 1 else first.with_name(f"{first.name}_{number}")
            record = _fly(folder, config, settings, link, overrides)
            if not link.restarted:
                break
            link.renew()
            settings, number = build_run(config), number + 1
    finally:
        link.close()
    record.checked()
    return None


def _open_link(config: Any, step: float) -> Any:
    """Return the connection that a configuration asks for, listening.

    Raises:
        ConfigError: the address cannot be had, or that of the autopilot is none.
        MissingExtra: the protocol needs a package that is not installed.
    """
    host, port, allowed = str(config.host), config.port, allowed_peer(config.peer)
    given = (float(config.timeout), float(config.speed), step)
    if config.protocol is Protocol.px4:
        from omegaconf import OmegaConf

        from seals.teleop.autopilot import px4

        hil: Any = OmegaConf.to_object(config.hil)
        chosen = px4.PORT if port is None else int(port)
        return px4.Px4(host, chosen, *given, hil=hil, seed=int(config.seed), allowed=allowed)
    return ArduPilot(host, PORT if port is None else int(port), *given, allowed=allowed)


def _fly(
    folder: Path, config: Any, settings: RunSettings, link: Any, overrides: list[str]
) -> Record:
    """Fly one run, and write its outputs and a configuration that repeats it."""
    controller: Any = settings.controller
    controller.use(link, settings.time.step)
    settings.guide.use(link)
    record = run_into(folder, settings, overrides=overrides)
    notes = [f"{link.frames:,} frames of the autopilot"]
    notes += [link.ended] if link.ended else []
    notes += [f"{link.lost:,} frames were lost"] if link.lost else []
    notes += [f"{link.refusals.count:,} messages were refused"] if link.refusals.count else []
    print("; ".join(notes))
    if not link.frames:
        return record
    path = folder / OUTPUTS
    controller.recorded().write(path)
    changes = {"script": str(path.resolve()), **controller.settled()}
    keep_session(folder, config, record, own=OWN, section="controller", changes=changes)
    if record.ending is Ending.done:
        print(f"to repeat: seals run {typed('repeat', str(short_path(folder)))}")
    return record
