"""Spheres about robots: contacts are found where there are any, and none are searched elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.plugins.backends.mujoco.clearance import Clearance
from seals.run import build_world
from seals.run.build import run_settings

ON_LAND = ("backend=mujoco", "backend.compiled=false", "environment.ground_level=0")


def scene(*words: str) -> Any:
    """Return a world of MuJoCo."""
    return build_world(run_settings([*ON_LAND, *words]))


def two(height: float, apart: float = 0.0) -> tuple[str, str]:
    """Words of two cubes of 5 cm, one above the other or beside it."""
    one = "{{robot: cube, initial: {{position: [{}, 0, {}]}}}}"
    low, high = one.format(0.0, 0.0252), one.format(apart, height)
    return f"robots.low={low}", f"robots.high={high}"


def track(world: Any, steps: int) -> Any:
    """Return the places of all robots after each step, and whether anything touched."""
    found, touched = [], []
    for _ in range(steps):
        world.step()
        touched.append(world.backend._scene.data.ncon)
        states = [a.body.read() for a in world.actors.values()]
        found.append(np.concatenate([np.concatenate(s[:4], axis=None) for s in states]))
    world.close()
    return np.array(found), np.array(touched)


@pytest.mark.parametrize(("height", "apart"), [(0.4, 0.01), (0.3, 2.0)])
def test_motion_is_the_same_bit_for_bit(
    monkeypatch: pytest.MonkeyPatch, height: float, apart: float
) -> None:
    """A cube that falls on another, or beside it on the ground, with and without the spheres."""
    with_spheres, touched = track(scene(*two(height, apart)), 120)
    monkeypatch.setattr(Clearance, "slack", lambda self, place: -1.0)
    searched, also = track(scene(*two(height, apart)), 120)
    np.testing.assert_array_equal(with_spheres, searched)
    np.testing.assert_array_equal(touched, also)
    assert touched.any()


def test_a_sphere_holds_the_whole_robot() -> None:
    """Half the diagonal of a cube of 5 cm; a stretched arm of the manipulator lies within."""
    own = "robots.{}={{robot: {}, initial: {{position: [{}, 0, 5]}}}}"
    world = scene(own.format("a", "cube", 0), own.format("b", "aam", 9))
    world.step()
    inner = world.backend._scene
    assert inner._clearance.radius[0] == pytest.approx(0.025 * np.sqrt(3.0), abs=1e-5)
    model, data, rng = inner.model, inner.data, np.random.default_rng(1)
    root = int(inner._clearance._roots[1])
    own_bodies = [k for k in range(model.nbody) if model.body_rootid[k] == root]
    for _ in range(50):
        for j in range(model.njnt):
            if model.jnt_bodyid[j] in own_bodies and model.jnt_type[j] >= 2:
                data.qpos[model.jnt_qposadr[j]] = rng.uniform(*model.jnt_range[j])
        inner.engine.mj_kinematics(model, data)
        for k in range(model.ngeom):
            if model.geom_bodyid[k] in own_bodies:
                far = np.linalg.norm(data.geom_xpos[k] - data.xpos[root]) + model.geom_rbound[k]
                assert far <= inner._clearance.radius[1]
    world.close()


def test_planes_and_solids_are_kept_clear_of() -> None:
    """Nothing is searched for in the air; it is close above ground, and beside an obstacle."""
    pillar = "+environment.obstacles.a={type: box, size: [1, 1, 6], position: [4, 0, 3]}"
    for place, clear in (((0, 0, 3), True), ((0, 0, 0.03), False), ((3.2, 0, 3), False)):
        high = f"robots.high={{robot: cube, initial: {{position: {list(place)}}}}}"
        world = scene(pillar, "robots.low={robot: cube, initial: {position: [-9, 0, 9]}}", high)
        world.step()
        inner = world.backend._scene
        assert (inner._clearance.slack(inner._clearance.places(inner.data)) > 0.0) == clear
        world.close()


@pytest.mark.parametrize(
    ("place", "slack"),
    [
        # half of the way between two spheres, which both may go
        ([3.0, 4.0, 9.0], 0.5 * 5.0 - 0.025 * np.sqrt(3.0)),
        # the way of one sphere to the ground
        ([3.0, 4.0, 0.5], 0.5 - 0.025 * np.sqrt(3.0)),
    ],
)
def test_how_far_robots_may_go(place: list[float], slack: float) -> None:
    """Two cubes of 5 cm: half of their distance less the radius, or the height less the radius."""
    own = "robots.{}={{robot: cube, initial: {{position: {}}}}}"
    world = scene(own.format("a", [0.0, 0.0, 9.0]), own.format("b", place))
    inner = world.backend._scene
    inner.compile()
    inner.posed()
    found = inner._clearance.slack(inner._clearance.places(inner.data))
    assert found == pytest.approx(slack, abs=1e-5)
    world.close()
