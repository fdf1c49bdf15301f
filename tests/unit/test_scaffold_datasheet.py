"""The data sheet that a flight writes: noise, biases, lag and gusts of a made-up hover."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from seals.errors import ConfigError
from seals.logs.log import Log
from seals.scaffold.datasheet import write_datasheet
from seals.scaffold.flight_facts import flight_facts

STEP, ROWS, REST = 0.01, 6000, 600
MASS, FACTOR, LAG = 1.5, 1.2e-5, 0.06
SIGMA = {"angular_velocity": 0.012, "specific_force": 0.09, "position": 0.008}
INERTIA = np.diag([0.012, 0.014, 0.022])
PLACES = np.array([[0.12, -0.12, 0.0], [-0.12, 0.12, 0.0], [0.12, 0.12, 0.0], [-0.12, -0.12, 0.0]])
VEHICLE: dict[str, Any] = {
    "name": "quad",
    "mass": MASS,
    "inertia": INERTIA,
    "centre_of_gravity": np.zeros(3),
    "rotors": [
        {
            "position": place,
            "axis": [0.0, 0.0, 1.0],
            "direction": 1.0,
            "thrust_coefficient": FACTOR,
            "torque_coefficient": 2e-7,
            "time_constant": 0.02,
            "max_speed": 1000.0,
            "radius": 0.1,
        }
        for place in PLACES
    ],
}


def _coloured(rng: np.random.Generator, time: float, columns: int) -> NDArray[np.float64]:
    """Ornstein-Uhlenbeck noise of unit variance."""
    keep = np.exp(-STEP / time)
    out = np.zeros((ROWS, columns))
    for k in range(1, ROWS):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * rng.standard_normal(columns)
    return out


def _flight(gust: float = 0.4) -> Log:
    """Six seconds at rest, then hover: rotors dither, lag by 60 ms, gusts push level."""
    rng = np.random.default_rng(4)
    flying = np.arange(ROWS) >= REST
    hover = np.sqrt(MASS * 9.81 / 4 / FACTOR)
    command = (hover * (1.0 + 0.05 * _coloured(rng, 0.08, 4))) * flying[:, None]
    actual = np.zeros_like(command)
    for k in range(1, ROWS):
        actual[k] = command[k] + np.exp(-STEP / LAG) * (actual[k - 1] - command[k])
    thrust = FACTOR * actual**2
    torque = thrust @ np.cross(PLACES, [0.0, 0.0, 1.0])
    gyro = np.cumsum(torque @ np.linalg.inv(INERTIA), axis=0) * STEP
    force = np.zeros((ROWS, 3))
    force[:, :2] = gust * _coloured(rng, 0.35, 2) * flying[:, None]
    force[:, 2] = np.where(flying, thrust.sum(axis=1) / MASS, 9.81)
    position = np.zeros((ROWS, 3))
    columns = {"t": np.arange(ROWS) * STEP}
    for stem, values, bias in (
        ("angular_velocity", gyro, 0.02),
        ("specific_force", force, 0.0),
        ("position", position, 0.0),
    ):
        for k, axis in enumerate("xyz"):
            noise = SIGMA[stem] * rng.standard_normal(ROWS)
            columns[f"{stem}_{axis}"] = values[:, k] + noise + bias * (k == 1)
    columns |= {f"rotor_speed_cmd_{k + 1}": command[:, k] for k in range(4)}
    return Log(name="hover", columns=columns)


def test_a_flight_tells_noise_bias_lag_thrust_and_gusts() -> None:
    """Every number that went into the flight comes out of it."""
    calm, facts = flight_facts(_flight(gust=0.01), VEHICLE), flight_facts(_flight(), VEHICLE)
    for stem, sigma in SIGMA.items():
        assert calm.noise[stem] == pytest.approx(sigma, rel=0.1)
        assert calm.rate[stem] == pytest.approx(100.0)
    assert facts.seconds_at_rest == pytest.approx(6.0, abs=1.0)
    assert facts.gyroscope_bias is not None
    assert facts.gyroscope_bias.value == pytest.approx(0.02, abs=0.003)
    assert facts.hover_ratio is not None
    assert facts.hover_ratio.value == pytest.approx(1.0, abs=0.02)
    assert facts.response is not None
    assert facts.response.value == pytest.approx(LAG, abs=0.015)
    assert facts.gust is not None
    assert facts.gust.value == pytest.approx(0.4, rel=0.35)


def test_the_drag_between_stops_counts_as_no_gusts() -> None:
    """A mean over two seconds at a stop of 1.5 s reaches into the way there, with its drag."""
    log, rng, phase = _flight(gust=0.0), np.random.default_rng(2), np.arange(ROWS) * STEP % 3.0
    speed = (
        2.0 * np.maximum(np.sin(np.pi * (phase - 1.5) / 1.5), 0.0) * (np.arange(ROWS) > 2 * REST)
    )
    columns = dict(log.columns)
    columns["specific_force_x"] = log.columns["specific_force_x"] - 0.35 * speed
    columns["position_x"] = log.columns["position_x"] + np.cumsum(speed) * STEP
    for letter in "wxyz":
        columns[f"orientation_{letter}"] = 0.004 * rng.standard_normal(ROWS) + (letter == "w")
    gust = flight_facts(Log(name="places", columns=columns), VEHICLE).gust
    assert gust is not None
    assert gust.value < 0.02


def _still(sigmas: tuple[float, float, float], seed: int) -> Log:
    rng = np.random.default_rng(seed)
    columns = {"t": np.arange(1600) * STEP}
    columns |= {
        f"position_{axis}": sigma * rng.standard_normal(1600)
        for axis, sigma in zip("xyz", sigmas, strict=True)
    }
    return Log(name="still", columns=columns)


def test_noise_is_that_of_all_axes_unless_one_is_noisier() -> None:
    """The mean over 40 logs is true to 1 %: the largest of three equal axes is 3 % too high."""
    equal = [flight_facts(_still((3e-3,) * 3, k), VEHICLE).noise["position"] for k in range(40)]
    assert np.mean(equal) == pytest.approx(3e-3, rel=0.01)
    other = [
        flight_facts(_still((3e-3, 3e-3, 6e-3), k), VEHICLE).noise["position"] for k in range(10)
    ]
    assert np.mean(other) == pytest.approx(6e-3, rel=0.03)


def test_the_sheet_says_of_every_number_where_it_is_from(tmp_path: Path) -> None:
    """Each line of a number is marked; what is stated can be read back; nothing is overwritten."""
    place = tmp_path / "datasheet.yaml"
    told = write_datasheet(_flight(), VEHICLE, place, replace=False)
    text = place.read_text()
    sheet = yaml.safe_load(text)
    assert sheet["sensors"]["channels"]["angular_velocity"]["sigma"] == pytest.approx(
        0.012, rel=0.1
    )
    # the bias of 0.02 rad/s is larger than is usual: no tolerance, but told
    assert sheet["tolerance"]["gyroscope_bias"]["sigma"] == pytest.approx(0.005)
    assert sheet["tolerance"]["mass"]["source"] == "assumed"
    assert "mean rate at rest 0.02" in text
    numbers = [line for line in text.splitlines() if "sigma" in line]
    assert len(numbers) > 12
    assert all("# measured" in line or "# assumed" in line for line in numbers)
    assert any(line.startswith("measured: thrust is 1.0") for line in told)
    assert any("60 ms" in line or "55 ms" in line or "65 ms" in line for line in told)
    with pytest.raises(ConfigError, match="replace=true"):
        write_datasheet(_flight(), VEHICLE, place, replace=False)


def test_a_flight_without_rest_leaves_biases_assumed(tmp_path: Path) -> None:
    """What a flight cannot tell is said to be assumed, and never measured."""
    log = _flight().select(np.arange(ROWS) > REST + 200)
    place = tmp_path / "datasheet.yaml"
    told = write_datasheet(log, VEHICLE, place, replace=False)
    assert any("never at rest" in line for line in told)
    line = next(x for x in place.read_text().splitlines() if "gyroscope_bias" in x)
    assert "# assumed" in line


def test_a_component_that_begins_later_leaves_the_noise_measured() -> None:
    """The noise is that of the rows in which all components have a sample."""
    columns = dict(_flight().columns)
    columns["position_x"] = np.where(np.arange(ROWS) < 1000, np.nan, columns["position_x"])
    found = flight_facts(Log(name="hover", columns=columns), VEHICLE)
    assert found.noise["position"] == pytest.approx(SIGMA["position"], rel=0.1)


def test_a_dive_has_the_tolerances_of_a_hull(tmp_path: Path) -> None:
    """Without them its displaced volume and added mass would count as exact."""
    flight, sheets = _flight(), []
    for log in (flight, flight.with_columns({"depth": np.full(ROWS, 2.0)})):
        place = tmp_path / f"{len(sheets)}.yaml"
        told = write_datasheet(log, VEHICLE, place, replace=False)
        sheets.append(yaml.safe_load(place.read_text())["tolerance"])
    assert set(sheets[1]) - set(sheets[0]) == {
        "displaced_volume",
        "centre_of_buoyancy",
        "added_mass",
    }
    assert "added_mass" in told[-1]


def test_water_that_a_flight_does_not_tell_of_is_stiller_than_air(tmp_path: Path) -> None:
    """Gusts assumed where none are hide a tether; a robot that comes out of the water meets air."""
    columns = {k: v for k, v in _flight().columns.items() if not k.startswith("specific_force")}
    below, rov = {"position_z": np.full(ROWS, -4.0)}, {**VEHICLE, "rotors": []}
    rov["thrusters"] = VEHICLE["rotors"]
    stated = []
    for more, vehicle in (
        ({}, VEHICLE),
        ({"depth": np.full(ROWS, 2.0)}, VEHICLE),
        ({"depth": np.linspace(-0.5, 2.0, ROWS)}, VEHICLE),
        (below, VEHICLE),
        (below, rov),
        ({}, rov),
    ):
        place = tmp_path / f"{len(stated)}.yaml"
        log = Log(name="f", columns={**columns, **more})
        write_datasheet(log, vehicle, place, replace=False)
        stated.append(yaml.safe_load(place.read_text())["disturbance"]["force_sigma"])
    gusts = np.array([0.02, 0.005, 0.02, 0.02, 0.005, 0.02])
    assert stated == pytest.approx(gusts * VEHICLE["mass"], rel=0.01)


def test_assumed_gusts_turn_a_small_vehicle_by_a_small_arm(tmp_path: Path) -> None:
    """With one arm for all vehicles, gusts would turn a palm-sized one harder than its rotors."""
    columns = {k: v for k, v in _flight().columns.items() if not k.startswith("specific_force")}
    arms = []
    for share in (1.0, 0.2):
        place = tmp_path / f"{len(arms)}.yaml"
        rotors = [{**r, "position": share * np.array(r["position"])} for r in VEHICLE["rotors"]]
        vehicle = {**VEHICLE, "rotors": rotors}
        write_datasheet(Log(name="f", columns=columns), vehicle, place, replace=False)
        gusts = yaml.safe_load(place.read_text())["disturbance"]
        arms.append(gusts["torque_sigma"] / gusts["force_sigma"])
    # rotors 0.17 m from the middle
    large = 0.065 * 0.12 * np.sqrt(2.0)
    assert arms == pytest.approx([large, 0.2 * large], rel=0.02)


def test_a_large_bias_at_rest_is_no_tolerance(tmp_path: Path) -> None:
    """The fault that a flight shows at rest is left to the diagnosis."""
    columns = {k: v.copy() for k, v in _flight().columns.items()}
    columns["angular_velocity_y"] += 0.04
    place = tmp_path / "datasheet.yaml"
    write_datasheet(Log(name="f", columns=columns), VEHICLE, place, replace=False)
    sheet = yaml.safe_load(place.read_text())
    assert sheet["tolerance"]["gyroscope_bias"]["sigma"] == pytest.approx(0.005)


def test_a_lag_that_the_robot_leaves_out_has_no_tolerance(tmp_path: Path) -> None:
    """One of 20 ms is then a missing effect, not a number that a fit may move."""
    sigma = {}
    for stated in (0.0, 0.02):
        rotors = [{**r, "time_constant": stated} for r in VEHICLE["rotors"]]
        place = tmp_path / f"{stated}.yaml"
        write_datasheet(_flight(), {**VEHICLE, "rotors": rotors}, place, replace=False)
        tolerance = yaml.safe_load(place.read_text())["tolerance"]
        sigma[stated] = tolerance.get("rotor_time_constant", {}).get("sigma")
    assert sigma == {0.0: None, 0.02: 0.01}


def test_markers_may_be_turned_where_the_position_is_that_of_motion_capture(
    tmp_path: Path,
) -> None:
    """A pose without such accuracy keeps its axes."""
    allowed = []
    for noise in (2e-4, 5e-3):
        columns = {k: v.copy() for k, v in _flight().columns.items()}
        rng = np.random.default_rng(7)
        for axis in "xyz":
            columns[f"position_{axis}"] = noise * rng.standard_normal(ROWS)
            columns[f"orientation_{axis}"] = 1e-3 * rng.standard_normal(ROWS)
        columns["orientation_w"] = np.ones(ROWS)
        place = tmp_path / f"{noise}.yaml"
        write_datasheet(Log(name="f", columns=columns), VEHICLE, place, replace=False)
        allowed.append("pose_misalignment" in yaml.safe_load(place.read_text())["tolerance"])
    assert allowed == [True, False]
