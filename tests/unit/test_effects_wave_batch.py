"""A regular wave whose parameters differ from row to row of a batch."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.arrays import Array, as_like
from seals.plugins.waves.airy import WaveAiry
from seals.testing.hooks import other_libraries
from seals.testing.instants import copied

ROWS = 6
RANGES = {
    "amplitude": (0.02, 0.1),
    "period": (2.0, 3.0),
    "direction": (-3.0, 3.0),
    "phase": (-3.0, 3.0),
    "gravity": (9.0, 10.0),
}


def batched(values: dict[str, Any], like: Array) -> WaveAiry:
    """Return a wave with arrays in place of some numbers."""
    wave = copy.copy(WaveAiry())
    for name, value in values.items():
        setattr(wave, name, as_like(value, like))
    return wave


@pytest.mark.parametrize("library", ["numpy", *other_libraries()])
@pytest.mark.parametrize("fields", [list(RANGES), *([name] for name in RANGES)], ids="+".join)
@pytest.mark.parametrize("times", [1, ROWS])
def test_a_batch_of_waves_is_each_wave_by_itself(
    library: str, fields: list[str], times: int
) -> None:
    """Every row of a batched wave equals the wave of that row's numbers at that row's point."""
    rng = np.random.default_rng(5)
    like = {"numpy": np.zeros(1), **other_libraries()}[library]
    values = {name: rng.uniform(*RANGES[name], ROWS) for name in fields}
    place, time = rng.normal(size=(ROWS, 3)), rng.uniform(0.0, 5.0, (times, 1))
    found = copied(batched(values, like).at(as_like(place, like), as_like(time, like), 0.2))
    for row in range(ROWS):
        alone = WaveAiry(**{name: float(value[row]) for name, value in values.items()})
        expected = alone.at(place[row : row + 1], time[min(row, times - 1)][None], 0.2)
        for a, b in zip(found, expected, strict=True):
            assert_allclose(a[row : row + 1], b, rtol=0.0, atol=1e-13)


def test_a_batch_of_waves_at_one_point() -> None:
    """Waves of three amplitudes under one crest: elevations, and the speeds of their orbits."""
    crest = batched({"amplitude": [0.0, 0.05, 0.1]}, np.zeros(1))
    sea = crest.at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0)
    assert_allclose(sea.elevation, [[0.0], [0.05], [0.1]])
    assert sea.velocity is not None
    assert_allclose(sea.velocity[:, 0], np.pi * np.array([0.0, 0.05, 0.1]), rtol=1e-14)
