"""Loads that a diagnosis may add: on the base near it, on arms about their tips."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.vehicle import read_vehicle
from tests.unit.test_diagnose_along import described


def test_a_load_on_the_base_is_near_it() -> None:
    """Far off, a gram would pass for any change of centre of gravity and inertia."""
    vehicle = read_vehicle(described(None))
    base = vehicle.robot.links[0]
    known = candidate_set_of(vehicle, speeds=np.ones(3)).parameters
    turning, mass = vehicle.robot.inertia[0], float(vehicle.robot.mass[0])
    second = 0.5 * turning.trace() - turning.diagonal()
    reach = 4.0 * math.sqrt(float(second.max()) / mass)
    for axis in "xyz":
        assert known[f"payload_{base}.position_{axis}"].bounds == pytest.approx((-reach, reach))
    assert known["payload_second.position_z"].bounds == (-math.inf, math.inf)
