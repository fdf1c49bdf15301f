"""The generator of hidden-effect logs: it stands alone, obeys mechanics and writes what it says."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

HERE = Path(__file__).parent
from tests.validation.hidden import (  # noqa: E402
    cases,
    equivalents,
    fly,
    forces,
    gain,
    generate,
    hull,
    links,
    plant,
    references,
    rotation,
    surroundings,
    vehicles,
)
from tests.validation.hidden.arm import ArmBody, pose  # noqa: E402
from tests.validation.hidden.batch import Flight  # noqa: E402
from tests.validation.hidden.body import HEAD, Body  # noqa: E402
from tests.validation.hidden.cases import Spec, build  # noqa: E402

ALLOWED = {"numpy", "scipy", "pandas", "pyarrow", "yaml", "pytest"} | set(sys.stdlib_module_names)
# writers of the formats of recordings
ALLOWED |= {"mcap", "rosbags"}
STEP = 1e-3


def _bare(vehicle: vehicles.Vehicle, **changes: Any) -> plant.Plant:
    """An exact plant of one vehicle without gusts, stacked."""
    made = plant.draw(vehicle, np.random.default_rng(0), exact=True)
    made |= {k: np.asarray(v, dtype=float) for k, v in changes.items()}
    return plant.stack([made])


def _coast(body: Any, state: rotation.Array, count: int, command: rotation.Array) -> rotation.Array:
    seen = np.zeros((10, body.size))
    for k in range(count):
        state = fly.stepped(body, state, command, np.full(body.size, k * STEP), STEP, seen)
    return state


def _at(*values: float) -> rotation.Array:
    return np.array(values, dtype=float)[:, None]


def test_no_module_imports_the_package() -> None:
    """Every import of every module is the standard library, numpy's family or this folder."""
    for path in sorted(HERE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [a.name for a in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
                names = [node.module or ""]
            for name in names:
                own = name.startswith("tests.validation.hidden")
                assert own or name.split(".")[0] in ALLOWED, f"{path.name} imports {name}"


def test_free_fall_is_a_parabola() -> None:
    """Without drag a body falls g t^2 / 2 and its accelerometer reads nothing."""
    vehicle = vehicles.quad(np.random.default_rng(1))
    vehicle.air_linear = vehicle.air_quadratic = vehicle.angular_linear = np.zeros(3)
    body = Body(_bare(vehicle), rotor=True, ground=None, water=False)
    start = body.still(_at(0, 0, 2), _at(1, 0, 0, 0), _at(1, 0, 0), _at(0, 0, 0), np.zeros((4, 1)))
    end = _coast(body, start, 400, np.zeros((4, 1)))
    assert end[:3, 0] == pytest.approx([0.4, 0.0, 2.0 - 0.5 * 9.81 * 0.4**2], abs=1e-9)


def test_rotors_at_hover_speed_hold_a_quad() -> None:
    """Thrust equal to the weight keeps a level quadrotor where it is."""
    vehicle = vehicles.quad(np.random.default_rng(2))
    body = Body(_bare(vehicle, discharge=0.0), rotor=True, ground=0.0, water=False)
    speed = np.full((4, 1), np.sqrt(vehicle.mass * 9.81 / 4 / vehicle.thrust))
    start = body.still(_at(0, 0, 1), _at(1, 0, 0, 0), _at(0, 0, 0), _at(0, 0, 0), speed)
    end = _coast(body, start, 1000, speed)
    assert end[:3, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-4)


def test_torque_free_body_keeps_momentum_and_energy() -> None:
    """A tumbling body in still air keeps its angular momentum in the world and its energy."""
    vehicle = vehicles.quad(np.random.default_rng(3))
    vehicle.air_linear = vehicle.air_quadratic = vehicle.angular_linear = np.zeros(3)
    body = Body(_bare(vehicle, gravity=0.0), rotor=True, ground=None, water=False)
    spin = _at(3.0, -2.0, 4.0)
    start = body.still(_at(0, 0, 0), _at(1, 0, 0, 0), _at(0, 0, 0), spin, np.zeros((4, 1)))
    end = _coast(body, start, 2000, np.zeros((4, 1)))
    before = (rotation.matrix(start[3:7]) * start[10:13]).sum(1)
    after = (rotation.matrix(end[3:7]) * end[10:13]).sum(1)
    assert after == pytest.approx(before, rel=1e-4)
    m = body.motion(end, np.zeros(1))[0]
    energy = (vehicle.inertia[:, None] * m.spin**2).sum()
    assert energy == pytest.approx((vehicle.inertia[:, None] * spin**2).sum(), rel=1e-4)


def test_added_mass_slows_the_first_move_of_a_neutral_body() -> None:
    """A pull on a submerged neutral body gives force over mass plus added mass."""
    vehicle = vehicles.auv(np.random.default_rng(4))
    vehicle.volume = vehicle.mass / vehicles.WATER
    for key in ("water_quadratic", "angular_linear", "angular_quadratic", "centre_of_buoyancy"):
        setattr(vehicle, key, np.zeros(3))
    body = Body(_bare(vehicle), rotor=False, ground=None, water=True)
    act = _at(1, 1, 1, 1, 0, 0)
    start = body.still(_at(0, 0, -3), _at(1, 0, 0, 0), _at(0, 0, 0), _at(0, 0, 0), act)
    end = _coast(body, start, 10, act)
    speed = body.motion(end, np.zeros(1))[0].velocity[0, 0]
    expected = 4 * 0.707107 / (vehicle.mass + vehicle.added[0]) * 0.01
    assert speed == pytest.approx(expected, rel=1e-6)


def test_constant_current_carries_a_neutral_body_without_force() -> None:
    """A body that drifts with the current feels nothing of it, also while it turns."""
    vehicle = vehicles.auv(np.random.default_rng(5))
    vehicle.volume = vehicle.mass / vehicles.WATER
    vehicle.centre_of_buoyancy = np.zeros(3)
    vehicle.angular_linear = vehicle.angular_quadratic = np.zeros(3)
    stream = np.array([0.3, -0.2, 0.0])
    body = Body(_bare(vehicle, current=stream), rotor=False, ground=None, water=True)
    start = body.still(
        _at(0, 0, -3), _at(1, 0, 0, 0), stream[:, None], _at(0.0, 0.0, 0.5), np.zeros((6, 1))
    )
    end = _coast(body, start, 1000, np.zeros((6, 1)))
    drifted = body.motion(end, np.zeros(1))[0].world_velocity[:, 0]
    assert drifted == pytest.approx(stream, abs=1e-7)  # the midpoint rule's own error is 3e-9


def test_floating_box_sinks_to_archimedes_draught() -> None:
    """A box half as dense as water is half submerged at its equilibrium, by its cells."""
    parts = [{"type": "box", "position": [0, 0, 0], "rpy": [0, 0, 0], "size": [0.2, 0.2, 0.1]}]
    place, share = hull.cells(parts)
    up = place[2][:, None] + np.array([0.0, 0.025, 0.06])
    wet, _, _ = hull.submerged(
        place[..., None], share[:, None], up, surface=np.zeros_like(up), thick=0.0125
    )
    assert wet == pytest.approx([0.5, 0.25, 0.0], abs=0.01)


def test_arm_chain_keeps_momentum_and_energy() -> None:
    """A limp arm on a free base keeps energy, momentum and angular momentum."""
    vehicle = links.aam(np.random.default_rng(6))
    vehicle.air_linear = vehicle.air_quadratic = vehicle.angular_linear = np.zeros(3)
    loose: dict[str, Any] = dict.fromkeys(("servo_stiff", "servo_damp", "gravity"), 0.0)
    loose |= {"armature": 1e-9, "payload_mass": 0.1, "payload_place": [0.01, 0.02, -0.08]}
    body = ArmBody(_bare(vehicle, **loose), rotor=True, ground=None, water=False)
    state = body.still(
        _at(0, 0, 0), _at(1, 0, 0, 0), _at(0.3, 0.1, -0.2), _at(0.8, -1, 0.6), np.zeros((4, 1))
    )
    state[body.joint_rows] = _at(0.3, -0.9, 0.4)
    state[body.rate_rows] = _at(2.0, -3.0, 1.0)
    before = _invariants(body, state)
    after = _invariants(body, _coast(body, state, 800, np.zeros((7, 1))))
    assert after == pytest.approx(before, rel=2e-5, abs=1e-7)


def _invariants(body: ArmBody, state: rotation.Array) -> rotation.Array:
    m = body.motion(state, np.zeros(1))[0]
    mass = body._chain(state, m)[0][0]
    rates = np.concatenate((state[7:13], state[body.rate_rows]))[:, 0]
    momentum, turn = mass @ rates, m.turn[..., 0]
    line = turn @ momentum[:3]
    spin = turn @ momentum[3:6] + np.cross(state[:3, 0], line)
    return np.concatenate(([0.5 * rates @ momentum], line, spin))


def test_stowed_arm_balances_about_the_origin() -> None:
    """Base and stowed links together have their centre of gravity at the origin."""
    vehicle = links.aam(np.random.default_rng(7))
    arm = vehicle.arm
    where = pose(arm.as_plant(1), links.STOWED[:, None])
    total = arm.base_mass * arm.base_centre
    for i in range(3):
        total = total + arm.masses[i] * where.centres[i][:, 0]
    assert total / vehicle.mass == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


def test_wave_orbits_fade_with_depth_and_match_the_surface() -> None:
    """At the surface the water rises as the elevation does; at half a wave length it is calm."""
    wave = np.array([0.05, 1.2, 0.7, 0.4, 0.0])[:, None]
    numbers = {"wave": wave, "gravity": np.array([9.81]), "ripple": np.zeros((5, 3, 1))}
    spot, t, dt = _at(0.3, -0.2, 0.0), np.array([0.8]), 1e-5
    number = (2 * np.pi / 1.2) ** 2 / 9.81
    rise = [surroundings.elevation(numbers, spot[:1], spot[1:2], t + s * dt) for s in (-1, 1)]
    up = surroundings.orbital(numbers, spot, t)[0][2]
    second = 0.5 * number * 0.05**2 * 2 * 2 * np.pi / 1.2
    assert up == pytest.approx((rise[1] - rise[0])[0] / (2 * dt), abs=second * 1.01)
    deep = surroundings.orbital(numbers, spot - _at(0, 0, np.pi / number), t)[0]
    assert np.abs(deep).max() < 0.05 * 0.05 * 2 * np.pi / 1.2


def test_drag_spread_along_the_hull_brakes_rotation() -> None:
    """In pure rotation the hidden drag gives no force but a torque against the spin."""
    vehicle = vehicles.auv(np.random.default_rng(8))
    numbers = _bare(vehicle, hidden_linear=[10.0, 10.0, 10.0], hidden_first=1.0)
    body = Body(numbers, rotor=False, ground=None, water=True)
    start = body.still(_at(0, 0, -3), _at(1, 0, 0, 0), _at(0, 0, 0), _at(0, 0, 1), np.zeros((6, 1)))
    force, torque = forces.spread_drag(numbers, body.motion(start, np.zeros(1))[0])
    assert np.abs(force).max() < 1e-9
    assert torque[2, 0] < -0.01


def test_reference_rates_are_derivatives() -> None:
    """Rate and second rate of a reference agree with differences of its place."""
    wanted = references.draw("quad", "sines", np.random.default_rng(9), 18.0)
    batch = {k: v[..., None] for k, v in wanted.items()}
    h = 1e-4
    for t in (0.7, 5.3, 11.9):
        low, middle, high = (references.at(batch, t + s * h)[0] for s in (-1, 0, 1))
        _, speed, accel = references.at(batch, t)
        assert speed == pytest.approx((high - low) / (2 * h), abs=1e-5)
        assert accel == pytest.approx((high - 2 * middle + low) / h**2, abs=1e-3)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Logs of three seconds, so that a test takes few."""
    for kind in cases.SECONDS:
        monkeypatch.setitem(cases.SECONDS, kind, 3.0)


@pytest.mark.usefixtures("short")
def test_equivalent_drag_reproduces_the_force() -> None:
    """The stated coefficient is near the drawn one, within the spread of the laws."""
    spec = Spec("quad", "clear", "sines", ["quadratic_drag"], (1, 2, 3))
    flight = Flight([build(spec)], 4)
    drawn = build(spec).hidden[0].values
    equivalents.settle(flight, stride=20)
    for key, value in flight.cases[0].hidden[0].values.items():
        assert value != drawn[key]
        assert value == pytest.approx(drawn[key], rel=0.2)


@pytest.mark.thorough
@pytest.mark.usefixtures("short")
def test_gain_grows_with_the_square_of_the_effect() -> None:
    """Half the gyroscope bias is worth a quarter, at most the square of its tolerances."""
    found = []
    for size in (1.0, 0.5):
        spec = Spec("quad", "clear", "sines", ["gyroscope_bias"], (1, 2, 3), size=size)
        flight = Flight([build(spec)], 4)
        found.append(gain.measure(flight, 0)["gain_after_tolerances"])
        bias = np.array(list(flight.cases[0].hidden[0].values.values()))
        assert found[-1] <= ((bias / 0.003) ** 2).sum() * 1.001
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.02)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same two cases made twice, in two folders."""
    out = []
    usual = dict(cases.SECONDS)
    cases.SECONDS["auv"] = 3.0
    for name in ("one", "two"):
        folder = tmp_path_factory.mktemp(name)
        specs = generate.plan(2, 5, level="clear", vehicle="auv", effect="quadratic_drag")
        generate.produce(specs, folder, 5, gains=False)
        out.append(folder)
    cases.SECONDS.update(usual)
    return out[0], out[1]


@pytest.mark.thorough
def test_same_seed_gives_the_same_files(made: tuple[Path, Path]) -> None:
    """Two runs with one seed write the same tables and texts."""
    import pandas as pd

    for path in sorted(made[0].glob("*/*.yaml")):
        assert path.read_text() == (made[1] / path.relative_to(made[0])).read_text()
    for path in sorted(made[0].glob("*/log.parquet")):
        twin = pd.read_parquet(made[1] / path.relative_to(made[0]))
        pd.testing.assert_frame_equal(pd.read_parquet(path), twin)


def test_log_has_the_columns_of_the_format(made: tuple[Path, Path]) -> None:
    """Table, description and truth hold what the format asks for."""
    import pandas as pd

    folder = sorted(made[0].glob("*"))[0]
    table = pd.read_parquet(folder / "log.parquet")
    meta = yaml.safe_load((folder / "meta.yaml").read_text())
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    wanted = ["t", *(f"thruster_cmd_{i}" for i in range(1, 7)), "depth", "battery_voltage"]
    for stem, letters in (
        ("position", "xyz"),
        ("orientation", "wxyz"),
        ("velocity", "xyz"),
        ("angular_velocity", "xyz"),
        ("specific_force", "xyz"),
    ):
        wanted += [f"{stem}_{a}" for a in letters]
    assert sorted(table.columns) == sorted(wanted)
    assert table["t"].dtype == np.float64
    assert (np.diff(table["t"]) > 0.0).all()
    assert table["position_x"].notna().mean() == pytest.approx(0.2, abs=0.02)
    turns = table[[f"orientation_{a}" for a in "wxyz"]].dropna().to_numpy(dtype=float)
    assert np.abs((turns**2).sum(1) - 1.0).max() < 1e-4
    assert meta["format"] == "hidden-effect-log"
    assert meta["format_version"] == 1
    for key in ("vehicle", "environment", "baseline", "sensors", "tolerance", "disturbance"):
        assert meta[key]
    assert set(meta["vehicle"]) >= {"mass", "inertia", "rotors", "thrusters", "hull", "arm"}
    _check_truth(truth)


def _check_truth(truth: dict[str, Any]) -> None:
    assert truth["level"] == "clear"
    assert truth["expected_verdict"] == "named"
    assert truth["in_library"] is True
    assert truth["detectability"]["excess_max"] >= 5.0
    (effect,) = truth["effects"]
    for entry in effect["parameters"].values():
        assert set(entry) == {"value", "unit"}
    for group in effect["scored_groups"]:
        assert set(group) <= set(effect["parameters"])


def test_state_layout_is_whole() -> None:
    """Actuators follow the head of the state."""
    vehicle = vehicles.quad(np.random.default_rng(1))
    body = Body(_bare(vehicle), rotor=True, ground=0.0, water=False)
    act = _at(1, 2, 3, 4)
    state = body.still(_at(0, 0, 1), _at(1, 0, 0, 0), _at(0, 0, 0), _at(0, 0, 0), act)
    assert state.shape[0] == HEAD + 4
    assert body.hold(state) == pytest.approx(act)
