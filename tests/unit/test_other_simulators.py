"""Sets of flights of other simulators: equations typed in anew, sensors, and the scorer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from benchmarks.other_simulators import crazyflies, multirotors, underwater
from benchmarks.other_simulators.flight_sets import Noise, measured, turned_by
from benchmarks.other_simulators.score_set import WORDS, sort_of
from seals import registry

SILENT = Noise(position=0.0, attitude=0.0, rate=0.0, force=0.0)


def still(_: float) -> tuple[Any, Any]:
    """A path that stands still."""
    return np.array([0.0, 0.0, -5.0]), np.zeros(3)


def test_coriolis_loads_do_no_work() -> None:
    """Work nu . C(nu) nu = 0 for any symmetric inertia."""
    rng = np.random.default_rng(5)
    half = rng.normal(size=(6, 6))
    for nu in rng.normal(size=(5, 6)):
        assert nu @ underwater.Vehicle.coriolis(half + half.T, nu) == pytest.approx(0.0, abs=1e-12)


def test_steady_surge_is_where_thrust_equals_drag() -> None:
    """40 N forward: 13.7 u + 141 u^2 = 40."""
    vehicle = underwater.Vehicle(still, {})
    command = np.array([1, 1, -1, -1, 0, 0, 0, 0]) * 0.0
    command[:4] = 40.0 / (4 * np.sqrt(0.5))
    # front thrusters point inward, rear ones outward: all push forward; hold depth and attitude
    u = (-13.7 + np.sqrt(13.7**2 + 4 * 141 * 40)) / (2 * 141)
    state = np.zeros(21)
    state[2], state[6], state[7], state[13:17] = -5.0, 1.0, u, command[:4]
    assert vehicle.slope(0.0, state, command)[7] == pytest.approx(0.0, abs=1e-9)


def test_body_that_turns_in_a_steady_current_drifts_with_it() -> None:
    """Water and body at one velocity: no force, however the body turns about the vertical."""
    vehicle = underwater.Vehicle(still, {"current": (0.3, -0.2, 0.0)})
    for yaw in (0.0, 0.7, 2.5):
        state = np.zeros(21)
        state[2], state[5:7] = -5.0, [np.sin(yaw / 2), np.cos(yaw / 2)]
        state[7:10] = underwater.matrix(state[3:7]).T @ [0.3, -0.2, 0.0]
        state[12] = 0.8
        slope = vehicle.slope(0.0, state, np.zeros(8))
        over_ground = slope[7:10] + np.cross(state[10:13], state[7:10])
        assert over_ground[:2] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_hull_rights_itself() -> None:
    """Rolled by 0.1 rad: torque -rho g V h sin(0.1) over rigid and added inertia."""
    vehicle = underwater.Vehicle(still, {})
    state = np.zeros(21)
    state[2], state[3], state[6] = -5.0, np.sin(0.05), np.cos(0.05)
    torque = -998.2 * 9.81 * 0.0134 * 0.01 * np.sin(0.1)
    assert vehicle.slope(0.0, state, np.zeros(8))[10] == pytest.approx(torque / (0.26 + 0.189))


def test_load_off_the_centre_falls_as_one_body() -> None:
    """Weight alone, no water: every point falls at g, none turns."""
    vehicle = underwater.Vehicle(still, {"payload": (0.6, (0.12, 0.06, -0.1), 1e9)})
    vehicle.lift, vehicle.added = 0.0, np.zeros((6, 6))
    vehicle.inverse = np.linalg.inv(vehicle.rigid)
    state = np.zeros(21)
    state[2], state[6] = -5.0, 1.0
    expected = [0.0, 0.0, -9.81, 0.0, 0.0, 0.0]
    assert vehicle.slope(0.0, state, np.zeros(8))[7:13] == pytest.approx(expected, abs=1e-9)


def test_sensor_off_its_place_feels_the_turning() -> None:
    """At x = 0.1 m a rate of 2 rad/s adds -0.4 m/s^2, an angular acceleration of 3 adds 0.3."""
    rows = {"position": np.zeros((1, 3)), "q_xyzw": np.array([[0.0, 0.0, 0.0, 1.0]])}
    rows |= {"rate": np.array([[0.0, 0.0, 2.0]]), "turning": np.array([[0.0, 0.0, 3.0]])}
    rows["force"] = np.array([[0.0, 0.0, 9.81]])
    rng = np.random.default_rng(0)
    seen = measured(rng, np.zeros(1), rows, noise=SILENT, imu_place=(0.1, 0.0, 0.0))
    assert seen["force"][0] == pytest.approx([-0.4, 0.3, 9.81])


def test_small_turns_are_about_body_axes() -> None:
    """A turn of 0.02 rad about body x of a body that is turned by a quarter about z."""
    half = np.sqrt(0.5)
    turned = turned_by(np.array([[0.0, 0.0, half, half]]), np.array([[0.02, 0.0, 0.0]]))[0]
    tilt = underwater.matrix(turned) @ [0.0, 0.0, 1.0]
    assert tilt == pytest.approx([0.02, 0.0, 1.0], abs=3e-4)


def test_hanging_load_pulls_with_its_weight() -> None:
    """At rest the string carries the load."""
    load = multirotors.Load(0.1, 0.8)
    at = np.array([1.0, 2.0, 3.0])
    force, change = load.pull(load.start(at), at, np.zeros(3))
    assert force == pytest.approx([0.0, 0.0, -0.981])
    assert change == pytest.approx(np.zeros(6), abs=1e-12)


@pytest.mark.parametrize("module", [multirotors, underwater, crazyflies])
def test_answers_of_a_set_are_names_that_a_diagnosis_can_give(module: Any) -> None:
    """A word that no answer holds would count every one as wrong."""
    path = Path(module.__file__).with_suffix(".yaml")
    known = {*WORDS, *registry.names("effect")}
    cases = yaml.safe_load(path.read_text(encoding="utf-8"))["cases"]
    words = {w for case in cases.values() for a in case["answers"] for w in a.split("+")}
    assert words <= known


def test_a_level_crazyflie_is_asked_for_its_weight_and_no_torque() -> None:
    """At rest where it should be; a tilt is answered by the rotors of the lower side."""
    sheet = {"mass": 0.03, "J": np.diag([1.7e-5, 1.7e-5, 3e-5]), "thrust": 2e-10, "torque": 1.5e-12}
    sheet |= {"spin": np.array([-1.0, 1.0, -1.0, 1.0])}
    sheet["arms"] = 0.03 * np.array([[1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    wanted = (np.zeros(3), np.zeros(3), np.zeros(3), 0.0, 0.0)
    state = np.zeros(17)
    state[6] = 1.0
    speed = crazyflies.commanded(sheet, state, wanted, np.zeros(6))
    assert 2e-10 * speed**2 == pytest.approx(np.full(4, 0.03 * 9.81 / 4.0))
    state[3], state[6] = np.sin(0.05), np.cos(0.05)
    rolled = crazyflies.commanded(sheet, state, wanted, np.zeros(6))
    assert (rolled[:2] > rolled[2:]).all()


def answer(verdict: str, *names: str, **more: Any) -> dict[str, Any]:
    """An answer with effects of a parameter of one."""
    number = {"value": 1.0, "low90": 0.9, "high90": 1.1}
    effects = [{"name": n, "parameters": {"p": number}} for n in names]
    return {"verdict": verdict, "effects": effects, **more}


@pytest.mark.parametrize(
    ("answers", "found", "kind"),
    [
        (["wind"], answer("named", "wind"), "right"),
        (["wind"], answer("named", "tether"), "wrong"),
        (["wind"], answer("ambiguous", "wind", "tether"), "set"),
        (["wind"], answer("ambiguous", "payload", "tether"), "wrong"),
        (["wind"], answer("nothing_missing"), "silent"),
        (["wind"], answer("none_of_these"), "refused"),
        (["nothing_missing"], answer("nothing_missing"), "right"),
        (["nothing_missing"], answer("named", "wind"), "wrong"),
        (["wind+weak_rotor"], answer("named", "weak_rotor", "wind"), "right"),
        (["wind+weak_rotor"], answer("named", "wind"), "wrong"),
        (["none_of_these"], answer("named", "wind"), "wrong"),
        (["linear_drag", "stated_wrong"], answer("nothing_missing", stated_wrong=[1]), "right"),
        (["not_sensor"], answer("named", "motor_curve"), "right"),
        (["not_sensor"], answer("named", "accelerometer_bias"), "wrong"),
    ],
)
def test_answers_are_counted(answers: list[str], found: dict[str, Any], kind: str) -> None:
    """Every kind of answer has its count."""
    assert sort_of(answers, found) == kind


def test_name_of_an_effect_that_may_be_zero_is_wrong() -> None:
    """An interval of the only parameter that holds zero names nothing."""
    found = answer("named", "wind")
    found["effects"][0]["parameters"]["p"]["low90"] = -0.1
    assert sort_of(["wind"], found) == "wrong"


@pytest.mark.parametrize("cases", [multirotors.CASES, underwater.CASES])
def test_sets_hold_forty_flights_of_all_kinds(cases: Any) -> None:
    """Eight nulls, single effects, pairs and laws outside the library; robots exist."""
    assert len({c.name for c in cases}) == len(cases) == 40
    assert sum(c.answers[0] == "nothing_missing" for c in cases) == 8
    assert any("+" in a for c in cases for a in c.answers)
    robots = multirotors.ROBOTS if cases is multirotors.CASES else underwater.ROBOTS
    assert {c.robot for c in cases} <= set(robots)
