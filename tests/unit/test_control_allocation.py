"""Allocation of wrenches to drives whose centre of gravity moves."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.control import Layout
from seals.control.allocation import Allocation, Saturation
from seals.control.bounded import best_within

SEEDS = range(40)
LARGE = 1000.0


def layout_of(rng: np.random.Generator, count: int, *, reverse: float = 0.0) -> Layout:
    """Rotors along body z at random places, turning in turn."""
    turn = np.where(np.arange(count) % 2, 1.0, -1.0)
    angle = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count
    radius = rng.uniform(0.15, 0.4, count)
    limit = rng.uniform(600.0, LARGE, count)
    place = (radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-0.1, 0.1, count))
    thrust = rng.uniform(5e-6, 3e-5, count)
    return Layout(
        position=np.stack(place, axis=1),
        axis=np.tile([0.0, 0.0, 1.0], (count, 1)),
        thrust_coefficient=thrust,
        reaction_coefficient=turn * thrust * rng.uniform(0.01, 0.03, count),
        limit=limit,
        low=-limit if reverse else np.zeros(count),
        lag=np.full(count, 0.05),
        fall=np.full(count, 0.05),
        reverse=np.full(count, reverse or 1.0),
        kind=("rotor",) * count,
        link=(0,) * count,
    )


def summed(layout: Layout, speed: NDArray[np.float64], centre: NDArray[np.float64]) -> list[float]:
    """Lift, roll, pitch and yaw by summing forces and moments rotor by rotor."""
    total = np.zeros(6)
    for k in range(layout.drives):
        square = speed[k] * abs(speed[k]) * (layout.reverse[k] if speed[k] < 0.0 else 1.0)
        force = layout.thrust_coefficient[k] * square * layout.axis[k]
        torque = np.cross(layout.position[k] - centre, force)
        torque += layout.reaction_coefficient[k] * square * layout.axis[k]
        total += np.concatenate((force, torque))
    return [float(x) for x in total[2:]]


@pytest.mark.parametrize("saturation", list(Saturation))
@pytest.mark.parametrize("count", [4, 5, 6, 7, 8])
def test_the_rotors_make_the_wanted_wrench_within_their_limits(
    count: int, saturation: Saturation
) -> None:
    """Summing rotor forces and moments gives the wrench that was asked for, to 1e-9."""
    tried = 0
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        layout, centre = layout_of(rng, count), rng.uniform(-0.05, 0.05, 3)
        # a wrench that some speeds make: near hover, so that the least-norm ones stay inside
        speed = 0.6 * layout.limit * rng.uniform(0.9, 1.1, count)
        wrench = np.array(summed(layout, speed, centre))
        found = Allocation(layout, saturation=saturation).commands(wrench, centre)
        # the pseudo-inverse may prefer other speeds, beyond a limit
        if (found <= 0.0).any() or (found >= layout.limit).any():
            continue
        tried += 1
        assert summed(layout, found, centre) == pytest.approx(wrench, abs=1e-9, rel=1e-9)
    assert tried > 25


def test_the_rows_are_those_of_the_paper() -> None:
    """Lift k_T, roll (y - y_c) k_T, pitch -(x - x_c) k_T, yaw k_R d, about the live centre."""
    layout, (x, y, z) = layout_of(np.random.default_rng(3), 6), (0.03, -0.02, -0.05)
    k = layout.thrust_coefficient
    paper = [k, (layout.position[:, 1] - y) * k, -(layout.position[:, 0] - x) * k]
    rows = Allocation(layout).matrix(np.array([x, y, z]))
    np.testing.assert_allclose(rows, [*paper, layout.reaction_coefficient], rtol=1e-13, atol=1e-20)


@pytest.mark.parametrize("saturation", list(Saturation))
@pytest.mark.parametrize("count", [4, 6, 8])
def test_no_speed_is_ever_negative_or_excessive(count: int, saturation: Saturation) -> None:
    """Wild wrenches leave all speeds between zero and the limit."""
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        layout = layout_of(rng, count)
        allocation = Allocation(layout, saturation=saturation)
        for _ in range(5):
            wrench = rng.normal(size=4) * [100.0, 20.0, 20.0, 5.0]
            found = allocation.commands(wrench, rng.uniform(-0.1, 0.1, 3))
            assert (found >= 0.0).all()
            assert (found <= layout.limit * (1.0 + 1e-12)).all()


def test_saturation_as_in_the_paper_keeps_the_proportions_of_squared_speeds() -> None:
    """Beyond the largest, all squared speeds shrink alike until the largest is allowed."""
    layout = layout_of(np.random.default_rng(0), 4)
    allocation, centre = Allocation(layout), np.zeros(3)
    inside = np.array([20.0, 0.1, -0.2, 0.02])
    free, held = allocation.commands(inside, centre), allocation.commands(50.0 * inside, centre)
    np.testing.assert_allclose((held / free) ** 2, (held / free)[0] ** 2)
    assert np.max(held / layout.limit) == pytest.approx(1.0)


def test_roll_and_pitch_come_before_thrust_and_yaw() -> None:
    """With too much thrust and yaw asked for, roll and pitch are still made."""
    layout, weights = layout_of(np.random.default_rng(1), 4), np.array([0.02, 1.0, 1.0, 0.002])
    first = Allocation(layout, saturation=Saturation.priority, weights=weights)
    wrench, centre = np.array([200.0, 0.5, -0.4, 1.0]), np.array([0.01, 0.0, -0.03])
    made = summed(layout, first.commands(wrench, centre), centre)
    assert made[1:3] == pytest.approx([0.5, -0.4], abs=0.02)
    paper = summed(layout, Allocation(layout).commands(wrench, centre), centre)
    assert np.abs(np.array(paper[1:3]) - [0.5, -0.4]).max() > 0.05


def test_a_compensated_centre_leaves_no_torque() -> None:
    """Lift about the live centre makes no roll or pitch; about a wrong one it does."""
    layout, centre = layout_of(np.random.default_rng(2), 4), np.array([0.04, 0.01, -0.05])
    allocation, lift = Allocation(layout), np.array([5.0, 0.0, 0.0, 0.0])
    aware = summed(layout, allocation.commands(lift, centre), centre)
    unaware = summed(layout, allocation.commands(lift, np.zeros(3)), centre)
    assert np.abs(aware[1:3]).max() < 1e-9
    assert unaware[2] == pytest.approx(5.0 * 0.04, rel=1e-6)


def test_reversible_rotors_pull_as_far_as_they_can() -> None:
    """A rotor that turns back pulls with its share of the thrust; the command makes up for it."""
    layout, centre = layout_of(np.random.default_rng(4), 4, reverse=0.7), np.zeros(3)
    wrench = np.array([-8.0, 0.1, 0.2, 0.01])
    found = Allocation(layout).commands(wrench, centre)
    assert (found < 0.0).any()
    assert summed(layout, found, centre)[:3] == pytest.approx(wrench[:3], abs=1e-9)


@pytest.mark.parametrize("rows", [4, 6])
def test_the_best_within_limits_is_that_of_an_independent_solver(rows: int) -> None:
    """The bounded least squares agree with scipy's on random problems."""
    scipy = pytest.importorskip("scipy.optimize")
    for seed in range(60):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(4, 9))
        a, low, high = rng.normal(size=(rows, n)), -rng.random(n), rng.random(n) + 0.1
        wrench, weights = rng.normal(size=rows) * 5.0, 10.0 ** rng.uniform(-1.5, 0.0, rows)
        weight = weights / np.abs(a * (high - low)).sum(axis=1)
        best = scipy.lsq_linear(a * weight[:, None], wrench * weight, (low, high), tol=1e-14)
        found = best_within(a[None], wrench[None], low[None], high[None], weights)[0]
        misfit = [float(np.sum((weight * (a @ u - wrench)) ** 2)) for u in (found, best.x)]
        assert (found >= low - 1e-12).all()
        assert (found <= high + 1e-12).all()
        assert misfit[0] <= misfit[1] * (1.0 + 1e-6) + 1e-9


def test_one_row_of_limits_stands_for_many_wrenches() -> None:
    """Limits of one row hold for every wrench: the same commands as with a row each."""
    rng = np.random.default_rng(5)
    layout = layout_of(rng, 6)
    allocation = Allocation(layout, saturation=Saturation.priority)
    wrench = rng.normal(size=(12, 4)) * [200.0, 5.0, 5.0, 5.0]
    rows = {"gain": np.full((1, 6), 1.2), "limit": 0.9 * layout.limit[None]}
    each = {name: np.repeat(row, 12, axis=0) for name, row in rows.items()}
    found = allocation.commands(wrench, **rows)
    np.testing.assert_allclose(found, allocation.commands(wrench, **each), atol=1e-9)
    alone = [
        allocation.commands(w, layout.position.mean(axis=0), **{n: r[0] for n, r in rows.items()})
        for w in wrench
    ]
    np.testing.assert_allclose(found, alone, atol=1e-6)
    assert np.any(found >= 0.999 * rows["limit"])
