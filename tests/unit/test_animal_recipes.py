"""Recipes of animals: each composes, stands on its ground, and runs some steps."""

from __future__ import annotations

import numpy as np
import pytest

from seals.api import make
from seals.run.assembly import build_world
from seals.run.build import run_settings

RECIPES = (
    "crab_walk",
    "crab_seabed",
    "crab_reach",
    "crab_reach_seabed",
    "crab_flees",
    "catch_crab",
    "sea_spider_seabed",
    "sea_spider_reach",
)
TUNED = {
    "crab_walk": "crab_tuned",
    "crab_seabed": "crab_tuned_seabed",
    "sea_spider_seabed": "sea_spider_tuned",
}


@pytest.mark.thorough
@pytest.mark.parametrize("recipe", RECIPES)
def test_a_recipe_begins_on_the_ground(recipe: str) -> None:
    """The animal neither falls by more than 5 mm nor is pushed out of the ground."""
    world = make([f"experiment={recipe}"])
    animal = next(actor for actor in world.actors.values() if actor.robot.legs)
    start = animal.body.read().position[2]
    for _ in range(40):
        world.step()
    end = animal.body.read().position[2]
    world.close()
    assert abs(end - start) < 5e-3


@pytest.mark.parametrize(
    ("recipe", "gait"),
    [
        pytest.param(*case, marks=[] if case[0] == "crab_seabed" else [pytest.mark.thorough])
        for case in TUNED.items()
    ],
)
def test_a_tuned_gait_walks(recipe: str, gait: str) -> None:
    """The values in conf/controller belong to the pattern generator, and it gets going."""
    settings = run_settings([f"experiment={recipe}", f"controller={gait}", "guide.delay=0"])
    assert type(settings.controller).__name__ == "Oscillators"
    world = build_world(settings)
    body = world.actors["robot"].body
    for _ in range(500):
        world.step()
    place, turn = body.read().position, body.poses().rotations[0, 0]
    world.close()
    way = settings.guide.way
    gone = float(place[:2] @ [np.cos(way), np.sin(way)])
    # half of the way that was asked, the start included
    assert gone > 0.5 * settings.guide.speed * 2.0
    assert turn[2, 2] > 0.99
