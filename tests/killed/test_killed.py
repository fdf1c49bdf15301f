"""Every long command, killed five times or more at random moments, comes out as if it had not been.

    make killed

Commands with checkpoints are taken up where they were; the others begin anew, and what the kill
left behind neither stops them nor gets into their result.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from seals.cli.main import main

if TYPE_CHECKING:
    from tests.killed.conftest import Killer

HERE = "hydra.run.dir={}"
FLIGHT_A, FLIGHT_B = "log=hidden_effect/flight_a", "log=hidden_effect/flight_b"
RESUMED: dict[str, Any] = {
    "place": HERE,
    "again": ["run", "resume={}"],
    "kept": "checkpoint",
    "apart": True,
}
RUNS = {
    "run with the engine": [
        *("run", "robot=ball", "water=fossen", "environment.tank_bottom=-0.2", "seed=3"),
        *("effects.buoyancy.volume_change=-0.0004", "initial.position=[0,0,0.3]"),
        *("initial.velocity=[0.3,0,0]", "time.duration=6", "time.step=0.001", "checkpoint=0.2"),
    ],
    "run as a twin": [
        *("run", "robot=crazyflie", "backend=twin", "controller=cascade", "guide=hover"),
        *("initial.position=[0,0,1]", "time.duration=6", "time.step=0.004", "checkpoint=0.2"),
    ],
    "run in particles": [
        *("run", "robot=ball", "water=particles", "fluid.spacing=0.04", "checkpoint=0.3"),
        *("fluid.size=[0.32,0.32,0.24]", "fluid.freeboard=0.3", "environment.tank_bottom=-0.24"),
        *("fluid.physics.deterministic=true", "initial.position=[0,0,0.15]", "time.step=0.004"),
        *("time.duration=0.6", "particles=0.05"),
    ],
    "run with cameras": [
        *("run", "robot=aam", "water=fossen", "environment.tank_bottom=-1.5", "+cameras=aam"),
        *("sensors.front.width=32", "sensors.front.height=24", "initial.position=[0,0,-0.5]"),
        *("sensors.belly.width=24", "sensors.belly.height=24", "time.duration=2", "checkpoint=0.2"),
    ],
}
"""Runs that go on at their last checkpoint, in a folder of their own."""
_COURSE = (
    *("task.duration=0.4", "course.look_every=40", "course.log_every=20", "course.episodes=2"),
    *("course.checkpoint=0.2", "seed=5", "learner.hidden=[8]", "learner.batch=4"),
)
_PLAYED = ("count=2", "course.steps=160")
_SHOWN = "demonstrations=aam/reach"
TRAININGS = {
    "interaction": ["learner=sac", "learner.random_steps=4", *_PLAYED],
    "demonstrations": [
        *("learner=sacfd", _SHOWN, "learner.pretrain=20", "learner.random_steps=4", *_PLAYED)
    ],
    "imitation": ["learner=dagger_few", "learner.led=10", *_PLAYED],
}
"""Kinds of training: the words beside those of the course."""
DIAGNOSIS = ["diagnose", FLIGHT_A, "processes=2", "plan=false"]
OUT = "out={}"
ANEW: dict[str, tuple[list[str], str, dict[str, Any]]] = {
    "compare": (["compare", "experiment=falling_balls", "only=[bowling_ball]"], OUT, {}),
    "diagnose": (DIAGNOSIS, OUT, {"codes": (10,), "kills": 10}),
    "calibrate": (
        [
            *("calibrate", "log=swum", "robot=auv", "plan=false", "report=false", "apply=true"),
            "parameters=[effects.water_drag.coefficient_x]",
        ],
        OUT,
        {},
    ),
    "plan": (["plan", "effects=[payload,thrust_coefficient]", FLIGHT_A], OUT, {}),
    "verify": (["verify", FLIGHT_B, "model=models/found.yaml"], OUT, {}),
    "add": (["add", "diagnosis=answer", "name=found", "replace=true"], "folder={}", {}),
    "record": (["record", "env=reach", "episodes=2", "seed=1"], OUT, {}),
    "evaluate": (["evaluate", "env=reach", "policy=scripted", "episodes=3"], OUT, {}),
    "convert": (["convert", "log=long.csv", "reader=csv", "replace=true"], OUT, {}),
    "render": (
        ["render", "run=flown", "viewer@renderer=raycast", "width=64", "height=48", "film=false"],
        OUT,
        {},
    ),
    "teleop": (["teleop", "robot=auv", "script=keys.yaml", "time.step=0.004"], HERE, {}),
    # what it finds of the water is its business; with one thread it finds the same again
    "validate": (
        ["validate", "water", "hydrostatics", "--threads=1"],
        "--out={}",
        {"loose": (".md",), "codes": (0, 1)},
    ),
}
"""Commands that begin anew, and what they need besides."""


def _answer(folder: Path) -> None:
    assert _seals([*DIAGNOSIS, f"out={folder / 'answer'}"]) == 10


def _model(folder: Path) -> None:
    _answer(folder)
    place = [f"diagnosis={folder / 'answer'}", f"folder={folder / 'models'}"]
    assert _seals(["add", "name=found", *place]) == 0


def _table(folder: Path) -> None:
    time = np.arange(400_000) / 1000.0
    lines = "\n".join(f"{t:.3f},{np.sin(t):.6f}" for t in time)
    (folder / "long.csv").write_text(f"t,depth\n{lines}\n")


def _flown(folder: Path) -> None:
    words = ["run", "robot=ball", "initial.position=[0,0,1]", "time.duration=2"]
    assert _seals([*words, f"hydra.run.dir={folder / 'flown'}"]) == 0


def _swum(folder: Path) -> None:
    words = ["run", "robot=auv", "water=fossen", "environment.tank_bottom=-8", "guide=waypoints"]
    words += ["guide.places=[[0.8,0.3,-2.5]]", "guide.speed=0.8", "initial.position=[0,0,-3]"]
    words += ["time.duration=2", "effects.water_drag.coefficient_x=27"]
    assert _seals([*words, f"hydra.run.dir={folder / 'swum'}"]) == 0


def _keys(folder: Path) -> None:
    script = "- {t: 0.5, hold: w, seconds: 2}\n- {t: 3, hold: q, seconds: 2}\n"
    (folder / "keys.yaml").write_text(script)


NEEDS: dict[str, Callable[[Path], None]] = {
    "add": _answer,
    "calibrate": _swum,
    "verify": _model,
    "convert": _table,
    "render": _flown,
    "teleop": _keys,
}


def _seals(words: list[str]) -> int:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return main(words)


@pytest.mark.killed
@pytest.mark.parametrize("name", RUNS)
def test_a_run_goes_on_after_five_kills(name: str, killer: Killer) -> None:
    """Log, ledger, pictures and particles of a run taken up are those of one never killed."""
    killer.haunt(RUNS[name], **RESUMED)


@pytest.mark.killed
@pytest.mark.parametrize("kind", TRAININGS)
def test_a_training_goes_on_after_ten_kills(kind: str, killer: Killer) -> None:
    """Curves and weights are those of a training in one go, bit for bit."""
    pytest.importorskip("torchrl", reason="the extra learn is not installed")
    job = ["train", "env=reach", *_COURSE, *TRAININGS[kind]]
    killer.haunt(job, kills=10, place=HERE, again=["train", "resume={}"], kept="checkpoint.bin")


@pytest.mark.killed
@pytest.mark.parametrize("name", ANEW)
def test_a_command_begun_anew_after_five_kills(name: str, killer: Killer) -> None:
    """The same words again give the result of a command never killed."""
    words, place, more = ANEW[name]
    if name in NEEDS:
        NEEDS[name](killer.folder)
    killer.haunt(words, place=place, **more)


@pytest.mark.thorough
def test_a_conversion_is_killed_twice(killer: Killer) -> None:
    """The small case of the above: a log folder appears whole or not at all."""
    _table(killer.folder)
    words, place, _ = ANEW["convert"]
    killer.haunt(words, place=place, kills=2)
