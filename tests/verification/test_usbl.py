"""Acoustic positioning against geometry, and the published check value of the speed of sound."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.errors import ConfigError
from seals.plugins.sensors.usbl import SensorUsbl
from seals.sensors.acoustics import sound_speed
from seals.sensors.protocol import SensorInput
from seals.sensors.surroundings import Surroundings

ZERO = np.zeros(3)
SALT: dict[str, Any] = {"salinity": [[0.0, 35.0]], "water_temperature": [[0.0, 10.0]]}
EXACT = {"noise": 0.0, "angle_noise": 0.0}


def reading(usbl: SensorUsbl, **solids: ObstacleSettings) -> Any:
    """What is read 10 m deep, looking north."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, obstacles=solids, **SALT))
    north = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    here = np.array([0.0, 0.0, -10.0])
    felt = SensorInput(0.0, 0.004, here, north, ZERO, ZERO, ZERO, ZERO, around=around)
    rng = np.random.default_rng(0)
    found, _ = usbl.sense(felt, usbl.start(rng), rng, due=True)
    return found


def test_the_speed_of_sound_is_that_published() -> None:
    """Mackenzie's check value: 25 degC, 35 g/kg, 1000 m."""
    found = sound_speed(temperature=25.0, salinity=35.0, depth=1000.0)
    assert found == pytest.approx(1550.744, abs=5e-4)


def test_range_and_direction_are_those_of_the_geometry() -> None:
    """30 m east, 40 m north, 10 m down; the range errs with the speed that is assumed."""
    true = sound_speed(temperature=10.0, salinity=35.0, depth=15.0)
    found = reading(SensorUsbl(place=[30.0, 40.0, -20.0], assumed_speed=true, **EXACT))
    way = math.sqrt(2600.0)
    assert found["acoustic_range"][0] == pytest.approx(way, rel=1e-12)
    # north is ahead, so east is to the right
    assert found["acoustic_bearing"][0] == pytest.approx(-math.atan2(30.0, 40.0), rel=1e-12)
    assert found["acoustic_elevation"][0] == pytest.approx(-math.asin(10.0 / way), rel=1e-12)
    wrong = reading(SensorUsbl(place=[30.0, 40.0, -20.0], assumed_speed=1500.0, **EXACT))
    assert wrong["acoustic_range"][0] == pytest.approx(way * 1500.0 / true, rel=1e-12)


@pytest.mark.parametrize(
    ("values", "solids"),
    [
        ({"place": [30.0, 40.0, 5.0]}, {}),
        ({"place": [30.0, 40.0, -20.0], "farthest": 50.0}, {}),
        (
            {"place": [30.0, 40.0, -20.0]},
            {"rock": ObstacleSettings(size=[4.0, 4.0, 30.0], position=[15.0, 20.0, -15.0])},
        ),
    ],
)
def test_nothing_is_heard(values: Any, solids: Any) -> None:
    """Of a transponder in the air, too far away, or behind a rock: the flag is 0."""
    found = reading(SensorUsbl(**values), **solids)
    assert found.keys() == {"acoustic_valid"}
    assert found["acoustic_valid"][0] == 0.0


def test_an_unknown_object_is_refused() -> None:
    """The message names what is there."""
    with pytest.raises(ConfigError, match="not in the scene"):
        reading(SensorUsbl(target="buoyy"))
