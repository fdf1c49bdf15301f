"""Walks to targets in all directions from random headings, within a time limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seals.experiments.crab_gaits.cases import CASES
from seals.experiments.crab_gaits.walks import standing
from seals.experiments.trials import Outcome, run_trials, summary
from seals.run.assembly import ROBOT, build_world
from seals.run.build import run_settings

TASKS = {
    "crab": ("experiment=crab_reach", 0.40, "guide.speed=0.2", 8.0),
    "crab_seabed": ("experiment=crab_reach_seabed", 0.40, "guide.speed=0.1", 14.0),
    "crab_learned": ("experiment=crab_learned", 0.40, "", 8.0),
    "crab_learned_seabed": (
        "experiment=crab_learned water=fossen environment.ground_level=null "
        "environment.tank_bottom=-1.0 initial.position=[0,0,-0.971]",
        0.40,
        "",
        14.0,
    ),
    "sea_spider": ("experiment=sea_spider_reach", 0.45, "guide.speed=0.03", 40.0),
}
"""Recipe, distance of the targets [m], speed where the guide has one, and time allowed [s]."""


def reach(name: str, out: Path, *, seeds: int, more: Sequence[str] = (), case: str = "") -> str:
    """Walk to many targets and return how many were reached.

    Args:
        name: of the task.
        out: folder of the table.
        seeds: number of targets.
        more: overrides, for instance another controller.
        case: circumstances by name, for a task on the ground that the case has.
    """
    recipe, far, speed, most = TASKS[name]
    ground = CASES[case].words[1:] if case else ()
    slope = CASES[case].slope if case else 0.0

    def words(seed: int) -> list[str]:
        rng = np.random.default_rng(10_000 + seed)
        yaw, way = rng.uniform(-math.pi, math.pi, 2)
        place = f"[{far * math.cos(way):.4f},{far * math.sin(way):.4f}]"
        start = [f"initial.rpy={standing(yaw, slope)}", f"guide.place={place}"]
        given = [*recipe.split(), *ground, *speed.split(), *start]
        return [*given, f"time.duration={most}", *more]

    title = f"{name}, {case}" if case else name
    table = out / f"reach_{name}{f'_{case}' if case else ''}.csv"
    rows = run_trials(table, range(seeds), words, _reached)
    times = [float(row["seconds"]) for row in rows if row["success"] == "1"]
    mean = f", in {np.mean(times):.2f} s on average" if times else ""
    return f"{title}: {summary(rows)}{mean}"


def _reached(words: Sequence[str]) -> Outcome:
    """Walk to one target: done when the guide says so before the time is over."""
    settings = run_settings(list(words))
    world = build_world(settings)
    try:
        actor = world.actors[ROBOT]
        assert actor.pilot is not None
        while world.time < settings.time.duration and actor.pilot.finished is not True:
            world.step()
        done = actor.pilot.finished is True
        upright = float(actor.body.poses().rotations[0, 0, 2, 2])
        return Outcome(
            success=done,
            reason="" if done else "late",
            seconds=world.time,
            measures={"upright": upright},
        )
    finally:
        world.close()
