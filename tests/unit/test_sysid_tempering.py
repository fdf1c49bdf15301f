"""Tempered priors of tolerances while a model is far off its readings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from seals.arrays import Floats
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.tempering import approached, temperature, tempered

TRUE, SIGMA, TOLERANCE = 14.0, 1e-3, 0.05
WINDOWS, ROWS = 4, 50


def drag(speed: float, exponent: float) -> Floats:
    """Drag on a body that moves to and fro in a wind; the exponent is one of its shape."""
    own = np.sin(np.linspace(0.0, 12.0, WINDOWS * ROWS)).reshape(WINDOWS, ROWS)
    flow = speed - own
    return flow * np.abs(flow) ** (1.0 + exponent)


READINGS = drag(TRUE, 0.0)


def at(values: dict[str, float], precision: Floats) -> Fit:
    """Equations of the wind's speed and of the tolerated exponent."""
    keys = ("shape.exponent", "wind.speed")
    off = (READINGS - drag(values["wind.speed"], values["shape.exponent"])) / SIGMA
    step = 1e-6
    columns = [
        (
            drag(values["wind.speed"] + b, values["shape.exponent"] + a) / SIGMA * -1.0
            + READINGS / SIGMA
            - off
        )
        / -step
        for a, b in ((step, 0.0), (0.0, step))
    ]
    jacobian = np.stack(columns, axis=2)
    here = np.array([values[k] for k in keys])
    penalty = float(np.sum(precision * here**2))
    level = np.sum(off**2, axis=1)
    return Fit(
        free=keys[1:],
        keys=keys,
        values=values,
        cost=float(level.sum()) + penalty,
        misfit=level,
        normal=np.einsum("wri,wrj->wij", jacobian, jacobian),
        right=np.einsum("wri,wr->wi", jacobian, off),
        precision=precision,
        centre=np.zeros(2),
        penalty=penalty,
    )


def descend(fit: Fit, moving: Sequence[str]) -> Fit:
    """Six Gauss-Newton steps with halving; the other keys stay."""
    for _ in range(6):
        own = [k for k, key in enumerate(fit.keys) if key in moving]
        here = np.array([fit.values[k] for k in fit.keys])
        matrix = fit.normal.sum(axis=0) + np.diag(fit.precision)
        gradient = fit.right.sum(axis=0) - fit.precision * here
        step = np.zeros(2)
        step[own] = np.linalg.solve(matrix[np.ix_(own, own)], gradient[own])
        for share in 0.5 ** np.arange(8):
            values = dict(zip(fit.keys, map(float, here + share * step), strict=True))
            with np.errstate(over="ignore", invalid="ignore"):
                found = at(values, fit.precision)
            if found.cost < fit.cost:
                fit = found
                break
    return fit


START = {"shape.exponent": 0.0, "wind.speed": 0.3}
PRIOR = np.array([TOLERANCE**-2, 1e-4])


def test_a_tolerance_does_not_stand_in_for_a_strong_effect() -> None:
    """The wind is found, where an untempered joint fit drives the exponent off."""
    begin = at(START, PRIOR)
    plain = descend(begin, begin.keys)
    found = descend(approached(begin, float(READINGS.size), descend), begin.keys)
    assert abs(plain.values["shape.exponent"]) > 3.0 * TOLERANCE
    assert found.values["wind.speed"] == pytest.approx(TRUE, rel=1e-3)
    assert abs(found.values["shape.exponent"]) < 0.1 * TOLERANCE
    assert found.cost < 1e-6 * plain.cost


def test_a_model_near_its_readings_is_left_alone() -> None:
    """Below ten floors the very fit comes back; at many the priors count as much more."""
    near = at({"shape.exponent": 0.0, "wind.speed": TRUE + 1e-4}, PRIOR)
    assert approached(near, float(READINGS.size), descend) is near
    assert temperature(float(near.misfit.sum()), float(READINGS.size)) == 1.0
    far = at({"shape.exponent": 0.1, "wind.speed": TRUE}, PRIOR)
    hot = tempered(far, 50.0)
    assert hot.precision.tolist() == [50.0 * PRIOR[0], PRIOR[1]]
    assert hot.cost - far.cost == pytest.approx(49.0 * PRIOR[0] * 0.1**2, rel=1e-6)
    assert hot.misfit is far.misfit


def test_a_misfit_that_is_no_number_has_no_temperature() -> None:
    """A prediction that ran away is not fitted at an infinite temperature."""
    assert temperature(np.inf, 10.0) == temperature(np.nan, 10.0) == 1.0
