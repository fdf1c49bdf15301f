"""Posterior of a fit whose equations rounding left indefinite, and figures that are not finite."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from seals.errors import SealsError
from seals.logs.atomic import finite, write_json
from seals.report import Bar, Bars, Mark, Section, page
from seals.sysid.predictors.normal_equations import Fit, newton_step, posterior_covariance
from seals.sysid.predictors.sensor_readings import delayed


def fit_of(normal: np.ndarray, precision: np.ndarray) -> Fit:
    """A fit of one window at zero with given equations."""
    keys = tuple(f"effect.value_{k}" for k in range(len(precision)))
    zero = np.zeros(len(keys))
    return Fit(
        free=(),
        keys=keys,
        values=dict.fromkeys(keys, 0.0),
        cost=0.0,
        misfit=np.zeros(1),
        normal=normal[None],
        right=zero[None],
        precision=precision,
        centre=zero,
        penalty=0.0,
    )


def test_the_spread_of_effects_that_act_alike_is_real_and_within_the_prior() -> None:
    """Two collinear columns, their products 1e-9 off: no 1-sigma is NaN or beyond its prior."""
    size = 1e8
    normal = size * np.array([[1.0, 1.0 + 1e-7], [1.0 + 1e-7, 1.0]])
    fit = fit_of(normal, np.array([1.0, 1.0]))
    assert np.diag(np.linalg.inv(normal + np.eye(2))).min() < 0.0
    for key in fit.keys:
        # the sum of both is known, their difference is as open as before
        assert fit.spread(key) == pytest.approx(math.sqrt(0.5), rel=1e-6)
    assert np.linalg.eigvalsh(fit.covariance).min() > 0.0


def test_the_covariance_of_a_sound_fit_is_the_inverse() -> None:
    """Columns of very different size: the same as the inverse of information and precision."""
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(40, 6)) * 10.0 ** rng.uniform(-4.0, 4.0, 6)
    precision = 10.0 ** rng.uniform(-3.0, 3.0, 6)
    normal = columns.T @ columns
    found = posterior_covariance(normal, precision)
    np.testing.assert_allclose(found @ (normal + np.diag(precision)), np.eye(6), atol=1e-6)
    np.testing.assert_allclose(found, found.T, rtol=1e-12)


def test_a_step_of_indefinite_equations_leads_downhill() -> None:
    """A diagonal below zero: the step is finite and promises a fall, as the sound part gives it."""
    fit = fit_of(np.array([[-5e8, 1e4], [1e4, 3.0]]), np.array([1.0, 1.0]))
    fit = dataclasses.replace(fit, right=np.array([[2e4, 0.0]]))
    step, promised = newton_step(fit)
    assert np.isfinite(step).all()
    assert promised > 0.0
    assert step == pytest.approx(fit.covariance @ fit.right[0])


def test_readings_that_ran_out_of_digits_stay_so() -> None:
    """A run with an overflow gives NaN, the other runs their readings a little earlier."""
    time = 0.1 * np.arange(20)
    samples = SimpleNamespace(time=time, step=0.1, runs=((0, 10), (10, 20)))
    seen = np.stack([time, 2.0 * time], axis=1)
    seen[3, 1] = np.inf
    found = delayed(SimpleNamespace(samples=samples), seen, 0.02)  # type: ignore[arg-type]
    assert np.isnan(found[:10]).all()
    np.testing.assert_allclose(found[11:, 0], time[11:] - 0.02)


def test_a_factor_that_cannot_move_has_no_spread() -> None:
    """Infinite prior precision: 1-sigma 0, and the other factor as if it stood alone."""
    found = posterior_covariance(np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([1.0, np.inf]))
    np.testing.assert_allclose(found, [[0.25, 0.0], [0.0, 0.0]], atol=1e-15)


def test_equations_that_are_not_finite_give_no_figure() -> None:
    """A covariance of NaN instead of an error out of the linear algebra."""
    assert math.isnan(fit_of(np.full((1, 1), np.nan), np.ones(1)).spread("effect.value_0"))


def test_numbers_that_are_not_finite_are_written_as_null(tmp_path: Path) -> None:
    """What may be undetermined becomes null; where it is not said so, JSON refuses it."""
    content = {"value": np.float64("nan"), "ends": np.array([1.0, np.inf]), "count": 3, "on": True}
    with pytest.raises(SealsError, match=r"answer\.json' cannot be written"):
        write_json(tmp_path / "answer.json", content)
    write_json(tmp_path / "answer.json", finite(content))
    table = json.loads((tmp_path / "answer.json").read_text(encoding="utf-8"))
    assert table == {"value": None, "ends": [1.0, None], "count": 3, "on": True}


@pytest.mark.parametrize("log", [False, True])
def test_a_chart_of_bars_draws_what_is_finite(*, log: bool) -> None:
    """A bar without a value says so, and the page can be written."""
    bars = [
        Bar(label="first", value=2.0, error=math.nan, text="2"),
        Bar(label="second", value=math.nan, start=2.0, error=0.1, text="nan"),
        Bar(label="third", value=math.inf, text="inf"),
    ]
    chart = Bars(
        title="Gains", x_label="1", bars=bars, marks=(Mark(at=math.nan, label="needed"),), log=log
    )
    html = page("Diagnosis", [Section(title="A", blocks=[chart])])
    assert html.count('"text":"not determined"') == 2
    assert '"text":"2"' in html
