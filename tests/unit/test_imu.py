"""The inertial unit in the world: rest, free fall, turning, rate, mounting."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.errors import ConfigError
from seals.run import build_world
from seals.run.build import run_settings
from seals.world import World

QUIET = [
    f"sensors.imu.{side}_{kind}=0"
    for side in ("accelerometer", "gyroscope")
    for kind in ("noise", "walk", "step")
]


def world_of(*options: str) -> World:
    """A ball with a quiet inertial unit."""
    return make(["robot=ball", *QUIET, *options])


def read(world: World, steps: int) -> list[dict[str, Any] | None]:
    """Advance and return what the unit reads, None where it reads nothing."""
    out = []
    for _ in range(steps):
        world.step()
        out.append(world.actors["robot"].readings["imu"])
    world.close()
    return out


def test_free_fall_reads_zero() -> None:
    """In vacuum a falling, turning unit feels nothing at its centre, and its own spin."""
    spin = "initial.angular_velocity=[1,2,3]"
    drag = [f"effects.air_drag.coefficient_{a}=0" for a in "xyz"]
    rows = read(world_of("initial.position=[0,0,20]", spin, *drag), 50)
    force = np.array([row["specific_force"] for row in rows if row])
    turning = np.array([row["angular_velocity"] for row in rows if row])
    assert len(force) == 50
    assert np.abs(force).max() < 1e-9
    np.testing.assert_allclose(turning, np.tile([1.0, 2.0, 3.0], (50, 1)), atol=1e-9)


def test_rest_on_the_ground_reads_g_upward() -> None:
    """A ball lying on the ground reads +g along world up, whatever its own axes."""
    lying = ["environment.ground_level=0", "initial.position=[0,0,0.05]", "initial.rpy=[0.5,0,0]"]
    rows = read(world_of(*lying), 300)
    force = np.mean([row["specific_force"] for row in rows[200:] if row], axis=0)
    expected = 9.81 * np.array([0.0, np.sin(0.5), np.cos(0.5)])
    np.testing.assert_allclose(force, expected, atol=0.02)


def test_a_mount_off_the_centre_feels_the_turning() -> None:
    """0.3 m along x on a body spinning at 4 rad/s about z reads -w^2 r along x."""
    spin = ["initial.position=[0,0,20]", "initial.angular_velocity=[0,0,4]"]
    drag = [f"effects.air_drag.coefficient_{a}=0" for a in "xyz"]
    rows = read(world_of(*spin, *drag, "sensors.imu.position=[0.3,0,0]"), 20)
    assert rows[10] is not None
    np.testing.assert_allclose(rows[10]["specific_force"], [-4.8, 0.0, 0.0], atol=1e-6)


@pytest.mark.parametrize(("rate", "count"), [(250.0, 250), (50.0, 50), (100.0, 100), (7.0, 7)])
def test_readings_come_at_the_rate(rate: float, count: int) -> None:
    """In one second come as many as the rate says, the first after one period."""
    world = world_of(f"sensors.imu.rate={rate}", "initial.position=[0,0,20]")
    assert world.actors["robot"].readings["imu"] is None
    assert sum(row is not None for row in read(world, 250)) == count


def test_one_seed_is_one_record() -> None:
    """With noise on, a seed gives the same record twice and another seed another one."""
    noisy = ["robot=ball", "initial.position=[0,0,20]"]

    def record(seed: int) -> np.ndarray:
        world = make([*noisy, f"seed={seed}"])
        return np.array([row["specific_force"] for row in read(world, 40) if row])

    np.testing.assert_array_equal(record(5), record(5))
    assert np.abs(record(5) - record(6)).max() > 1e-3


def test_the_unit_may_sit_on_a_moving_link() -> None:
    """On a swinging link it reads that link's angular velocity, base and joint together."""
    run = run_settings(
        [
            "robot=free_arm",
            *QUIET,
            "sensors.imu.link=upper",
            "initial.position=[0,0,20]",
            "initial.joint_velocity=[2,0]",
            "initial.angular_velocity=[0,0.5,0]",
        ]
    )
    world = build_world(run)
    world.step()
    first: Any = world.actors["robot"].readings["imu"]
    # one step of 4 ms later the swing has changed by about 4 ms times its acceleration
    body = world.actors["robot"].body.read()
    world.close()
    expected = body.angular_velocity[1] + body.joint_velocity[0]
    np.testing.assert_allclose(first["angular_velocity"][1], expected, atol=0.01)
    assert abs(expected - 2.5) < 0.1


def test_an_unknown_link_is_refused(pebble: Path) -> None:
    """A sensor on a link that does not exist is refused with the nearest name."""
    with (pebble / "robot.yaml").open("a", encoding="utf-8") as stream:
        stream.write("sensors:\n  imu: {sensor: imu, link: bse}\n")
    with pytest.raises(ConfigError, match="Did you mean 'base'"):
        make([f"robot={pebble}"])
