"""Robots whose joints are held: one hull, one body, the same motion as the robot they stand for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seals.batch import BatchDynamics
from seals.batch.fused import FusedBody
from seals.batch.holding import hold
from seals.batch.response import Response
from seals.errors import ConfigError
from seals.hydrostatics import HullTable
from seals.motion import Inputs
from seals.multibody.tree import forward
from seals.robot.fusing import fused
from seals.run.assembly import build_model
from seals.run.build import run_settings

POSTURE = [0.3, -0.5, 0.4, -0.6, 0.1, -0.2]


@pytest.fixture(scope="module")
def model() -> Any:
    """The manipulator in water, with its effects."""
    settings = run_settings(["robot=aam", "water=fossen"])
    return settings, *build_model(settings)


def test_mass_and_inertia_are_those_of_the_whole_robot(model: Any) -> None:
    """Total mass and second moments agree with the sum over the links in that posture."""
    _, robot, _ = model
    whole = fused(robot, POSTURE)
    held = np.array([POSTURE])
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], held)
    places = origins[0] + (turns[0] @ robot.centre[:, :, None])[:, :, 0]
    mass = robot.mass.sum()
    centre = robot.mass @ places / mass
    inertia = np.zeros((3, 3))
    for m, p, r, own in zip(robot.mass, places, turns[0], robot.inertia, strict=True):
        a = p - centre
        inertia += r @ own @ r.T + m * (a @ a * np.eye(3) - np.outer(a, a))
    assert whole.links == (robot.links[0],)
    assert whole.mass[0] == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(whole.centre[0], centre, atol=1e-12)
    np.testing.assert_allclose(whole.inertia[0], inertia, atol=1e-12)


def test_one_hull_displaces_what_the_links_displace(model: Any) -> None:
    """At random poses the fused hull's volume and centroid are the sums over the links' own."""
    _, robot, _ = model
    whole = fused(robot, POSTURE).hulls[0]
    assert whole is not None
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], np.array([POSTURE]))
    for up, level in _surfaces(40):
        total, moment = 0.0, np.zeros(3)
        for hull, p, r in zip(robot.hulls, origins[0], turns[0], strict=True):
            if hull is not None:
                wet = hull.wetted(r.T @ up, float(level - up @ p))
                total += wet.volume
                moment += wet.volume * (p + r @ wet.centroid)
        exact = whole.wetted(up, level)
        assert exact.volume == pytest.approx(total, abs=1e-9 * whole.volume)
        np.testing.assert_allclose(exact.volume * exact.centroid, moment, atol=1e-12)


def test_the_table_of_a_fused_hull_is_within_a_thousandth(model: Any) -> None:
    """The body with its booms: 0.1 % of the whole volume at 300 random poses."""
    _, robot, _ = model
    hull = fused(robot, POSTURE, ("upper", "fore", "palm")).hulls[0]
    assert hull is not None
    ups, levels = (np.array(column) for column in zip(*_surfaces(300), strict=True))
    volume = HullTable.build(hull).lookup(ups, levels[:, None])[0][:, 0]
    exact = [hull.wetted(up, level).volume for up, level in zip(ups, levels, strict=True)]
    assert np.abs(volume - exact).max() < 1e-3 * hull.volume


def _surfaces(count: int) -> list[tuple[Any, float]]:
    """Random normals and levels of the surface."""
    rng = np.random.default_rng(5)
    ups = rng.normal(size=(count, 3))
    ups /= np.linalg.norm(ups, axis=1)[:, None]
    return list(zip(ups, rng.uniform(-0.3, 0.3, count).tolist(), strict=True))


@pytest.mark.thorough
@pytest.mark.parametrize("water_level", [0.0, None])
def test_a_fused_body_has_the_accelerations_of_the_tree(
    model: Any, water_level: float | None
) -> None:
    """Two forms of the equations of motion agree to rounding, added mass and drag included."""
    settings, robot, effects = model
    environment = replace(settings.environment, water_level=water_level)
    whole, held = hold(robot, effects, POSTURE)
    assert whole.links == ("body", "upper", "fore", "palm")
    rng = np.random.default_rng(1)
    batch = 6
    pose = {
        "position": rng.normal(size=(batch, 3)) * [1.0, 1.0, 0.2],
        "rpy": rng.normal(size=(batch, 3)) * 0.4,
        "velocity": rng.normal(size=(batch, 3)),
        "angular_velocity": rng.normal(size=(batch, 3)),
    }
    drive = rng.uniform(300.0, 900.0, (batch, 4))
    inputs = Inputs(0.0, np.zeros((1, 0)), drive, np.full((batch, 1), 15.0))
    found = []
    for held_form in (True, False):
        form = replace(whole, held=held_form)
        twin = BatchDynamics(form, held, environment, settings.wave, batch=batch)
        assert isinstance(twin.body, FusedBody) is held_form
        rates = twin.rates(twin.start(**pose), 0.0, inputs)
        found.append(
            np.concatenate((rates.velocity, rates.angular_velocity, rates.specific_force), axis=1)
        )
    assert np.abs(found[1]).max() > 5.0
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-9)


def test_a_fused_body_answers_a_push_as_the_tree_does(model: Any) -> None:
    """Linear responses of both forms, to pushes on the base and to more drag on a link."""
    settings, robot, effects = model
    whole, held = hold(robot, effects, POSTURE)
    batch, rng = 5, np.random.default_rng(2)
    pose = {
        "position": rng.normal(size=(batch, 3)) * [1.0, 1.0, 0.1],
        "rpy": rng.normal(size=(batch, 3)) * 0.4,
        "velocity": rng.normal(size=(batch, 3)),
        "angular_velocity": rng.normal(size=(batch, 3)),
    }
    inputs = Inputs(0.0, np.zeros((1, 0)), np.full((batch, 4), 500.0), np.full((batch, 1), 15.0))
    found = []
    for held_form in (True, False):
        form = replace(whole, held=held_form)
        twin = BatchDynamics(form, held, settings.environment, settings.wave, batch=batch)
        assert isinstance(twin.body, FusedBody) is held_form
        state = twin.start(**pose)
        posture = twin.posture(state, np.zeros((batch, 1)))
        response = Response(twin, state, np.zeros((batch, 1)), inputs, posture)
        forces = [response.force(twin.effects)]
        found.append(np.stack([*response.pushed(), *response.changes(forces)]))
    assert np.abs(found[1]).max() > 1.0
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8, atol=1e-8)


def test_a_posture_of_the_wrong_length_is_refused(model: Any) -> None:
    """The refusal names the robot and the number of joints."""
    _, robot, _ = model
    with pytest.raises(ConfigError, match="6 joint values"):
        fused(robot, [0.0, 0.0])
