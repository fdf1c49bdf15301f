"""Rounding is not taken for samples that were filled in."""

from __future__ import annotations

import numpy as np
import pytest

from seals.logs.check_values import check_filled
from seals.logs.log import Log

TIME = 1e-3 * np.arange(8000)
DEGREE = np.pi / 180.0


def _log(step: float = DEGREE) -> Log:
    """A multirotor at rest for four seconds, then in smooth motion, rounded as a recorder does."""
    moving = np.clip(TIME - 4.0, 0.0, None)
    phases = enumerate((0.0, 0.9, 2.1))
    wide = [2.0 * np.sin(7.0 * moving + phase) * (moving > 0.0) for _, phase in phases]
    drift = 0.01 * np.sin(0.4 * TIME)
    columns = {
        f"angular_velocity_{axis}": np.round((w + drift) / step) * step
        for axis, w in zip("xyz", wide, strict=True)
    }
    for k, axis in enumerate("xyz"):
        force = (9.81 if axis == "z" else 0.0) + 0.7 * wide[k] + drift
        columns[f"specific_force_{axis}"] = np.round(force / 0.098) * 0.098
    return Log(name="a", columns={"t": TIME, **columns})


def test_a_rounded_gyroscope_was_measured() -> None:
    """Whole degrees a second at 1 kHz, at rest and in motion: Betaflight writes them so."""
    assert check_filled(_log()) == []


@pytest.mark.parametrize("rounded", [False, True])
def test_lines_in_place_of_lost_samples_are_found(rounded: bool) -> None:
    """Two seconds of motion drawn as lines are refused, rounded or not."""
    log = _log()
    gap = slice(5000, 7000)
    columns = {name: values.copy() for name, values in log.columns.items()}
    for name in set(columns) - {"t"}:
        line = np.linspace(columns[name][gap][0], columns[name][gap][-1] + 3.0, 2000)
        step = DEGREE if name.startswith("angular") else 0.098
        columns[name][gap] = np.round(line / step) * step if rounded else line
    (found,) = check_filled(Log(name="a", columns=columns))
    assert found.severity.name == "REFUSE"
    assert found.where == pytest.approx(5.0, abs=0.3)
