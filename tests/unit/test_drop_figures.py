"""Figures of the drop test: the floor is met when a contact stays."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.drop_test import entry, landing, pressed
from seals.logs import Log


def test_a_contact_that_stays_is_the_floor() -> None:
    """Fingers that knock for one row are not the floor; sensors slower than the log are held."""
    time = 0.004 * np.arange(500)
    finger, body = np.zeros(500), np.full(500, np.nan)
    finger[50] = 30.0
    # the body's sensor reads every other row
    body[::2] = np.where(time[::2] >= 1.0, 12.0, 0.0)
    log = Log(
        name="drop",
        columns={"t": time, "pressing": body, "floor_tip_1_pressing": finger},
    )
    found = landing(log, pressed(log))
    assert found["first contact with the floor [s]"] == pytest.approx(1.0)
    assert found["carried by the floor in the last 0.2 s, mean [N]"] == pytest.approx(12.0)


def test_a_drop_that_ends_afloat_has_no_floor() -> None:
    """Without a contact there are no figures of one."""
    time = 0.004 * np.arange(500)
    assert landing(Log(name="drop", columns={"t": time}), np.zeros(500)) == {}


@pytest.mark.parametrize("every", [1, 4])
def test_the_entry_is_that_of_the_sensor_between_its_readings_too(every: int) -> None:
    """A sensor slower than the log: its last reading holds, a row without one is not zero."""
    time = 0.001 * np.arange(1000)
    force = np.where((time >= 0.4) & (time < 0.44), 80.0, 0.0)
    force[np.arange(1000) % every > 0] = np.nan
    columns = {"t": time, "specific_force_x": 0.0 * force, "specific_force_y": 0.0 * force}
    log = Log(name="drop", columns={**columns, "specific_force_z": force})
    water = np.zeros((1000, 1, 6))
    water[390:, 0, 2] = 5.0
    found = entry(log, water)
    assert found["peak of the felt force [m/s^2]"] == pytest.approx(80.0)
    # 40 rows are 39 ms from the first to the last; half the height falls between two rows
    assert found["duration of the spike at half height [s]"] == pytest.approx(0.039, abs=0.002)
