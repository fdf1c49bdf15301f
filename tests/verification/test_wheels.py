"""Driven wheels: rolling, motor curve, Coulomb friction, turning and floating by closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from seals.errors import ConfigError
from seals.plugins.actuators.wheels import Wheels
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.simulation import simulate

Floats = NDArray[np.float64]
ENGINES = ["mujoco", pytest.param("pybullet", marks=pytest.mark.thorough)]
ONE = ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)]
G, RADIUS, WIDTH, MASS, WHEEL = 9.81, 0.1, 0.04, 8.0, 0.5
STALL, NO_LOAD, ARMATURE = 1.0, 20.0, 0.01
SPIN = 0.5 * WHEEL * RADIUS**2
"""Moment of inertia of a wheel about its axle [kg m^2]."""
TOTAL = MASS + 4 * WHEEL


def cart(folder: Path, *, grip: float, gain: float = 10.0, **motor: float) -> Path:
    """Write a cart with a heavy flat body and four driven wheels; return its folder."""
    across, turn = WHEEL * (3 * RADIUS**2 + WIDTH**2) / 12, 0.5 * math.pi
    cylinder = f'<cylinder radius="{RADIUS}" length="{WIDTH}"/>'
    links, joints = "", ""
    for k, (x, y) in enumerate([(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)]):
        links += (
            f'<link name="wheel_{k}"><inertial><mass value="{WHEEL}"/><inertia ixx="{across}" '
            f'ixy="0" ixz="0" iyy="{SPIN}" iyz="0" izz="{across}"/></inertial><collision><origin '
            f'rpy="{turn} 0 0"/><geometry>{cylinder}</geometry></collision>'
            f'<contact><lateral_friction value="{grip}"/></contact></link>'
        )
        joints += (
            f'<joint name="axle_{k}" type="continuous"><parent link="body"/><child '
            f'link="wheel_{k}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
        )
    (folder / "cart.urdf").write_text(
        f'<robot name="cart"><link name="body"><inertial><origin xyz="0 0 -0.05"/><mass '
        f'value="{MASS}"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.3" iyz="0" izz="0.4"/>'
        f"</inertial></link>{links}{joints}</robot>"
    )
    wheels = {
        **{"actuator": "wheels", "wheels": [1, 2, 3, 4], "stall_torque": STALL},
        **{"no_load_speed": NO_LOAD, "armature": ARMATURE, "gain": gain, "radius": RADIUS, **motor},
    }
    robot: dict[str, Any] = {"urdf": "cart.urdf", "actuators": {"wheels": wheels}}
    (folder / "robot.yaml").write_text(yaml.safe_dump(robot))
    return folder


def driven(
    robot: str | Path, engine: str, speeds: list[float], seconds: float, *words: str
) -> list[tuple[float, Any]]:
    """Return times and states of a robot whose wheels are told constant speeds."""
    run = run_settings([f"robot={robot}", f"backend={engine}", *words])
    world = build_world(run)
    actor, found = world.actors["robot"], []
    for k in range(round(seconds / run.time.step)):
        actor.joint_command = np.array([speeds])
        world.step()
        found.append(((k + 1) * run.time.step, actor.body.read()))
    world.close()
    return found


LEVEL = ("environment.ground_level=0", "environment.friction=1")


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wheel_rolls_without_slipping(tmp_path: Path, engine: str) -> None:
    """At a constant speed v = w R, and the way is v t."""
    robot = cart(tmp_path, grip=0.8)
    states = driven(robot, engine, [8.0] * 4, 2.5, *LEVEL, f"initial.position=[0,0,{RADIUS}]")
    (t0, a), (t1, b) = states[-250], states[-1]
    assert b.velocity[0] == pytest.approx(8.0 * RADIUS, rel=1e-3)
    assert (b.position[0] - a.position[0]) / (t1 - t0) == pytest.approx(8.0 * RADIUS, rel=1e-3)
    assert abs(b.position[1]) < 2e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_full_throttle_follows_the_torque_speed_line(tmp_path: Path, engine: str) -> None:
    """V = R w_0 (1 - exp(-t / T)), T = (m R^2 + n (I + J)) w_0 / (n tau_s)."""
    robot = cart(tmp_path, grip=0.9)
    states = driven(
        robot, engine, [60.0] * 4, 3.0, *LEVEL, f"initial.position=[0,0,{RADIUS}]",
        "time.step=0.002",
    )  # fmt: skip
    lasts = (TOTAL * RADIUS**2 + 4 * (SPIN + ARMATURE)) * NO_LOAD / (4 * STALL)
    times = np.array([t for t, _ in states])
    speed = np.array([s.velocity[0] for _, s in states])
    expected = RADIUS * NO_LOAD * (1.0 - np.exp(-times / lasts))
    assert np.abs(speed - expected).max() < 0.02 * RADIUS * NO_LOAD


@pytest.mark.parametrize("engine", ENGINES)
def test_locked_wheels_stop_by_friction(tmp_path: Path, engine: str) -> None:
    """The way is v^2 / (2 mu g)."""
    robot, speed, grip = cart(tmp_path, grip=0.5), 1.5, 0.5
    states = driven(
        robot, engine, [0.0] * 4, 0.6, *LEVEL, f"initial.position=[0,0,{RADIUS}]",
        f"initial.velocity=[{speed},0,0]",
    )  # fmt: skip
    last = states[-1][1]
    assert np.abs(last.velocity).max() < 1e-3
    # the wheels come from standstill against the body, which they lock in the first step
    assert last.position[0] == pytest.approx(speed**2 / (2 * grip * G), rel=0.03)


def on_a_slope(angle: float, grip: float) -> tuple[str, ...]:
    """Words of a run on a tilted slab through the origin, with the cart standing on it."""
    across, up = math.sin(angle), math.cos(angle)
    slab = f"{{type: box, size: [40, 4, 1], position: [{0.5 * across}, 0, {-0.5 * up}], "
    slab += f"rpy: [0, {-angle}, 0], friction: {grip}}}"
    place = [-RADIUS * across, 0.0, RADIUS * up]
    return (
        f"+environment.obstacles.slab={slab}",
        f"initial.position={place}".replace(" ", ""),
        f"initial.rpy=[0,{-angle},0]",
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_slope_is_held_and_climbed_up_to_the_angle_of_friction(
    tmp_path: Path, engine: str
) -> None:
    """Coulomb: held below tan(angle) = mu; above it slides by g (sin - mu cos), also when driven.

    Four driven wheels climb what they hold; where they spin, they push with mu N and lose.
    """
    robot, angle = cart(tmp_path, grip=1.0, torque_limit=50.0, stall_torque=50.0), 0.4
    edge = math.tan(angle)
    # a speed loop without an integral gives way by the torque over its gain
    droop = TOTAL * G * math.sin(angle) * RADIUS / (4 * 10.0)
    holds = driven(robot, engine, [0.0] * 4, 1.0, *on_a_slope(angle, 1.1 * edge))
    assert -holds[-1][1].velocity[0] / math.cos(angle) == pytest.approx(droop * RADIUS, rel=0.05)
    slips = driven(robot, engine, [0.0] * 4, 1.0, *on_a_slope(angle, 0.7 * edge))
    down = -slips[-1][1].velocity[0] / math.cos(angle)
    expected = G * (math.sin(angle) - 0.7 * edge * math.cos(angle))
    assert down == pytest.approx(expected, rel=0.03)
    climbs = driven(robot, engine, [5.0] * 4, 1.5, *on_a_slope(angle, 1.15 * edge))
    assert climbs[-1][1].velocity[0] / math.cos(angle) == pytest.approx(
        (5.0 - droop) * RADIUS, rel=0.01
    )
    spins = driven(robot, engine, [5.0] * 4, 1.0, *on_a_slope(angle, 0.9 * edge))
    lost = G * (math.sin(angle) - 0.9 * edge * math.cos(angle))
    assert -spins[-1][1].velocity[0] / math.cos(angle) == pytest.approx(lost, rel=0.06)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("left", "right"), [(-3.0, 3.0), (2.0, 4.0)])
def test_two_wheels_turn_at_the_rate_of_a_differential_drive(
    engine: str, left: float, right: float
) -> None:
    """Rates are r = R (w_r - w_l) / B, u = R (w_r + w_l) / 2, by the wheels' own mean speeds."""
    states = driven(
        "rover", engine, [left, right], 4.0, *LEVEL, "initial.position=[0,0,0.033]"
    )[500:]  # fmt: skip
    wheels = np.mean([s.joint_velocity for _, s in states], axis=0)
    rate = np.mean([s.angular_velocity[2] for _, s in states])
    speed = np.mean([np.hypot(*s.velocity[:2]) for _, s in states])
    radius, apart = 0.033, 0.16
    # treads 4 mm wide grip somewhere between their edges
    assert rate == pytest.approx(radius * (wheels[1] - wheels[0]) / apart, rel=0.025)
    assert wheels.tolist() == pytest.approx([left, right], rel=0.03)
    if left > 0.0:
        assert speed == pytest.approx(radius * wheels.mean(), rel=0.02)


