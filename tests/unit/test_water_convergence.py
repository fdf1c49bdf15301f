"""Extrapolation of figures to spacing zero; references of the validation."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.water_validation import heave
from seals.experiments.water_validation.richardson import Extrapolated

SPACINGS = np.array([1.0, 0.7, 0.5, 0.35, 0.25])


@pytest.mark.parametrize("order", [0.8, 1.0, 1.7])
def test_a_clean_order_is_found_and_the_band_covers_the_truth(order: float) -> None:
    """Figures of one power law: its value at zero, its order, and a clear fit."""
    found = Extrapolated.of(SPACINGS, 0.47 + 0.3 * SPACINGS**order)
    assert found.clear
    assert found.value == pytest.approx(0.47, abs=1e-3)
    assert found.order == pytest.approx(order, abs=0.006)
    assert abs(found.value - 0.47) <= found.band


@pytest.mark.thorough
def test_noise_widens_the_band_and_it_still_covers_the_truth() -> None:
    """Scatter of three per cent: nine bands of ten hold the true value."""
    rng, held, widths = np.random.default_rng(1), 0, []
    for _ in range(400):
        values = (0.47 + 0.3 * SPACINGS) * (1.0 + 0.03 * rng.standard_normal(5))
        found = Extrapolated.of(SPACINGS, values)
        held += abs(found.value - 0.47) <= found.band
        widths.append(found.band)
    assert held >= 360
    assert np.median(widths) > Extrapolated.of(SPACINGS, 0.47 + 0.3 * SPACINGS).band


def test_figures_without_an_order_are_called_unclear() -> None:
    """They go up and down: three times the distance, not 1.25 times."""
    found = Extrapolated.of(SPACINGS, [1.0, 1.4, 0.9, 1.5, 1.0])
    assert not found.clear
    assert found.band > 0.2


def test_two_spacings_are_refused() -> None:
    """A fit of three unknowns needs three."""
    with pytest.raises(ValueError, match="Give at least three"):
        Extrapolated.of([1.0, 1.0, 0.5], [1.0, 1.0, 2.0])


def test_heave_in_potential_flow_has_the_measured_period_and_decays() -> None:
    """Half-submerged sphere of 0.3 m: the period of Kramer et al. 2021 within 5 %."""
    z = heave.potential_flow(300)
    trough, crest = heave.extremes(z)
    assert 2.0 * (crest - trough) * heave.STEP == pytest.approx(heave.PERIOD, rel=0.05)
    assert z[0] == 1.0 > -z[trough] > z[crest] > 0.5
