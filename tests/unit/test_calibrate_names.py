"""Names of the numbers that a calibration finds, and the parameters that they free."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.logs.native import read_native
from seals.logs.shipped import find_log
from seals.sysid.calibration.calibration import chosen
from seals.sysid.calibration.free_numbers import prior_sigma, same_number, with_free_numbers
from seals.sysid.calibration.stated import StatedNumber, stated_numbers
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.vehicle import Vehicle, read_vehicle

DRAG = "effects.linear_drag_air.coefficient_x"
THRUST = "actuators.rotors.thrust_coefficient"


@cache
def quadrotor() -> tuple[Vehicle, CandidateSet, dict[str, StatedNumber]]:
    """Return the quadrotor of a log that ships, its parameters and its numbers."""
    vehicle = read_vehicle(read_native(find_log("hidden_effect/flight_a")).meta)
    candidate_set = candidate_set_of(vehicle, speeds=np.ones(3))
    return vehicle, candidate_set, stated_numbers(vehicle, candidate_set)


def asked(*names: str) -> list[str]:
    """Return the names that a question means."""
    return [number.name for number in chosen(names, quadrotor()[2])]


def test_the_numbers_are_those_that_the_log_states() -> None:
    """Mass, moments of inertia, coefficients of rotors and drags, each with its value and unit."""
    vehicle, _, numbers = quadrotor()
    spec = read_native(find_log("hidden_effect/flight_a")).meta["vehicle"]
    assert numbers["mass"].value == pytest.approx(spec["mass"])
    # parameters of an effect that acts for a while are no numbers of the vehicle
    assert not [n.name for n in numbers.values() if "|" in n.name + n.key]
    assert numbers["inertia_yy"].value == pytest.approx(spec["inertia"][1][1])
    assert numbers[THRUST].value == pytest.approx(spec["rotors"][0]["thrust_coefficient"])
    assert numbers[THRUST].unit == "N/(rad/s)^2"
    lag = numbers["actuators.rotors.time_constant"]
    assert (lag.value, lag.unit) == (pytest.approx(spec["rotors"][0]["time_constant"]), "s")
    assert numbers[DRAG].value == vehicle.effects["linear_drag_air"].coefficient_x  # type: ignore[attr-defined]


def test_groups_and_patterns_mean_what_is_stated() -> None:
    """A group is all of its numbers, a pattern those that fit; a name given twice counts once."""
    assert asked("inertia") == ["inertia_xx", "inertia_yy", "inertia_zz"]
    assert asked("effects.linear_drag_air") == [DRAG[:-1] + axis for axis in "xyz"]
    assert asked("actuators.*", THRUST)[0] == THRUST
    assert len(asked("actuators.*", THRUST)) == 3
    # the log states no quadratic part of the angular drag: zero is not a number to calibrate
    drags = asked("effects.*")
    assert "effects.angular_drag_any.coefficient_x" in drags
    assert not [name for name in drags if "angular_drag_any.quadratic" in name]


def test_a_wrong_name_is_answered_with_the_nearest() -> None:
    """The refusal has two lines, the second with the name that was meant."""
    with pytest.raises(ConfigError) as refusal:
        asked("effects.linear_drag_air.coeficient_x")
    lines = str(refusal.value).splitlines()
    assert len(lines) == 2
    assert f"Did you mean '{DRAG}'?" in lines[1]
    with pytest.raises(ConfigError, match="parameters is not given"):
        asked()


def test_the_tolerance_of_a_number_goes_and_all_others_stay() -> None:
    """A free coefficient is not tied to the data sheet twice; its neighbours keep theirs."""
    vehicle, candidate_set, numbers = quadrotor()
    base = vehicle.robot.links[0]
    own = [numbers[DRAG], numbers["mass"], numbers[THRUST]]
    free = with_free_numbers(candidate_set, own, base=base, share=0.5)
    gone = set(candidate_set.tolerances) - set(free.tolerances)
    assert gone == {
        "linear_drag_air_change.coefficient_x",
        "mass.mass",
        "thrust_coefficient.relative_change",
    }
    assert same_number(candidate_set, numbers["inertia_xx"], base) == ["inertia.delta_xx"]


def test_the_tolerance_of_the_thrust_is_that_of_the_thrust_alone() -> None:
    """A common change of all thrusts must not pass for one of the reaction torques."""
    vehicle, candidate_set, numbers = quadrotor()
    torque = numbers["actuators.rotors.torque_coefficient"]
    base = vehicle.robot.links[0]
    free = with_free_numbers(candidate_set, [torque], others=numbers.values(), base=base, share=0.5)
    before = candidate_set.parameters["thrust_coefficient.relative_change"].tolerance
    assert before > 0.0
    assert free.parameters["rotors.thrust_change"].tolerance == pytest.approx(before)
    assert free.parameters["thrust_coefficient.relative_change"].tolerance == 0.0


def test_the_prior_is_as_wide_as_asked_and_keeps_masses_positive() -> None:
    """Half of the stated mass is one sigma; what the fit may reach stays above zero."""
    vehicle, candidate_set, numbers = quadrotor()
    mass = numbers["mass"]
    free = with_free_numbers(candidate_set, [mass], base=vehicle.robot.links[0], share=0.5)
    parameter = free.parameters[mass.key]
    assert 1.5 * parameter.scale == pytest.approx(0.5 * mass.value)
    assert 0.0 < mass.number(parameter.bounds[0]) < 0.1 * mass.value
    fault = numbers["sensors.accelerometer_bias.bias_x"]
    assert prior_sigma(fault, candidate_set.parameters[fault.key], share=0.5) > 0.0


def test_a_coefficient_of_rotors_is_one_factor_for_all() -> None:
    """A change by a tenth of the relative parameter is a tenth of the coefficient."""
    number = quadrotor()[2][THRUST]
    assert number.key == "rotors.thrust_change"
    assert number.number(0.1) == pytest.approx(1.1 * number.value)
    assert number.change(1.5 * number.value) == pytest.approx(0.5)
