"""Films of the gaits: one run each, with a camera that follows the animal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from seals.cli.main import main as seals
from seals.errors import refuse_unlisted
from seals.experiments.crab_gaits.cases import GAITS
from seals.logs.native import TABLES
from seals.run.build import run_settings

FILMED: Mapping[str, Sequence[str]] = {**GAITS, "learned": ("experiment=crab_learned",)}
"""Overrides of every gait that is filmed."""
REACH = (1.6, -3.2, 2.2)
"""From the animal to the camera, in the lengths below [1]."""
SHOWN = {"crab": 0.08, "sea_spider": 0.11}
"""About half of what the legs span [m]."""


def film(out: Path, names: Sequence[str], words: Sequence[str]) -> int:
    """Run and film gaits; finished films are kept.

    Args:
        out: folder of the runs; films are ``NAME/render/*/film.mp4`` in it.
        names: of the gaits, all when there are none; what has a sign of equality is a word.
        words: further overrides of ``seals render``.

    Returns:
        0 when done, the exit code of the first command that was refused otherwise.

    Raises:
        ConfigError: there is no such gait.
    """
    words = [*words, *(name for name in names if "=" in name)]
    for name in [name for name in names if "=" not in name] or FILMED:
        refuse_unlisted(name, FILMED, f"there is no gait '{name}'")
        folder = out / name
        if not (folder / TABLES[0]).is_file():
            code = seals(["run", *FILMED[name], f"hydra.run.dir={folder}"])
            if code:
                return code
        code = seals(["render", f"run={folder}", *_camera(FILMED[name]), *words])
        if code:
            return code
    return 0


def _camera(words: Sequence[str]) -> list[str]:
    """Words for a camera beside the animal, which goes along with it."""
    settings = run_settings(list(words))
    place = settings.initial.position
    size = SHOWN[settings.robot.name]
    camera = [x + size * reach for x, reach in zip(place, REACH, strict=True)]
    told = [f"{name}=[{','.join(f'{x:.3f}' for x in at)}]"
            for name, at in (("camera", camera), ("look_at", place))]  # fmt: skip
    return [*told, "follow=true"]
