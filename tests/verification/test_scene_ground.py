"""Shore, obstacles and friction against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.environment.ground import ground_height, solids_of
from seals.errors import ConfigError
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings

SLOPE = 0.3
TANK = ["environment.water_level=0", "environment.tank_bottom=-1", "environment.ground_level=0.5"]
SHORE = [*TANK, f"environment.shore.slope={SLOPE}", "environment.shore.waterline=2"]


def settings(*overrides: str) -> RunSettings:
    """A cube as robot, without water effects."""
    return run_settings(["robot=cube", *overrides])


def rest(run: RunSettings, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the cube after some time."""
    world = build_world(run)
    for _ in range(round(seconds / 0.004)):
        world.step()
    state = world.actors["robot"].body.read()
    world.close()
    return state.position, state.velocity


@pytest.mark.parametrize("heading", [0.0, 1.2])
@pytest.mark.parametrize("along", [-4.0, -0.5, 1.0, 2.0, 3.0, 8.0])
def test_a_body_comes_to_rest_on_the_stated_height(along: float, heading: float) -> None:
    """Bottom, slope and land carry a cube at the height that the description states."""
    x, y = along * math.cos(heading), along * math.sin(heading)
    run = settings(*SHORE, f"environment.shore.heading={heading}", "environment.friction=3")
    z = ground_height(run.environment, x, y)
    assert z is not None
    flat = z in (-1.0, 0.5)
    run.initial.position = [x, y, z + 0.05]
    run.initial.rpy = [0.0, 0.0 if flat else -SLOPE, heading]
    place, speed = rest(run, 0.6)
    there = ground_height(run.environment, place[0], place[1])
    assert there is not None
    # half an edge along the normal of the ground
    assert place[2] - there == pytest.approx(0.025 / (1.0 if flat else math.cos(SLOPE)), abs=1.5e-3)
    assert np.abs(speed).max() < 5e-3


def test_the_waterline_is_where_the_slope_meets_the_water() -> None:
    """The height of the shore at the stated waterline is the water level."""
    environment = settings(*SHORE).environment
    assert ground_height(environment, 2.0, 7.0) == pytest.approx(0.0)
    assert ground_height(environment, 3.0, 0.0) == pytest.approx(math.tan(SLOPE))


@pytest.mark.parametrize(("friction", "slides"), [(0.25, True), (0.37, False)])
def test_friction_holds_on_the_slope_up_to_its_tangent(friction: float, slides: bool) -> None:
    """A body slides with a = g (sin - mu cos) when mu < tan of the slope, and stays otherwise."""
    run = settings(*SHORE, f"environment.friction={friction}")
    run.initial.position, run.initial.rpy = (
        [3.2, 0.0, 1.2 * math.tan(SLOPE) + 0.0265],
        [0, -SLOPE, 0],
    )
    _, speed = rest(run, 0.5)
    expected = 0.5 * 9.81 * (math.sin(SLOPE) - friction * math.cos(SLOPE)) if slides else 0.0
    assert np.linalg.norm(speed) == pytest.approx(expected, abs=0.02)


def test_an_obstacle_carries_with_its_own_friction() -> None:
    """A tilted box holds a body by its own coefficient, and a smooth one does not."""
    for friction, moves in ((1.0, False), (0.0, True)):
        run = settings(
            "+environment.obstacles.ramp.size=[2,2,0.2]",
            "+environment.obstacles.ramp.rpy=[0,0.2,0]",
            f"+environment.obstacles.ramp.friction={friction}",
        )
        run.initial.position, run.initial.rpy = [0.025 * math.sin(0.2), 0, 0.13], [0, 0.2, 0]
        _, speed = rest(run, 0.3)
        assert bool(np.linalg.norm(speed) > 0.3) is moves


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["environment.shore.slope=0.2"], "needs environment.tank_bottom"),
        ([*SHORE, "environment.ground_level=-3"], "below water_level below ground_level"),
        (["+environment.obstacles.a.size=[1,1]"], "has the size"),
        (["+environment.obstacles.a.sise=[1,1,1]"], "Did you mean 'size'"),
    ],
)
def test_wrong_ground_is_refused(overrides: list[str], words: str) -> None:
    """A shore without its levels, and an obstacle of the wrong size, are refused in words."""
    with pytest.raises(ConfigError, match=words):
        settings(*overrides)


def test_level_ground_is_as_before() -> None:
    """Without a shore, bottom and ground are planes."""
    kinds = [(s.name, s.kind) for s in solids_of(settings(*TANK).environment)]
    assert kinds == [("tank_bottom", "plane"), ("ground_level", "plane")]
