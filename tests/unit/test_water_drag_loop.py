"""The loop on the particle water: textbook, stated model, and the term that is taken over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.experiments.water_drag_loop import below_the_grid, overrides_of
from seals.experiments.water_drag_loop.measured import Nominal, nominal_of, write_measurement
from seals.experiments.water_drag_loop.textbook import (
    ADDED,
    LAG,
    LEARNT,
    MASS,
    QUADRATIC,
    Course,
    towed,
)
from seals.run.build import run_settings
from seals.sysid.report.estimator import MissingEffect


def test_the_textbook_tow_has_its_closed_form() -> None:
    """Under a steady force the speed goes to its end as a hyperbolic tangent."""
    course = towed(((9.0, 50.0),), until=4.0)
    end = np.sqrt(50.0 / QUADRATIC)
    rate = np.sqrt(50.0 * QUADRATIC) / ((1.0 + ADDED) * MASS)
    late = course.time > 0.5
    # the lag of the force delays all by one time constant, to first order
    exact = end * np.tanh(rate * (course.time - LAG))
    assert np.abs(course.velocity - exact)[late].max() < 1e-3 * end
    assert course.velocity[-1] == pytest.approx(end, rel=1e-4)


def test_impulses_show_added_mass_and_drag() -> None:
    """The coefficients behind a course made by another integrator come back."""
    c = towed(((0.8, 100.0), (1.5, 30.0)), until=1.5)
    found = nominal_of([Course(*c)])
    assert found.added == pytest.approx(ADDED * MASS, rel=0.03)
    assert found.quadratic == pytest.approx(QUADRATIC, rel=0.03)
    assert found.left < 1.0


def test_a_term_below_zero_is_a_force_beside_the_particles(tmp_path: Path) -> None:
    """A negative change of drag becomes a formula that pushes, a correction in water."""
    model = tmp_path / "model.yaml"
    model.write_text(
        "summary: x\nchanges:\n  quadratic_drag: {effect: quadratic_drag, medium: water, "
        "coefficient_x: -6.0, coefficient_y: 0.1, coefficient_z: 0.0}\n",
        encoding="utf-8",
    )
    term = below_the_grid(model)
    assert term == {"quadratic_drag": -6.0}
    settings = run_settings(["robot=ball", "water=particles", *overrides_of(term)])
    effect = settings.effects["subgrid_quadratic_drag"]
    assert (effect.drag_x, effect.drag_power, effect.correction) == (-6.0, 2.0, True)
    assert effect.medium.value == "water"


def test_something_else_than_drag_is_not_taken_over(tmp_path: Path) -> None:
    """A wind is no term of the water."""
    model = tmp_path / "model.yaml"
    model.write_text("summary: x\neffects:\n  wind: {effect: wind, velocity_x: 2.0}\n")
    with pytest.raises(ConfigError, match="is no drag"):
        below_the_grid(model)


@pytest.mark.slow
@pytest.mark.parametrize("stated", [14.0, 4.0])
def test_the_drag_is_named_with_its_sign(tmp_path: Path, stated: float) -> None:
    """Stated too high or too low, quadratic drag is named with the difference."""
    nominal = Nominal(added=4.0, quadratic=stated, left=0.0)
    write_measurement(tmp_path / "log", towed(LEARNT, until=20.0), nominal, seed=1)
    missing = MissingEffect().fit(tmp_path / "log")
    assert missing.verdict_ == "named"
    found = missing.effects_["quadratic_drag"]["coefficient_x"]
    assert found.value == pytest.approx(QUADRATIC - stated, abs=0.5)
    assert found.low90 < QUADRATIC - stated < found.high90
