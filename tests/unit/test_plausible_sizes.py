"""Every number of a candidate has a plausible size, also beside effects that are stated as zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seals.logs import read_native
from seals.logs.shipped import find_log
from seals.sysid.candidates.catalogue import candidate_set_of, installed
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.vehicle import read_vehicle

META = read_native(find_log("hidden_effect/flight_a")).meta
PLACES = {
    "air": (META, None),
    "water": (
        META | {"environment": {"gravity": [0.0, 0.0, -9.81], "water_level": 0.0}, "baseline": []},
        "auv",
    ),
}


@pytest.mark.parametrize("where", PLACES)
def test_a_stated_zero_leaves_a_plausible_size(where: str) -> None:
    """A scale of zero ends in 0/0: each law in turn is stated with its defaults."""
    meta, robot = PLACES[where]
    vehicle = read_vehicle(meta, None if robot is None else describe_robot(robot))
    without: dict[str, list[str]] = {}
    for name, law in installed().items():
        stated = replace(vehicle, effects={**vehicle.effects, f"{name}_stated": law()})
        found = candidate_set_of(stated, speeds=np.zeros(3))
        without[name] = [k for k, p in found.parameters.items() if not p.scale > 0.0]
    assert len(without) > 20
    assert {name: keys for name, keys in without.items() if keys} == {}
