"""Pose estimate for a controller: true pose, or the last sensor estimate extrapolated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, suggestion
from seals.frames import exponential, matrix_of
from seals.state_records import state_record

TRUTH = "truth"
POSITION, ORIENTATION = "estimated_position", "estimated_orientation"
VELOCITY, SPIN = "estimated_velocity", "estimated_spin"
CHANNELS = (POSITION, ORIENTATION, VELOCITY, SPIN)
"""Channels of a sensor of pose: world, quaternion w x y z, body axes, body axes."""


@state_record
class Estimate(NamedTuple):
    """Pose and twist of the body at one time.

    Args:
        time: [s].
        position: world [m], shape (3,).
        rotation: R_WB, shape (3, 3).
        velocity: world axes [m/s], shape (3,).
        angular_velocity: body axes [rad/s], shape (3,).
    """

    time: float
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats


class Estimator:
    """Estimator that extrapolates the last estimate of a sensor in time.

    Args:
        sense: name of the sensor, or ``truth``.
    """

    def __init__(self, sense: str) -> None:
        self.sense = sense

    def update(
        self, time: float, fresh: Mapping[str, Mapping[str, Floats]], last: Estimate | None
    ) -> Estimate | None:
        """Return the estimate after the readings of ``time`` [s]."""
        reading = fresh.get(self.sense)
        if reading is None:
            return last
        w, x, y, z = reading[ORIENTATION]
        turn = matrix_of(np.array([[x, y, z, w]]))[0]
        return Estimate(time, reading[POSITION], turn, turn @ reading[VELOCITY], reading[SPIN])

    def now(self, time: float, truth: Estimate, last: Estimate | None) -> Estimate:
        """Return the estimate at ``time`` [s]: the truth until the first reading.

        Between readings it moves on with the velocities of the last one.
        """
        if self.sense == TRUTH or last is None:
            return truth
        span = time - last.time
        if span <= 0.0:
            return last
        # R exp(w t): exact for a spin that is steady in body axes
        turn = last.rotation @ matrix_of(exponential(span * last.angular_velocity[None]))[0]
        return Estimate(
            time, last.position + span * last.velocity, turn, last.velocity, last.angular_velocity
        )


def check_sense(sense: str, channels: Mapping[str, Mapping[str, int]]) -> None:
    """Refuse a sensor that does not exist or gives no pose.

    Args:
        sense: as a controller names it.
        channels: of every sensor of the robot, by sensor.

    Raises:
        ConfigError: there is no such sensor, or it reads something else.
    """
    if sense == TRUTH:
        return
    able = [name for name, there in channels.items() if set(CHANNELS) <= set(there)]
    if sense not in able:
        raise ConfigError(
            f"controller.sense={sense}: the robot has no such sensor of pose and velocity.\n"
            f"{suggestion(sense, [TRUTH, *able])}  To add one: +sensor@sensors.odometry=odometry"
        )
