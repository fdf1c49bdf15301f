"""Photorealistic films: a dive into particle waves, a wave's strike, a grasp, and a pursuit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from seals.cli.main import main as seals
from seals.experiments.command import CommandParser
from seals.experiments.wave_impact import OVERRIDES, PHASES
from seals.logs.native import TABLES


class _Film(NamedTuple):
    """A run and the film of it.

    Args:
        run: words after ``seals run``.
        render: words after ``seals render``.
    """

    run: tuple[str, ...]
    render: tuple[str, ...]


FILMS = {
    "dive": _Film(
        run=(
            "robot=aam",
            "water=window",
            "wave=sea",
            "wave.height=0.2",
            "wave.period=1.6",
            "fluid.spacing=0.04",
            "fluid.size=[2.0,1.6,0.8]",
            "surface=0.04",
            "controller=cascade",
            "guide=hover",
            "guide.position=[0.3,0.0,-0.3]",
            "guide.speed=2.5",
            "initial.position=[-0.5,0.0,0.8]",
            "initial.velocity=[0.9,0.0,-1.0]",
            "initial.rpy=[0.1,0.3,0.2]",
            "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]",
            "time.duration=4.4",
        ),
        render=(
            "ripples=2.5",
            "exposure=1.4",
            "port=0.2",
            "camera=[-0.7,-1.25,0.04]",
            "look_at=[0.25,0.0,0.03]",
        ),
    ),
    "strike": _Film(
        run=(*OVERRIDES, f"fluid.maker.start={PHASES['crest']}", "surface=0.01"),
        render=(
            "ripples=2.5",
            "exposure=1.4",
            "camera=[0.5,-1.7,0.62]",
            "look_at=[0.05,0.0,0.2]",
            "speed=0.25",
        ),
    ),
    "grasp": _Film(
        run=("experiment=grasp_lift",),
        render=(
            "ripples=2.5",
            "exposure=2.0",
            "camera=[1.1,-1.2,-0.45]",
            "look_at=[0.0,0.0,-0.7]",
            # before and after it the picture is empty
            "start=4.5",
            "end=20.0",
        ),
    ),
    "target": _Film(
        run=(
            "robot=aam",
            "water=fossen",
            "wave=sea",
            "wave.height=0.12",
            "wave.period=1.6",
            "controller=cascade",
            "guide=waypoints",
            "guide.places=[[0.4,0.0,-1.1],[0.9,-0.2,-1.3]]",
            "guide.delay=0.1",
            "guide.rest=0.2",
            "guide.speed=0.7",
            "initial.position=[-0.4,0.3,-0.8]",
            "initial.joint_position=[0.9,0.3,0,-0.6,-0.6,-0.6]",
            "environment.tank_bottom=-1.6",
            "+objects.crab={robot: crab, position: [0.95,-0.25,-1.571], rpy: [0.0,0.0,0.9], "
            "guide: {guide: march, speed: 0.05}}",
            "time.duration=4.0",
        ),
        render=(
            "ripples=3",
            "exposure=2.0",
            "camera=[1.75,-0.85,-1.38]",
            "look_at=[0.6,0.0,-1.36]",
        ),
    ),
}
"""The films by name."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate and render films; finished parts are kept.

    Args:
        arguments: of the command line; those of the process when left out.

    Returns:
        0 when done, the exit code of the first command that was refused otherwise.
    """
    parser = CommandParser(prog="python -m seals.experiments.photoreal")
    parser.add_argument("film", nargs="*", help=f"{', '.join(FILMS)}; all when left out")
    parser.add_argument("--out", default="runs/photoreal", help="folder of runs and films")
    parser.add_argument("--renderer", default="mitsuba")
    parser.add_argument(
        "--run", action="append", default=[], metavar="KEY=VALUE", help="override of the run"
    )
    given, words = parser.parse_known_args(arguments)
    names = [name for name in given.film if "=" not in name] or list(FILMS)
    words += [word for word in given.film if "=" in word]
    for name in names:
        if name not in FILMS:
            parser.error(f"there is no film '{name}'. Films: {', '.join(FILMS)}")
        render = [f"renderer={given.renderer}", *words]
        code = _make(name, Path(given.out) / name, render, run=given.run)
        if code:
            return code
    return 0


def _make(name: str, folder: Path, words: Sequence[str], *, run: Sequence[str] = ()) -> int:
    """Simulate the run of a film unless it exists, and render the missing frames.

    Args:
        name: of the film.
        folder: of the run.
        words: further overrides of ``seals render``.
        run: further overrides of ``seals run``.

    Returns:
        The exit code of the last command.
    """
    film = FILMS[name]
    if not (folder / TABLES[0]).is_file():
        code = seals(["run", f"name={name}", *film.run, *run, f"hydra.run.dir={folder}"])
        if code:
            return code
    return seals(["render", f"run={folder}", *film.render, *words])
