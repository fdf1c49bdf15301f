"""Commanded and passive axes of vehicles with few drives, and their priority."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.control import Layout
from seals.control.allocation import Allocation, Saturation
from seals.control.axes import (
    AXES,
    commanded_axes,
    mean_arm,
    priority_weights,
    wrench_matrix,
)
from seals.errors import ConfigError
from seals.run.assembly import build_world
from seals.run.build import run_settings
from tests.unit.rov_layouts import LAYOUTS, PASSIVE, rov_folder

CENTRE = np.array([0.0, 0.0, -0.03])
FORCE = 40.0
RANKS = ["roll+pitch", "yaw", "heave", "surge+sway"]


def layout_of(name: str) -> Layout:
    """Return the layout of thrusters of 40 N."""
    rows, count = np.array(LAYOUTS[name]), len(LAYOUTS[name])
    one = np.ones(count)
    return Layout(
        position=rows[:, :3],
        axis=rows[:, 3:],
        thrust_coefficient=one,
        reaction_coefficient=0.0 * one,
        limit=FORCE * one,
        low=-FORCE * one,
        lag=0.1 * one,
        fall=0.1 * one,
        reverse=one,
        kind=("thruster",) * count,
        link=(0,) * count,
    )


def summed(name: str, force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force and torque about the centre of gravity, thruster by thruster."""
    total = np.zeros(6)
    for f, row in zip(force, np.array(LAYOUTS[name]), strict=True):
        push = f * row[3:]
        total += np.concatenate((push, np.cross(row[:3] - CENTRE, push)))
    return total


def axes_of(name: str) -> tuple[int, ...]:
    """Return the commanded axes of a layout."""
    layout = layout_of(name)
    return commanded_axes(wrench_matrix(layout, CENTRE), mean_arm(layout, CENTRE))


@pytest.mark.parametrize("name", LAYOUTS)
def test_what_no_thruster_turns_is_passive(name: str) -> None:
    """Roll and pitch of a vehicle are passive where they only come with another axis."""
    assert set(AXES) - {AXES[k] for k in axes_of(name)} == PASSIVE[name]


@pytest.mark.parametrize("name", LAYOUTS)
def test_an_unsaturated_allocation_is_exact(name: str) -> None:
    """Forces and moments summed thruster by thruster are those asked for, B f = tau to 1e-9."""
    axes, rng = axes_of(name), np.random.default_rng(0)
    allocation = Allocation(
        layout_of(name), rows=axes, saturation=Saturation.priority, centre=CENTRE
    )
    for _ in range(50):
        tau = rng.uniform(-1.0, 1.0, 6)[list(axes)] * np.where(np.array(axes) < 3, 8.0, 0.8)
        force = allocation.commands(tau, CENTRE)
        assert np.abs(force).max() < FORCE
        assert summed(name, force)[list(axes)] == pytest.approx(tau, abs=1e-9)


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("ranks", [RANKS, ["heave", "surge+sway", "yaw", "roll+pitch"]])
def test_saturated_thrusters_keep_the_order_of_priority(name: str, ranks: list[str]) -> None:
    """Each rank errs by no more than ratio times what the ranks below it must give up.

    What must be given up is found by an independent solver that serves one rank after the other.
    The bound follows from the least squares: theirs is a candidate of ours.
    """
    axes, rng, bound = axes_of(name), np.random.default_rng(1), 0
    weights, matrix = priority_weights(ranks, axes), wrench_matrix(layout_of(name), CENTRE)
    matrix = matrix[list(axes)] / FORCE
    reach = 2.0 * FORCE * np.abs(matrix).sum(axis=1)
    allocation = Allocation(
        layout_of(name), rows=axes, saturation=Saturation.priority, weights=weights, centre=CENTRE
    )
    for _ in range(20):
        tau = 0.5 * reach * rng.uniform(-0.9, 0.9, len(axes))
        force = allocation.commands(tau, CENTRE)
        assert np.abs(force).max() <= FORCE * (1.0 + 1e-9)
        ours = (summed(name, force)[list(axes)] - tau) / reach
        theirs = in_turn(matrix / reach[:, None], tau / reach, weights)
        for weight in sorted(set(weights), reverse=True)[:-1]:
            above, below = weights >= weight, weights < weight
            given_up = float(np.linalg.norm((weights * theirs)[below])) / weight
            kept = float(np.linalg.norm((weights * theirs)[above])) / weight
            found = float(np.linalg.norm((weights * ours)[above])) / weight
            assert found <= np.hypot(kept, given_up) * (1.0 + 1e-4) + 1e-5
            bound += given_up > 1e-3
    assert bound > 5


def in_turn(
    a: NDArray[np.float64], tau: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Errors of the thrusts that serve one rank after the other, those above it held."""
    optimize = pytest.importorskip("scipy.optimize")
    goal, scale = tau.copy(), np.zeros(len(tau))
    for weight in sorted(set(weights), reverse=True):
        scale = np.where(weights > weight, 1e3, np.where(weights == weight, 1.0, 0.0))
        found = optimize.lsq_linear(a * scale[:, None], goal * scale, (-FORCE, FORCE), tol=1e-14)
        # what a rank has got is what it keeps
        goal = np.where(weights >= weight, a @ found.x, goal)
    return goal - tau


def test_ranks_become_weights_in_equal_ratios() -> None:
    """Tenths by rank, smaller steps where there are many; a wrong name is refused with its like."""
    six = priority_weights(["yaw", "pitch", "roll", "heave", "sway", "surge"], range(6))
    assert six[5] == 1.0
    assert six[0] == pytest.approx(1e-3)
    with pytest.raises(ConfigError, match="'heeve' is not an axis") as refusal:
        priority_weights(["heeve"], range(6))
    assert "heave" in str(refusal.value)
    with pytest.raises(ConfigError, match="'yaw' stands twice"):
        priority_weights(["yaw", "yaw+roll"], range(6))


def test_a_vehicle_without_heave_is_refused_by_name(tmp_path: Path) -> None:
    """Two thrusters along the vehicle keep no station: the axes and the way out are named."""
    robot = rov_folder(tmp_path / "two", LAYOUTS["four"][:2])
    settings = run_settings([f"robot={robot}", "water=fossen", "controller=station", "guide=hover"])
    with pytest.raises(ConfigError, match="do not command heave") as refusal:
        build_world(settings)
    assert "controller=autopilot guide=los" in str(refusal.value)
