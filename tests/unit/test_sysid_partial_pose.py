"""A pose of which a component was not measured: the depth stands for the height."""

from __future__ import annotations

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.samples import read_samples
from seals.sysid.data.trajectory import measured_trajectory
from seals.sysid.data.vehicle import read_vehicle

CHANNELS = ("position", "orientation", "velocity", "angular_velocity", "depth")
META = {
    "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": 0.5},
    "sensors": {"channels": {name: {"sigma": 0.01} for name in CHANNELS}},
    "tolerance": {},
}
VEHICLE = read_vehicle(META, describe_robot("ball"))


def dive(*left_out: str) -> Log:
    """Two seconds at 50 Hz: 0.3 m/s ahead, 0.2 m/s down from 1 m below the water's level."""
    t = np.arange(100) / 50.0
    columns = {
        "t": t,
        "position_x": 0.3 * t,
        "position_y": 0.0 * t,
        "depth": 1.0 + 0.2 * t,
        "orientation_w": np.ones(100),
        **{f"orientation_{axis}": np.zeros(100) for axis in "xyz"},
        **{f"angular_velocity_{axis}": np.zeros(100) for axis in "xyz"},
        **{f"specific_force_{axis}": np.zeros(100) for axis in "xyz"},
    }
    kept = {name: values for name, values in columns.items() if name not in left_out}
    return Log(name="dive", columns=kept, meta={})


def test_the_depth_stands_for_a_height_that_was_not_measured() -> None:
    """An underwater vehicle with a range sensor in the plane and a pressure gauge."""
    log = dive()
    states = measured_trajectory(read_samples(log, VEHICLE), VEHICLE)
    np.testing.assert_allclose(states.position[:, 2], -0.5 - 0.2 * log.time, atol=1e-9)
    np.testing.assert_allclose(states.velocity, np.tile([0.3, 0.0, -0.2], (100, 1)), atol=1e-9)


def test_a_doppler_log_of_two_axes_leaves_the_third_to_the_depth() -> None:
    """Velocity along x and y, measured, and along z by the depth; rates by the attitude."""
    log = dive("angular_velocity_z").with_columns(
        {"velocity_x": np.full(100, 0.3), "velocity_y": np.zeros(100)}
    )
    states = measured_trajectory(read_samples(log, VEHICLE), VEHICLE)
    np.testing.assert_allclose(states.velocity, np.tile([0.3, 0.0, -0.2], (100, 1)), atol=1e-9)
    np.testing.assert_allclose(states.angular_velocity, 0.0, atol=1e-9)


def test_every_component_may_miss_rows_of_its_own() -> None:
    """A cell without a sample in each component at other rows leaves no gap in the motion."""
    log = dive("depth")
    time, columns = log.time, {"position_z": -0.5 - 0.2 * log.time}
    names = [n for n in log.columns if n[:3] in ("pos", "ori", "ang")] + ["position_z"]
    for k, name in enumerate(names):
        values = np.array(columns.get(name, log.columns.get(name)), dtype=float)
        values[k :: len(names) + 1] = np.nan
        columns[name] = values
    samples = read_samples(log.with_columns(columns), VEHICLE)
    turned = np.isfinite(samples.channels["orientation"])
    assert (turned == turned[:, :1]).all()
    assert not turned.all()
    states = measured_trajectory(samples, VEHICLE)
    place = np.column_stack([0.3 * time, 0.0 * time, -0.5 - 0.2 * time])
    np.testing.assert_allclose(states.position, place, atol=1e-9)
    np.testing.assert_allclose(states.velocity, np.tile([0.3, 0.0, -0.2], (100, 1)), atol=1e-9)
    np.testing.assert_allclose(states.quaternion, np.tile([0, 0, 0, 1.0], (100, 1)), atol=1e-9)
    np.testing.assert_allclose(states.angular_velocity, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["position_x", "depth"])
def test_a_place_without_samples_is_refused_by_name(name: str) -> None:
    """It ended in an answer with a misfit of nan."""
    with pytest.raises(LogError, match=name.replace("depth", "position_z")):
        read_samples(dive(name), VEHICLE)
