"""Inertial readings of a simulated flight against the diagnosis' own model of the vehicle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs.native import read_native
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import describe_run
from seals.sysid.predictors.problem import prepare
from seals.sysid.scores.channels import restarted

FLIGHT = (
    "robot=hexacopter",
    "controller=cascade",
    "guide=waypoints",
    "guide.places=[[3,1,1.5],[0,0,1]]",
    "guide.speed=4",
    "initial.position=[0,0,1]",
    "time.step=0.004",
    "time.duration=4",
)


TURNED = ("sensors.imu.position=[0.2,-0.1,0.05]", "sensors.imu.rpy=[0.3,-0.2,0.5]")


@pytest.mark.parametrize("mounting", [(), TURNED])
def test_a_quick_flight_leaves_the_noise_of_its_sensors(
    tmp_path: Path, mounting: tuple[str, ...]
) -> None:
    """At steps of 4 ms; one step too late, an accelerometer would leave 2.1 times its noise.

    The gyroscope keeps what the step leaves of the angular acceleration, of second order: 2.9
    times its noise with the velocity at the end of a step. With a unit at the origin, and with one
    whose axes are turned on an arm.
    """
    folder = tmp_path / "run"
    assert main(["run", *FLIGHT, *mounting, f"hydra.run.dir={folder}"]) == 0
    problem = prepare(join_logs(read_native(folder)), robot=describe_run(folder))
    residual, _ = restarted(problem.fitter, {})
    for channel, most in (("specific_force", 1.15), ("angular_velocity", 2.5)):
        sigma = problem.vehicle.sigma[channel]
        axes = [i for i, c in enumerate(problem.fitter.windows.channel_of) if c == channel]
        levels = [float(np.sqrt(np.nanmean((residual[:, :, i] / sigma) ** 2))) for i in axes]
        print(f"{channel}: {np.round(levels, 3)} of the noise, {mounting}")
        assert max(levels) < most, channel
