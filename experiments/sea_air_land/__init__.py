"""Three media in one run: take-off from a beach, flight, dive, grasp and landing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seals.experiments.fetching import command_line, object_place, outcome_of, upright
from seals.experiments.trials import Outcome
from seals.logs import Log
from seals.run.simulation import Record

SLOPE, WATERLINE, LAND = 0.2, 2.0, 0.4
"""Of the beach, as in ``conf/experiment/sea_air_land.yaml`` [rad, m, m]."""
STAND = 0.178
"""Height of the body's origin above the ground on which it stands, along the normal [m]."""


def vary(seed: int) -> list[str]:
    """Return start and object of a seed: places on the beach, any heading of robot and cube."""
    rng = np.random.default_rng(seed)
    along, aside = rng.uniform(0.5, 1.3), rng.uniform(-0.5, 0.5)
    yaw, turn = rng.uniform(-math.pi, math.pi, 2)
    a, b = rng.uniform(-0.3, 0.3, 2)
    up = math.tan(SLOPE) * along
    place = (WATERLINE + along - STAND * math.sin(SLOPE), aside, up + STAND * math.cos(SLOPE))
    roll, pitch = standing(yaw)
    return [
        "initial.position=[{:.4f},{:.4f},{:.4f}]".format(*place),
        f"initial.rpy=[{roll:.5f},{pitch:.5f},{yaw:.5f}]",
        f"objects.cube.position=[{-4.0 + a:.4f},{b:.4f},-0.975]",
        f"objects.cube.rpy=[0,0,{turn:.4f}]",
    ]


def standing(yaw: float) -> tuple[float, float]:
    """Return roll and pitch of a robot that stands on the slope with a heading [rad].

    Example:
        >>> standing(0.0)[1]
        -0.2
    """
    sine, cosine = math.sin(SLOPE), math.cos(SLOPE)
    return -math.asin(sine * math.sin(yaw)), -math.atan2(sine * math.cos(yaw), cosine)


def judge(record: Record) -> Outcome:
    """Return whether the robot stands on the land with the cube in its hand."""

    def missed(log: Log) -> str:
        height = float(log.columns["position_z"][-1]) - LAND
        if not 0.1 < height < 0.3 or upright(log)[-1] < math.cos(math.radians(15.0)):
            return f"it does not stand on the land: {height:.2f} m above it"
        cube = object_place(log, "cube")[-1]
        place = np.array([log.columns[f"position_{a}"][-1] for a in "xyz"])
        far = float(np.linalg.norm(cube - place))
        return "" if far < 0.5 and cube[2] > LAND else f"the cube is {far:.1f} m away"

    return outcome_of(record, thing="cube", missed=missed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    return command_line("sea_air_land", vary, judge, arguments)
