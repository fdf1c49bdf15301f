"""Changes of the rigid inertia: a payload, a shifted centre of gravity, other moments."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from seals.arrays import Array, Floats
from seals.effects import bind_effects
from seals.effects.rigid import changed, weight_of
from seals.motion import Body, Motion
from seals.plugins.effects.centre_of_gravity import CentreOfGravity
from seals.plugins.effects.inertia import InertiaChange
from seals.plugins.effects.payload import Payload

VELOCITY, SPIN = np.array([1.0, -2.0, 0.5]), np.array([3.0, 1.0, -2.0])


def body(mass: float = 2.0, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Body:
    """Return one body."""
    return Body(np.array([[mass]]), np.array([centre]), np.ones((1, 1)), np.ones((1, 1)))


def matrix(effect: Any, of: Body, batch: int = 1, **values: Array) -> Floats:
    """Return the change of inertia, shape (N, 6, 6)."""
    given = {f"it.{name}": value for name, value in values.items()}
    bound = bind_effects({"it": effect}, ["base"]).with_values(given, np.zeros(1), batch)
    found: Floats = effect.inertia_change(of, bound.bound[0].params)
    assert found.shape == (batch, 6, 6)
    assert_allclose(found, np.swapaxes(found, 1, 2), atol=1e-15)
    return found


def momentum(inertia: Floats) -> Floats:
    """Return linear and angular momentum of the change at one twist."""
    return inertia[0] @ np.concatenate((VELOCITY, SPIN))


def test_a_payload_has_the_momentum_of_a_moving_point() -> None:
    """2 kg at (0.1, 0.2, 0.3) m move with v + w x p = (1.7, -3.1, 1) m/s and carry p x m that."""
    effect = Payload(mass=2.0, position_x=0.1, position_y=0.2, position_z=0.3)
    assert_allclose(
        momentum(matrix(effect, body())), [3.4, -6.2, 2.0, 2.26, 0.82, -1.30], rtol=1e-13
    )


def test_a_payload_pulls_the_centre_down_and_adds_its_weight() -> None:
    """0.5 kg hung 0.3 m under 1 kg: 1.5 kg with the centre at -0.1 m, 4.905 N more at the lever."""
    change = matrix(Payload(mass=0.5, position_x=0.2, position_z=-0.3), body(1.0))
    loaded = changed(body(1.0), change)
    assert_allclose(loaded.mass, 1.5)
    assert_allclose(loaded.centre_of_mass, [[0.2 / 3.0, 0.0, -0.1]], rtol=1e-13)
    turn, zero = np.eye(3)[None], np.zeros((1, 3))
    still = Motion(zero[:, :1], zero, turn, turn[:, 2, :], zero, zero, body(1.0))
    force, torque = weight_of(change, still, np.array([[9.81]]))
    assert force is not None
    assert torque is not None
    assert_allclose(force, [[0.0, 0.0, -4.905]], atol=1e-14)
    assert_allclose(torque, [[0.0, 0.981, 0.0]], atol=1e-14)


def test_payloads_of_a_batch_stay_apart() -> None:
    """A mass in one row and none in the other."""
    found = matrix(Payload(position_z=0.1), body(), 2, mass=np.array([0.0, 3.0]))
    assert_array_equal(found[0], 0.0)
    assert_allclose(np.diag(found[1]), [3.0, 3.0, 3.0, 0.03, 0.03, 0.0], rtol=1e-14)


def test_a_shifted_centre_keeps_mass_and_inertia_about_itself() -> None:
    """The change is that of two bodies of one mass and one inertia with different centres."""
    mass, centre, shift = 2.0, np.array([0.01, -0.02, 0.03]), np.array([0.04, 0.05, -0.06])
    effect = CentreOfGravity(offset_x=0.04, offset_y=0.05, offset_z=-0.06)
    of = body(mass, (0.01, -0.02, 0.03))
    ends = []
    for place in (centre + shift, centre):
        linear = mass * (VELOCITY + np.cross(SPIN, place))
        ends.append(np.concatenate((linear, np.cross(place, linear))))
    change = matrix(effect, of)
    assert_allclose(momentum(change), ends[0] - ends[1], rtol=1e-12)
    moved = changed(of, change)
    assert_allclose(moved.mass, mass)
    assert_allclose(moved.centre_of_mass, [centre + shift], rtol=1e-12)


def test_a_link_without_mass_keeps_the_centre_that_it_states() -> None:
    """Beside a payload on another link; a place where lift acts has no mass."""
    links = Body(
        np.array([[2.0], [0.0]]),
        np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]),
        *[np.ones((2, 1))] * 2,
    )
    added = np.zeros((2, 6, 6))
    added[0] = matrix(Payload(mass=0.5, position_x=0.4), body())[0]
    found = changed(links, added)
    assert_allclose(found.mass, [[2.5], [0.0]])
    assert_allclose(found.centre_of_mass, [[0.08, 0.0, 0.0], [0.3, 0.0, 0.0]])


def test_other_moments_change_nothing_else() -> None:
    """A diagonal of moments, no mass and no lever."""
    found = matrix(InertiaChange(delta_xx=0.001, delta_yy=-0.002, delta_zz=0.003), body())
    assert_array_equal(found[0], np.diag([0.0, 0.0, 0.0, 0.001, -0.002, 0.003]))
    same = changed(body(), found)
    assert_array_equal(same.mass, 2.0)
    assert_array_equal(same.centre_of_mass, 0.0)


def test_one_moment_of_a_batch() -> None:
    """A single batched moment makes one matrix a row."""
    found = matrix(InertiaChange(delta_xx=0.5), body(), 3, delta_zz=np.array([0.1, 0.2, 0.3]))
    assert_array_equal(found[:, 5, 5], [0.1, 0.2, 0.3])
    assert_array_equal(found[:, 3, 3], 0.5)
