"""``seals view``: shows a recorded or a live run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.config.build import build
from seals.config.compose import job_overrides, output_folder
from seals.config.overrides import key_of
from seals.errors import ConfigError
from seals.logs.run_folder import run_of
from seals.run.build import build_run
from seals.run.immersed import resting_effects
from seals.run.replay_config import recalled
from seals.view.replay import open_replay
from seals.view.session import Session
from seals.view.settings import OWN
from seals.view.sliders import sliders_of


def execute(config: Any) -> int | None:
    """Show a run until it is interrupted.

    Args:
        config: composed by Hydra from the root ``view``.

    Raises:
        SealsError: there is no such run, it cannot start, or the viewer cannot be opened.
    """
    from omegaconf import OmegaConf

    folder, overrides = output_folder(), job_overrides()
    if not 0 <= config.port < 1 << 16:
        raise ConfigError(
            f"port={config.port} is not allowed.\nAllowed: 1024 to 65535, or 0 for any free port"
        )
    viewer = build(config.show, where="show")
    if not hasattr(viewer, "show"):
        raise ConfigError(
            "viewer@show: the chosen viewer cannot show live runs.\n"
            "Leave it out; the default is viewer@show=browser"
        )
    words, host, port = list(config.sliders), str(config.host), int(config.port)
    if config.run is not None:
        # refuse overrides of a finished run
        others = [w for w in overrides if key_of(w).split(".")[0] not in OWN]
        if others:
            raise ConfigError(
                f"run= shows a finished run; it cannot be combined with {others[0]}.\n"
                "Leave out the other arguments, or start a new run without run=."
            )
        place = run_of(Path(str(config.run)))
        replay = open_replay(place, key="run")
        kept = recalled(place, key="run")
        idle = resting_effects(replay.stage.settings)
        session = Session(kept, sliders_of(kept, words, idle), folder)
        session.open(replay)
        session.note = f"replay of {place.name}"
    elif not overrides:
        raise ConfigError(
            "no run is given.\nWrite: seals view FOLDER, or for a live run: seals view robot=NAME"
        )
    else:
        kept = OmegaConf.masked_copy(config, [key for key in config if key not in OWN])
        idle = resting_effects(build_run(config))
        session = Session(kept, sliders_of(kept, words, idle), folder)
    try:
        if config.run is None:
            # inside: a signal that comes now ends the child, too
            session.start()
        viewer.show(session, host=host, port=port)
    finally:
        session.close()
    return None
