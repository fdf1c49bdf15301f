"""Numbers of a diagnosis from which ``seals add`` fits its effects again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.sysid.candidates.activity import ACTIVE, Activity
from seals.sysid.candidates.vehicle import candidate_set_of
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.validation.answer_form import refuse_damaged
from seals.sysid.validation.refit import stated

META: dict[str, Any] = {"environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None}}
EFFECT: dict[str, Any] = {
    "name": "payload",
    "link": "body",
    "parameters": {"mass": {"value": 0.31}},
    "nuisance": {"position_x": 0.12, "position_z": -0.12},
}


def test_a_fit_starts_where_the_load_was_found() -> None:
    """A load above and one below are two minima; from the centre the wrong one may be met."""
    vehicle = read_vehicle(META, describe_robot("hexacopter"))
    candidate_set = candidate_set_of(vehicle, speeds=np.ones(3))
    load = next(c for c in candidate_set.candidates if c.label == "payload (link 0)")
    centre = vehicle.robot.centre[0]
    for one in (load, load.acting(Activity(spans=()))):
        found = stated(one, EFFECT, candidate_set)
        by_name = {k.partition(".")[2].removesuffix(ACTIVE): v for k, v in found.items()}
        # changes against the instance of the model, which sits at the centre of mass
        assert by_name == pytest.approx(
            {"mass": 0.31, "position_x": 0.12 - centre[0], "position_z": -0.12 - centre[2]}
        )
        assert set(found) <= set(one.all_keys)


@pytest.mark.parametrize("damaged", [3, {"position_x": "far"}, {"position_x": None}])
def test_damaged_numbers_are_refused(damaged: Any) -> None:
    """As those of the effect itself are."""
    with pytest.raises(ValueError, match=r"effects\[0\]\.nuisance"):
        refuse_damaged({"verdict": "named", "effects": [EFFECT | {"nuisance": damaged}]})
