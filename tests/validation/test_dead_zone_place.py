"""Whether a dead zone is told to act on the command or on the force, on logs of an ROV."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from seals.cli.main import main

DIVE = (
    "robot=rov",
    "water=fossen",
    "guide=waypoints",
    "guide.places=[[1.5,0.5,-3.5],[0.3,-1.0,-2.5],[0,0,-3]]",
    "guide.speed=0.7",
    "guide.rest=0.5",
    "guide.repeat=true",
    "initial.position=[0,0,-3]",
    "time.step=0.0025",
    "time.duration=20",
    "controller.rate=100",
    "guide.rate=100",
)


@pytest.mark.slow
@pytest.mark.parametrize(("place", "law"), [("force", "jump"), ("command", "jump of the command")])
def test_the_place_of_a_dead_zone_is_told(place: str, law: str, tmp_path: Path) -> None:
    """Simulated with 2 N in one of the places and hidden, named in that place within 5 %."""
    hidden = [f"effects.dead_zone.place={place}", "effects.dead_zone.force=2.0"]
    log, out = tmp_path / "dive", tmp_path / "answer"
    run = ["run", *DIVE, *hidden, "hide=[dead_zone]", f"hydra.run.dir={log}"]
    assert main(run) == 0
    assert main(["diagnose", f"log={log}", f"out={out}", "report=false", "plan=false"]) == 10
    (found,) = json.loads((out / "diagnosis.json").read_text())["fitted"]
    assert (found["name"], found["law"]) == ("thruster_dead_zone", law)
    assert found["parameters"]["force"]["value"] == pytest.approx(2.0, rel=0.05)
