"""``seals render``: renders the frames of a run and a film of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.cli.hydra_app import discard, launch


def render(arguments: list[str]) -> int:
    """Render the frames of a run by ``seals.view.films.application``."""
    # the renderer is an option of the group of viewers
    words = [f"viewer@{word}" if word.startswith("renderer=") else word for word in arguments]
    return launch("render", words, _task)


def _task(config: Any) -> int | None:
    from hydra.core.hydra_config import HydraConfig

    from seals.view.films.application import execute

    try:
        return execute(config)
    finally:
        # frames and film lie in the folder of the run that they show
        discard(Path(HydraConfig.get().runtime.output_dir))
