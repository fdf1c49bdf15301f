"""Dry friction in the diagnosis: its slope, its bounds, and what the catalogue calls it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from seals.plugins.effects.joint_friction import friction_as_catalogued
from seals.sysid.candidates.parameters import Parameter
from seals.sysid.candidates.reported_values import own_part
from seals.sysid.predictors.linearise import discrete
from seals.sysid.predictors.normal_equations import Fit, newton_step


def _fit(matrix: np.ndarray, right: np.ndarray, values: list[float]) -> Fit:
    """One window without priors, expanded about given values."""
    keys = tuple(f"k{i}" for i in range(len(right)))
    zero = np.zeros(len(right))
    return Fit(
        free=(),
        keys=keys,
        values=dict(zip(keys, values, strict=True)),
        cost=0.0,
        misfit=np.zeros(1),
        normal=matrix[None],
        right=right[None],
        precision=zero,
        centre=zero,
        penalty=0.0,
    )


def test_a_steep_slope_is_integrated_exactly() -> None:
    """A joint damped twelve times faster than a row lasts is stepped like the exponential."""
    slope = np.array([[0.0, 1.0], [-40.0, -1250.0]])
    transition, integral = discrete(np.stack([slope, slope]), 0.01)
    whole = expm(np.block([[slope, np.eye(2)], [np.zeros((2, 4))]]) * 0.01)
    # fourth order in steps of half a time constant: 0.5^5 / 120 of what is left of the mode
    assert np.allclose(transition[0], whole[:2, :2], rtol=1e-5, atol=1e-7)
    assert np.allclose(integral[0], whole[:2, 2:], rtol=1e-5, atol=1e-7)


def test_a_key_at_its_bound_does_not_stop_the_others() -> None:
    """The step along the bound is that of the problem without the key, and its fall is exact."""
    matrix, right = np.array([[2.0, 1.8], [1.8, 2.0]]), np.array([1.0, -1.0])
    fit = _fit(matrix, right, [0.0, 0.0])
    free, _ = newton_step(fit)
    assert free[1] < 0.0
    step, fall = newton_step(fit, (np.array([-np.inf, 0.0]), np.full(2, np.inf)))
    assert step == pytest.approx([0.5, 0.0])
    assert fall == pytest.approx(2.0 * 0.5 * 1.0 - 2.0 * 0.5**2)


def test_a_step_inside_the_bounds_is_the_plain_one() -> None:
    """Bounds that are far change nothing."""
    fit = _fit(np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([0.4, -0.2]), [0.1, 0.2])
    plain, promised = newton_step(fit)
    held, fall = newton_step(fit, (np.full(2, -9.0), np.full(2, 9.0)))
    assert held == pytest.approx(plain)
    assert fall == pytest.approx(promised)


def test_slow_joints_turn_dry_friction_into_the_law_of_the_catalogue() -> None:
    """About rest, tanh is a slope: the law with a jump has less dry and more viscous friction."""
    rates = np.linspace(-0.08, 0.08, 401)
    dry, wet = friction_as_catalogued(0.1, 0.0, 0.05, rates)
    torque, laws = 0.1 * np.tanh(rates / 0.05), np.stack([np.sign(rates), rates])
    assert laws @ (torque - np.array([dry, wet]) @ laws) == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < dry < 0.05
    assert wet > 0.4
    fast = np.concatenate([np.linspace(-5.0, -1.0, 50), np.linspace(1.0, 5.0, 50)])
    assert friction_as_catalogued(0.1, 0.02, 0.05, fast) == pytest.approx((0.1, 0.02))


def test_friction_of_the_vehicle_itself_is_taken_off_on_average() -> None:
    """A quantity that can only add has a positive mean; one of either sign has none."""
    only = Parameter(
        key="joint_friction_1.coulomb", tolerance=0.01, scale=0.05, bounds=(0.0, np.inf)
    )
    rng = np.random.default_rng(3)
    draws = np.abs(rng.normal(0.0, 0.01, 200_000))
    value, spread = own_part(only, 0.05)
    assert value == pytest.approx(0.05 - draws.mean(), abs=1e-4)
    assert spread == pytest.approx(draws.std(), abs=1e-4)
    assert own_part(Parameter(key="mass.mass", tolerance=0.1, scale=1.0), 0.3) == (0.3, 0.1)
