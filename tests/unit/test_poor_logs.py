"""Logs that no model can follow end in words, without warnings of the arithmetic."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs import read_native
from seals.logs.log import Log
from seals.logs.shipped import find_log
from seals.sysid.diagnosis import diagnose

FLIGHT = read_native(find_log("hidden_effect/flight_a"))


def changed(stem: str, factor: float, *, rows: int = 200) -> Log:
    """Two seconds of a flight, with a channel whose readings are off by a factor."""
    columns: dict[str, Floats] = {}
    for name, values in FLIGHT.columns.items():
        columns[name] = np.array(values[:rows], dtype=float)
        if name.startswith(stem):
            columns[name] *= factor
    return Log(name="poor", columns=columns, meta=FLIGHT.meta)


def test_numbers_out_of_all_bounds_are_told_without_warnings() -> None:
    """A gyroscope in a unit ten thousand times too small: the fit overflows in silence."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(LogError, match="no misfit can be computed"):
            diagnose(changed("angular_velocity", 1e4))


def test_a_log_shorter_than_the_transient_of_its_drives_is_refused() -> None:
    """Thirty rows: said is how long the log is, and what its first part is needed for."""
    with pytest.raises(LogError, match=r"has 30 rows, 0\.3 s; the start state of its drives"):
        diagnose(changed("none", 1.0, rows=30))
