"""Figures of the drop test: the floor is met when a contact stays."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.drop_test import landing, pressed
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
