"""Impulses of recorded and simulated drops for each kilogram, and their band of masses."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.water_validation import entry


def test_impulse_of_a_steady_force_is_in_closed_form() -> None:
    """Under g + f felt, the way is V t - f t^2 / 2 and the impulse (g + f) t."""
    speed, force = 4.0, 30.0
    time = np.linspace(0.0, 0.05, 501)
    found = entry.impulses(time, np.full(500, entry.GRAVITY + force), speed)
    way = np.array(entry.DEPTHS) * entry.RADIUS
    t = (speed - np.sqrt(speed**2 - 2.0 * force * way)) / force
    expected = (entry.GRAVITY + force) * t / (1000.0 * entry.RADIUS**3 * speed)
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_an_impulse_is_missed_only_where_no_mass_meets_it() -> None:
    """Inside of the band there is no error; outside it is that to its nearer edge."""
    inside = entry.in_band("I, {} to {} kg", 2.2, 4.0, (0.5, 0.57))
    assert (inside.error, inside.passed, inside.what) == (0.0, True, "I, 0.5 to 0.57 kg")
    assert entry.in_band("I", 2.6, 4.0, (0.5, 0.57)).error == pytest.approx(2.6 / 2.28 - 1.0)
    assert entry.in_band("I", 1.0, 4.0, (0.5, 0.57)).passed is False
