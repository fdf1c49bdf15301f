"""Names of what is missing on measurements that nobody here made, against the lines to reach."""

from __future__ import annotations

import numpy as np
import pytest

from seals.compare.application import read_logs, settings_of
from seals.config.compose import compose
from seals.sysid.predictors.batch import prepare
from seals.sysid.runs import RunsDiagnosis, diagnose_runs
from seals.sysid.scores.cross_validation import CrossValidator

pytestmark = pytest.mark.validation
DRAGS = {"linear_drag", "quadratic_drag"}
LIGHT = (
    *("blue_basketball", "green_basketball", "volleyball", "whiffle_ball_1"),
    *("whiffle_ball_2", "yellow_whiffle_ball", "orange_whiffle_ball"),
)


def diagnoses(*overrides: str) -> list[RunsDiagnosis]:
    """Diagnose an experiment of real measurements."""
    settings = settings_of(compose(list(overrides), root="compare"))
    return diagnose_runs(settings, read_logs(settings))


def named(one: RunsDiagnosis) -> set[str]:
    """Effects that could not be another."""
    return {c.candidate.label for c in one.answer.claims if not c.rivals}


def claimed(one: RunsDiagnosis) -> set[str]:
    """Effects that are named or could stand in the place of one."""
    return {c.candidate.label for c in (*one.answer.claims, *one.answer.others)}


@pytest.mark.thorough
def test_a_tennis_ball_lacks_drag_and_a_bowling_ball_nothing(measurements: None) -> None:
    """Two drops show drag, not its law; the bowling ball's drops show none."""
    found = diagnoses("experiment=falling_balls", "only=[tennis_ball,bowling_ball]")
    bowling, tennis = sorted(found, key=lambda d: d.name)
    assert bowling.answer.verdict.value == "nothing_missing"
    assert tennis.answer.verdict.value == "ambiguous"
    assert claimed(tennis) == DRAGS
    assert tennis.rms("position", after=True) < 0.5 * tennis.rms("position", after=False)


@pytest.mark.slow
@pytest.mark.parametrize("ball", LIGHT)
def test_every_light_ball_lacks_drag(ball: str, measurements: None) -> None:
    """Drag of an undecided law."""
    (one,) = diagnoses("experiment=falling_balls", f"only=[{ball}]")
    assert claimed(one) == DRAGS
    assert one.answer.verdict.value == "ambiguous"


@pytest.mark.slow
def test_the_ship_section_lacks_two_effects_together(measurements: None) -> None:
    """Added mass and radiation damping; the median error of unseen responses is below 0.06."""
    (one,) = diagnoses("experiment=flume_heave")
    assert named(one) == {"added_mass", "radiation_damping"}
    experiment = one.search.validator.experiment
    channel = "heave_response"
    errors = [
        abs(experiment.cases[k].measured[channel] - one.variants[-1].predicted[k][channel]).item()
        for k in experiment.unseen
    ]
    assert float(np.median(errors)) <= 0.06


@pytest.mark.slow
def test_two_speeds_of_entry_show_slamming_and_drag(measurements: None) -> None:
    """Fitted at 2 and 6 m/s, the error at 4 m/s is below 2.8 m/s^2.

    An added mass that follows its waterline holds the slam: these runs cannot tell the two apart.
    """
    (one,) = diagnoses("experiment=impack_entry")
    assert {"buoyancy", "quadratic_drag"} <= named(one)
    assert "slamming and added_mass cannot be told apart" in " ".join(one.answer.reasons)
    assert one.rms("specific_force", after=True) <= 2.8


@pytest.mark.slow
def test_one_speed_of_entry_cannot_tell_drag_from_buoyancy(measurements: None) -> None:
    """The words say so, and what to do."""
    options = ("train=[4mps_sphere_*]", "held_out=[2mps_sphere_1]")
    (one,) = diagnoses("experiment=impack_entry", *options)
    words = " ".join(one.answer.reasons)
    assert "buoyancy" in words
    assert "drag" in words
    assert "drop at another speed" in words


@pytest.mark.slow
def test_the_pendulum_lacks_viscous_friction_alone(measurements: None) -> None:
    """Coulomb friction is rejected on held-out swings."""
    (one,) = diagnoses("experiment=single_pendulum")
    assert claimed(one) == {"joint_friction (viscous)"}
    assert one.rms("joint_position", after=True) <= 0.013


@pytest.mark.slow
def test_the_glider_lacks_lift(measurements: None) -> None:
    """Lift is named by a speed through water that no fit has seen; its error halves."""
    (one,) = diagnoses("experiment=slocum_glider")
    assert one.answer.verdict.value == "named"
    assert named(one) == {"lift"}
    channel = "speed_through_water"
    assert speed_error(one, 0, channel) > 0.045
    assert speed_error(one, -1, channel) <= 0.030
    # the fitted depth rate hardly moves
    before, after = (one.rms("depth_rate", after=a) for a in (False, True))
    assert 0.9 * before < after < before
    # the slope of the publisher's example is 7.5 per radian on 0.1 m^2
    (area,) = (v.value for v in one.variants[-1].fitted if v.key == "lift.coefficient")
    assert 0.6 < area < 0.9


def speed_error(one: RunsDiagnosis, variant: int, channel: str) -> float:
    """Error on both halves of the flight, none of which was fitted."""
    cases = one.search.validator.experiment.cases
    pairs = zip(cases, one.variants[variant].predicted, strict=True)
    rows = [(c.measured[channel] - p[channel]).ravel() for c, p in pairs]
    return float(np.sqrt(np.nanmean(np.concatenate(rows) ** 2)))


@pytest.mark.slow
def test_the_crazyflie_lacks_a_lag_of_its_rotors(measurements: None) -> None:
    """A lag of 0.05 to 0.08 s, not a delay, which fits nearly as well but for its fast changes."""
    (one,) = diagnoses("experiment=crazyflie_thrust")
    assert one.answer.verdict.value == "named"
    assert named(one) == claimed(one) == {"rotor_lag"}
    fitted = {v.key: v.value for v in one.variants[-1].fitted}
    assert 0.05 <= fitted["rotor_lag.time_constant_change"] <= 0.08
    # thrust per square of speed within a third of what the maker's data say
    assert abs(fitted["thrust_coefficient.relative_change"]) < 0.33
    assert one.rms("specific_force", after=False) > 0.85
    assert one.rms("specific_force", after=True) <= 0.65


@pytest.mark.slow
def test_later_flights_bear_out_the_lag(measurements: None) -> None:
    """On stretches that no fit saw the lag beats the delay on nearly every one."""
    options = ("experiment=crazyflie_thrust", "rivals=[rotor_lag,command_delay]")
    settings = settings_of(compose(list(options), root="compare"))
    validator = CrossValidator(prepare(settings, read_logs(settings)))
    fits = validator.fitted([((c,), None) for c in validator.experiment.candidate_set.candidates])
    found = {h.label: validator.unseen(h) for h in fits}
    lag, delay = found["rotor_lag"], found["command_delay"]
    channel, cases = "specific_force", validator.experiment.cases
    wins = [
        np.nanmean((cases[k].measured[channel] - lag.predicted[k][channel]) ** 2)
        < np.nanmean((cases[k].measured[channel] - delay.predicted[k][channel]) ** 2)
        for k in validator.experiment.unseen
    ]
    assert len(wins) >= 10
    assert np.mean(wins) > 0.8