def afloat(mass: float, density: float) -> float:
    """Return the height of the amphibian's origin above calm water by Archimedes' law [m]."""

    def displaced(level: float) -> float:
        hull = 0.9 * 0.44 * min(max(level + 0.12, 0.0), 0.24)
        depth = min(max(level + 0.1 + 0.14, 0.0), 0.28)
        half = math.acos(1.0 - depth / 0.14)
        segment = 0.14**2 * (half - math.sin(half) * math.cos(half))
        return hull + 4 * 0.08 * segment

    low, high = -0.24, 0.12
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if density * displaced(middle) < mass else (low, middle)
    return -0.5 * (low + high)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_amphibian_floats_at_the_draught_of_archimedes(engine: str) -> None:
    """Hull and wheels, each cut in closed form, displace its 40 kg."""
    words = ("water=fossen", "initial.position=[0,0,0.1]", "environment.water_density=1000")
    last = driven("amphibian", engine, [0.0] * 4, 12.0, *words)[-1][1]
    assert last.position[2] == pytest.approx(afloat(40.0, 1000.0), abs=2e-4)
    assert np.abs(last.velocity).max() < 1e-3


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ONE)
def test_it_drives_into_the_water_swims_and_drives_ashore(engine: str) -> None:
    """It floats at its draught in between, and stands on its wheels on the beach at the end."""
    record = simulate(run_settings(["experiment=amphibian_crossing", f"backend={engine}"]))
    assert record.error is None
    log = record.log
    place, wet = log.channel("position"), log.channel("position")[:, 0] < -3.0
    assert np.abs(place[wet, 2] - afloat(40.0, 998.2)).max() < 0.01
    assert place[:, 0].min() < -5.5
    assert place[-1, 0] > 6.0
    # level land at 0.5 m, axles 0.1 m below the origin, wheels of 0.14 m
    assert place[-1, 2] == pytest.approx(0.74, abs=2e-3)
    assert np.abs(place[-500:, 1] - 3.0).max() < 0.15


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ONE)
def test_a_rover_follows_a_square(engine: str) -> None:
    """It passes each corner within 6 cm, and the legs' middles within 2 cm."""
    record = simulate(run_settings(["experiment=rover_course", f"backend={engine}"]))
    assert record.error is None
    place = record.log.channel("position")
    for corner in ([1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]):
        assert np.linalg.norm(place[:, :2] - corner, axis=1).min() < 0.06
    middle = (place[:, 0] > 0.35) & (place[:, 0] < 0.65)
    off = np.minimum(np.abs(place[middle, 1]), np.abs(place[middle, 1] - 1.0))
    assert off.max() < 0.02


def test_strange_wheels_are_refused() -> None:
    """What is no list of joints, a joint that is not there, and robots without wheels."""
    for wheels in ([], [0], [1, 1], [-1], [True]):
        with pytest.raises(ConfigError, match="counted from 1, each once"):
            Wheels(wheels=wheels)
    with pytest.raises(ConfigError, match="the robot has 2 joints"):
        Wheels(wheels=[3]).of_joints("kd", 2)
    with pytest.raises(ConfigError, match="no wheels of robot 'boat' are driven"):
        build_world(run_settings([
            "robot=boat", "water=fossen", "controller=skid_steer", "guide=los",
        ]))  # fmt: skip
