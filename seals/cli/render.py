"""``seals render``: renders the frames of a run and a film of them."""

from __future__ import annotations

from seals.cli.hydra_app import Application, launch


def render(arguments: list[str]) -> int:
    """Render the frames of a run by ``seals.view.films.application``."""
    # the renderer is an option of the group of viewers
    words = [f"viewer@{word}" if word.startswith("renderer=") else word for word in arguments]
    # frames and film lie in the folder of the run that they show
    task = Application("seals.view.films.application", tidy=True)
    return launch("render", words, task)
