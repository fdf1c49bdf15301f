"""Glide, thrust and heave without a simulated motion, against closed forms; and what is refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.signal import lfilter

from seals.compare.application import settings_of
from seals.compare.case import Case
from seals.compare.predict import Job
from seals.compare.prediction_methods import cases_of, predictor_of
from seals.compare.sampled import bare_case
from seals.compare.settings import CompareSettings
from seals.compare.variants import fit_variants
from seals.config.compose import compose
from seals.effects.binding import bind_effects
from seals.errors import ConfigError, LogError
from seals.logs.log import Log
from seals.robot.build import build_robot
from seals.sysid.candidates.catalogue import candidates_of_runs
from seals.sysid.predictors.batch import prepare

GRAVITY = 9.81


def settings_for(*overrides: str) -> CompareSettings:
    """Settings of a recipe."""
    return settings_of(compose(list(overrides), root="compare"))


def predicted(
    settings: CompareSettings, names: Sequence[str], cases: Sequence[Case]
) -> list[dict[str, np.ndarray]]:
    """Samples of the model with the effects of these names, nothing fitted."""
    robot = build_robot(settings.robot)
    every = {**settings.effects, **settings.actuators}
    effects = bind_effects({n: every[n] for n in names}, robot.links)
    predictor = predictor_of(settings)(settings, robot, effects, [], cases, step=0.01)
    return predictor.run(
        [Job(k, np.zeros_like(c.start.sigma), np.zeros(0)) for k, c in enumerate(cases)]
    )


def glide(pitch: list[float], ballast: list[float]) -> Case:
    """Samples of a glide at a density of 1005.5 kg/m^3."""
    count = len(pitch)
    case = bare_case(
        "glide",
        np.arange(count, dtype=float),
        {k: np.zeros((count, 1)) for k in ("depth_rate", "speed_through_water")},
        {k: np.ones(1) for k in ("depth_rate", "speed_through_water")},
    )
    case.given.update(
        pitch=np.array(pitch),
        ballast=np.array(ballast),
        density=np.full(count, 1005.5),
        depth=np.full(count, 20.0),
    )
    return case


def test_a_glide_along_its_axis() -> None:
    """B sin(pitch) = C U^2 along the axis, C 7.5 N s^2/m^2; the depth rate is -U sin(pitch)."""
    pitch, ballast = np.array([0.4, -0.35]), np.array([2e-4, -2.5e-4])
    (found,) = predicted(
        settings_for("experiment=slocum_glider"),
        ["gravity", "buoyancy", "hull_drag"],
        [glide(list(pitch), list(ballast))],
    )
    push = GRAVITY * (1005.5 * (0.0696 + ballast) - 70.0)
    speed = np.sqrt(push * np.sin(pitch) / 7.5)
    assert found["speed_through_water"][:, 0] == pytest.approx(speed, rel=2e-3)
    assert found["depth_rate"][:, 0] == pytest.approx(-speed * np.sin(pitch), rel=2e-3)


def test_a_glide_with_lift_and_its_drag() -> None:
    """Merckelbach 2019: the angle of attack solves D(a) = L(a) tan(pitch + a)."""
    pitch, ballast, area = 0.4, 2.2e-4, 0.75
    settings = settings_for("experiment=slocum_glider", f"effects.lift.coefficient={area}")
    names = ["gravity", "buoyancy", "hull_drag", "lift"]
    (found,) = predicted(settings, names, [glide([pitch], [ballast])])
    half = 0.5 * 1005.5

    def surplus(a: float) -> float:
        """Lift along the path less drag across it, per square of the speed.

        The hull's drag along its axis leaves D = C cos^3 a and L = -C cos^2 a sin a.
        """
        drag = 7.5 * np.cos(a) ** 3 + half * 1.05 * np.sin(a) ** 2
        lift = half * area * np.sin(a) * np.cos(a) - 7.5 * np.cos(a) ** 2 * np.sin(a)
        return float(lift * np.tan(pitch + a) - drag)

    low, high = 0.0, 0.1
    assert surplus(low) < 0.0 < surplus(high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) < 0.0 else (low, middle)
    path = pitch + low
    drag = 7.5 * np.cos(low) ** 3 + half * 1.05 * np.sin(low) ** 2
    push = GRAVITY * (1005.5 * (0.0696 + ballast) - 70.0)
    speed = np.sqrt(push * np.sin(path) / drag)
    assert found["speed_through_water"][0, 0] == pytest.approx(speed, rel=2e-3)
    assert found["depth_rate"][0, 0] == pytest.approx(-speed * np.sin(path), rel=2e-3)


def test_thinned_rows_of_a_glide_leave_its_ends_out() -> None:
    """Every tenth row is taken from the middle of ten: a glide's first row is its least steady."""
    time = np.arange(2400.0)
    phase = np.where((time // 600) % 2 == 0, 1.0, -1.0)
    since = time % 600
    depth = 25.0 + phase * (0.05 * (since - 300.0))
    log = Log(
        name="flight",
        columns={
            "t": time,
            "depth": depth,
            "pitch": -0.4 * phase,
            "ballast_volume": np.zeros(time.size),
            "water_density": np.full(time.size, 1005.5),
        },
    )
    settings = settings_for("experiment=slocum_glider")
    cases = cases_of(settings)([log], settings, build_robot(settings.robot))
    assert len(cases) >= 3
    for case in cases[1:]:
        rows = case.clock + case.time
        assert np.diff(rows) == pytest.approx(10.0)
        # the smoothed pitch is steep enough 4 s after the turn: half a stride further on
        assert 8.0 <= rows[0] % 600.0 <= 10.0


def test_thrust_follows_a_step_with_the_lag() -> None:
    """Four rotors, k w^2 each; w rises by a step of pulse width as 1 - exp(-t / 0.06 s)."""
    time = np.arange(0.0, 6.0, 1e-3)
    pulse = np.where(time < 3.0, 0.5, 0.7)
    force = np.full(time.size, 9.81)
    columns = {"t": time, "specific_force_x": 0 * force, "specific_force_y": 0 * force}
    columns["specific_force_z"] = force + 1e-3 * np.random.default_rng(1).standard_normal(time.size)
    columns |= {f"angular_velocity_{a}": 0.0 * time for a in "xyz"}
    columns |= {f"motor_pwm_{k}": pulse for k in (1, 2, 3, 4)}
    settings = settings_for(
        "experiment=crazyflie_thrust",
        "effects.rotor_lag.time_constant_change=0.06",
        "train=[]",
        "held_out=[]",
        "compare.stride=1",
    )
    cases = cases_of(settings)(
        [Log(name="f", columns=columns)], settings, build_robot(settings.robot)
    )
    found = predicted(settings, ["gravity", "rotors", "rotor_lag"], cases)
    assert sum(len(c.time) for c in cases) > 4000
    for case, samples in zip(cases, found, strict=True):
        after = np.maximum(case.clock + case.time - 3.0, 0.0)
        speed = 3053.0 * (0.5 + 0.2 * (1.0 - np.exp(-after / 0.06)))
        expected = 4.0 * 1.28e-8 * speed**2 / 0.027
        # smoothed over 11 ms: round near the step, short of samples where the log begins and ends
        clock = case.clock + case.time
        far = (np.abs(clock - 3.0) > 0.02) & (clock > 0.01) & (clock < 5.99)
        assert samples["specific_force"][far, 2] == pytest.approx(expected[far], rel=4e-3)


def test_a_ladder_of_thrust_finds_the_lag_of_the_rotors() -> None:
    """The same step with a lag of 0.06 s in what was measured: the second rung tells it."""
    time = np.arange(0.0, 12.0, 1e-3)
    pulse = np.where((time % 6.0) < 3.0, 0.5, 0.7)
    speed = np.asarray(lfilter([1e-3 / 0.06], [1.0, 1e-3 / 0.06 - 1.0], 3053.0 * (pulse - 0.5)))
    force = 4.0 * 1.28e-8 * (speed + 3053.0 * 0.5) ** 2 / 0.027
    columns = {"t": time, "specific_force_x": 0 * force, "specific_force_y": 0 * force}
    columns["specific_force_z"] = force + 0.02 * np.random.default_rng(1).standard_normal(time.size)
    columns |= {f"angular_velocity_{a}": 0.0 * time for a in "xyz"}
    columns |= {f"motor_pwm_{k}": pulse for k in (1, 2, 3, 4)}
    words = ("experiment=crazyflie_thrust", "train=[]", "held_out=[]", "compare.stride=1")
    settings = settings_for(*words)
    robot = build_robot(settings.robot)
    cases = cases_of(settings)([Log(name="f", columns=columns)], settings, robot)
    static, lagged = fit_variants(settings, robot, cases, step=1e-3)
    fitted = {value.key: value.value for value in lagged.fitted}
    assert fitted["effects.rotor_lag.time_constant_change"] == pytest.approx(0.06, rel=0.03)
    rms = [v.rms("specific_force", held_out=False) for v in (static, lagged)]
    assert rms[1] < 0.5 * rms[0]


def test_a_slow_wave_carries_the_section_along() -> None:
    """Far below resonance heave is the wave; at w^2 = rho g L B / 2 m the held force doubles it."""
    settings = settings_for("experiment=flume_heave")
    cases = []
    for omega in (0.3, 0.6):
        case = bare_case(
            f"w{omega}",
            np.array([0.0]),
            {"heave_response": np.ones((1, 1))},
            {"heave_response": np.ones(1)},
        )
        case.given.update(amplitude=np.array([0.01]), omega=np.array([omega]))
        cases.append(case)
    found = predicted(settings, ["gravity", "buoyancy"], cases)
    stiffness = 1000.0 * GRAVITY * 0.586 * 0.4
    for omega, samples in zip((0.3, 0.6), found, strict=True):
        expected = stiffness / (stiffness - 46.8 * omega**2)
        assert samples["heave_response"].item() == pytest.approx(expected, rel=0.01)


def test_more_mass_raises_the_response_below_resonance() -> None:
    """Added mass of 20 kg at 4 rad/s: c / (c - m w^2) becomes c / (c - (m + 20) w^2) or more."""
    settings = settings_for("experiment=flume_heave", "effects.added_mass.mass_z=20")
    case = bare_case(
        "w4",
        np.array([0.0]),
        {"heave_response": np.ones((1, 1))},
        {"heave_response": np.ones(1)},
    )
    case.given.update(amplitude=np.array([0.005]), omega=np.array([4.0]))
    less, more = (
        predicted(settings, names, [case])[0]["heave_response"].item()
        for names in (["gravity", "buoyancy"], ["gravity", "buoyancy", "added_mass"])
    )
    assert more > less * 1.02


@pytest.mark.parametrize(
    ("experiment", "word", "wrong", "right"),
    [
        ("falling_balls", "rivals=[liner_drag]", "liner_drag", "linear_drag"),
        (
            "slocum_glider",
            "++naming.tolerances={effects.buoyancy.volum_change: 1.0}",
            "volum_change",
            "volume_change",
        ),
        ("falling_balls", "naming.nominal=[gravitty]", "gravitty", "gravity"),
    ],
)
def test_a_name_of_nothing_is_refused(experiment: str, word: str, wrong: str, right: str) -> None:
    """A rival, a tolerance and a nominal effect that are not there: the nearest name is said."""
    settings = settings_for(f"experiment={experiment}", word)
    with pytest.raises(ConfigError, match=rf"{wrong}(.|\n)*{right}"):
        candidates_of_runs(settings, build_robot(settings.robot))


def test_one_run_is_too_few() -> None:
    """None can be held out."""
    time = np.linspace(0.0, 2.0, 60)
    log = Log(name="ball", columns={"t": time, "position_z": 30.0 - 4.9 * time**2})
    settings = settings_for("experiment=falling_balls", "train=[]", "held_out=[]")
    with pytest.raises(ConfigError, match="too few"):
        prepare(settings, [log])


@pytest.mark.parametrize(
    ("experiment", "column", "lacks"),
    [("slocum_glider", "depth", "pitch"), ("crazyflie_thrust", "specific_force_z", "motor_pwm")],
)
def test_a_log_without_a_needed_channel_is_refused(
    experiment: str, column: str, lacks: str
) -> None:
    """The channel is named."""
    log = Log(name="flight", columns={"t": np.arange(9.0), column: np.arange(9.0)})
    settings = settings_for(f"experiment={experiment}")
    with pytest.raises(LogError, match=lacks):
        cases_of(settings)([log], settings, build_robot(settings.robot))
