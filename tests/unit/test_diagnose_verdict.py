"""Rule for verdict and printed words: channels, stated numbers, falling errors, intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Identification
from seals.errors import LogError
from seals.plugins.effects.rotor_drag import DragRotor
from seals.plugins.effects.rotor_lag import RotorLag
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.data.standing import refuse_frozen
from seals.sysid.decision import evidence
from seals.sysid.decision.evidence import EvidenceAnswer, decide
from seals.sysid.decision.moved_numbers import MovedNumber, stated_wrong
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.report.sentence import error_lines, moved_lines, wrong_lines
from seals.sysid.scores.channels import ChannelError, ChannelErrors, band
from seals.sysid.scores.disturbance_level import DisturbanceLevel
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.search import Search

POLICY = DecisionPolicy()
DELAY = "sensor_delay.delay"
MOTIONS = ("linear_drag", "rotor_drag", "angular_drag", "inertia")
"""Effects that only motion shows."""


def moved(
    sigmas: Sequence[float], *, unknown: Sequence[float] | float = 0.1, together: int = 1
) -> EvidenceHypothesis:
    """A stated model whose stated numbers a fit moved by some tolerances of 0.5.

    Some numbers each, such as three coordinates, belong together to one effect.
    """
    single = together == 1
    keys = tuple(
        f"number_{k // together}.value{'' if single else k % together}" for k in range(len(sigmas))
    )
    spread = np.broadcast_to(np.asarray(unknown, dtype=float), (len(keys),)) * 0.5
    precision = np.full(len(keys), 4.0)
    fit = Fit(
        free=(),
        keys=keys,
        values={key: 0.5 * z for key, z in zip(keys, sigmas, strict=True)},
        cost=1000.0,
        misfit=np.full(10, 100.0),
        normal=np.diag(1.0 / spread**2 - precision)[None] * np.ones((10, 1, 1)) / 10.0,
        right=np.zeros((10, len(keys))),
        precision=precision,
        centre=np.zeros(len(keys)),
        penalty=0.0,
    )
    numbers = {key: Parameter(key=key, tolerance=0.5) for key in keys}
    wind = Candidate(name="wind", keys=("wind.size",), reported=("size",))
    late = Candidate(name="sensor_delay", keys=(DELAY,), reported=("delay",))
    known = numbers | {k: Parameter(key=k) for k in ("wind.size", DELAY)}
    moving = [
        Candidate(name=n, keys=(), reported=(), identification=Identification(needs_motion=k))
        for k, n in enumerate(MOTIONS)
    ]
    sets = CandidateSet(effects={}, parameters=known, candidates=(wind, late, *moving))
    sets.__dict__["sensor_delay"] = DELAY
    fitter: Any = SimpleNamespace(
        windows=SimpleNamespace(observed=1000.0, count=10, delay=0.0),
        plant=SimpleNamespace(vehicle=SimpleNamespace(written=False)),
        trajectory=SimpleNamespace(joint_velocity=np.zeros((1, 0))),
        candidate_set=sets,
    )
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)


def names(hypothesis: EvidenceHypothesis, extra: float = 0.0) -> list[str]:
    """Keys of the numbers that are called wrong."""
    return [m.key for m in stated_wrong(hypothesis, extra=extra)]


@pytest.mark.parametrize("together", [pytest.param(1, marks=pytest.mark.thorough), 3])
def test_an_honest_data_sheet_is_seldom_called_wrong(together: int) -> None:
    """Of 2,000 data sheets with 30 numbers that keep their tolerances one in a hundred at most."""
    rng = np.random.default_rng(7)
    sheets = rng.standard_normal((2000, 30)) * 0.995
    told = [bool(names(moved(list(sheet), together=together))) for sheet in sheets]
    assert 0.001 < np.mean(told) < 0.01


def test_coordinates_that_a_bias_moves_together_do_not_excuse_each_other() -> None:
    """3.0, -2.25 and 1.3 tolerances beside numbers that keep theirs well."""
    quiet, bias = [0.1] * 12, [3.0, -2.25, 1.3]
    assert names(moved([*quiet, *bias])) == []
    told = names(moved([*quiet, *bias], together=3))
    assert told == ["number_4.value0", "number_4.value1"]


@pytest.mark.parametrize(
    ("sigmas", "wrong"),
    [
        ([0.1] * 25 + [-20.2], True),
        ([0.1] * 25 + [2.0], True),
        ([1.0, -1.0] * 12 + [2.5], False),
        ([1.0, -1.0] * 12 + [4.5], True),
        ([3.0, -3.0] * 12 + [5.0], False),
    ],
)
def test_a_number_is_wrong_that_lies_farther_off_than_the_others_allow(
    sigmas: list[float], wrong: bool
) -> None:
    """The odd one among numbers that keep well within their tolerances, or one far beyond all."""
    expected = [f"number_{len(sigmas) - 1}.value"] if wrong else []
    assert names(moved(sigmas)) == expected


def test_a_number_that_the_log_does_not_know_is_not_called_wrong() -> None:
    """Moved by noise, not by data: its uncertainty after the fit is three quarters of before."""
    unknown = [0.1] * 25 + [0.75]
    assert names(moved([0.1] * 25 + [5.0], unknown=unknown)) == []
    assert names(moved([0.1] * 25 + [5.0])) != []
    assert names(moved([0.1] * 25 + [5.0]), extra=50.0) == []


def channel(stated: float, calibrated: float, after: float) -> ChannelErrors:
    """Errors of one channel, whose band ends at 1.2."""
    one = ChannelError(
        name="position x",
        channel="position",
        unit="m",
        band=1.2,
        stated=stated,
        calibrated=calibrated,
        after=after,
        rms=(0.01 * stated, 0.01 * calibrated, 0.01 * after),
    )
    return ChannelErrors(errors=(one,))


def answer(
    monkeypatch: pytest.MonkeyPatch,
    errors: ChannelErrors,
    *,
    names: Sequence[str] = (),
    value: float = 1.0,
    stated: float = 3.0,
    sigmas: Sequence[float] = (0.1,) * 26,
    simulated_step: float | None = None,
    gains: Mapping[str, float] = MappingProxyType({"wind": 1e3}),
    flow: bool = False,
    covered: Sequence[str] = (),
) -> EvidenceAnswer:
    """Decide on a model with some effects of one size."""
    calm = DisturbanceLevel(level=1.0, gain=0.0, allowance=0.0, between=1.0)
    monkeypatch.setattr(evidence, "disturbance_level", lambda best: calm)
    monkeypatch.setattr(evidence, "self_check", lambda best: None)

    def expected(base: Any, *, more: float = 1.0) -> dict[str, float]:
        return {k: v if k in covered else more * v for k, v in gains.items()}

    monkeypatch.setattr(evidence, "expected_gains", expected)
    monkeypatch.setattr(evidence, "channel_errors", lambda *given: errors)
    monkeypatch.setattr(evidence, "stated_misfit", lambda nominal: stated)
    monkeypatch.setattr(evidence, "held_out_misfit", lambda best: 1.0)
    monkeypatch.setattr(evidence, "surface_model_error", lambda *given: None)
    base = moved(sigmas)
    known = base.fitter.candidate_set
    candidates = tuple(c for c in known.candidates if c.name in names)
    if flow:
        candidates = tuple(
            replace(c, identification=Identification(gusty=True)) for c in candidates
        )
    keys = (*base.fit.keys, *(k for c in candidates for k in c.keys))
    count = len(keys)
    normal = np.zeros((10, count, count))
    normal[:, : len(base.fit.keys), : len(base.fit.keys)] = base.fit.normal
    free = [k for c in candidates for k in c.keys]
    normal[:, len(base.fit.keys) :, len(base.fit.keys) :] = 10.0 * np.eye(len(free))
    fit = replace(
        base.fit,
        free=tuple(free),
        keys=keys,
        values={**base.fit.values, **dict.fromkeys(free, value)},
        normal=normal,
        right=np.zeros((10, count)),
        precision=np.append(base.fit.precision, np.full(len(free), 1e-6)),
        centre=np.zeros(count),
    )
    best = replace(base, candidates=candidates, fit=fit, score=500.0) if candidates else base
    problem: Any = SimpleNamespace(
        policy=POLICY,
        impact=False,
        samples=SimpleNamespace(posed=True, logs=()),
        vehicle=SimpleNamespace(
            servo={}, has_water=False, simulated_step=simulated_step, assumed=False
        ),
        plant=None,
    )
    rounds = ((best,),) if candidates else ()
    return decide(problem, Search(nominal=base, best=best, rounds=rounds))


def test_a_channel_outside_its_band_is_not_nothing_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A position eight times off, under a pooled misfit of one."""
    assert answer(monkeypatch, channel(1.1, 1.0, 1.0)).verdict is Verdict.nothing_missing
    said = answer(monkeypatch, channel(8.1, 8.1, 8.1))
    assert said.verdict is Verdict.cannot_tell
    assert "position x is 8.1 times its expected error" in said.reasons[0]


@pytest.mark.parametrize(("drag", "verdict"), [(40.0, "nothing_missing"), (4.0, "cannot_tell")])
def test_few_effects_that_a_log_could_not_show_hinder_no_verdict(
    monkeypatch: pytest.MonkeyPatch, drag: float, verdict: str
) -> None:
    """A slow flight shows every drag and no inertia; one that hovers shows neither."""
    motions = dict(zip(MOTIONS, (drag, drag, 80.0, 3.0), strict=True))
    said = answer(monkeypatch, channel(1.1, 1.0, 1.0), gains=motions)
    assert said.verdict.value == verdict
    assert "inertia" in said.blind


def test_what_a_stated_tolerance_covers_hinders_no_verdict(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a vehicle whose drag is stated within 30 %, a smaller drag is shown by no motion."""
    motions = dict(zip(MOTIONS, (4.0, 4.0, 80.0, 3.0), strict=True))
    drags = MOTIONS[:2]
    said = answer(monkeypatch, channel(1.1, 1.0, 1.0), gains=motions, covered=drags)
    assert said.verdict is Verdict.nothing_missing
    assert said.blind == ("inertia",)


def test_a_moved_number_is_told_and_never_nothing_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rotors stated reversed: a reaction torque 20 tolerances apart explains the log."""
    said = answer(monkeypatch, channel(9.0, 1.0, 1.0), sigmas=(*(0.1,) * 25, -20.2))
    assert said.verdict is Verdict.cannot_tell
    assert [round(m.sigmas, 1) for m in said.stated_wrong] == [-20.2]
    assert "too far off to be chance" in said.reasons[0]


@pytest.mark.parametrize(
    ("after", "verdict"),
    [(1.0, Verdict.named), (1.45, Verdict.named), (2.1, Verdict.none_of_these)],
)
def test_no_name_where_a_channel_is_left_over(
    monkeypatch: pytest.MonkeyPatch, after: float, verdict: Verdict
) -> None:
    """A ramp taken for a step leaves the height twice its expected error."""
    said = answer(monkeypatch, channel(3.0, 3.0, after), names=["wind"])
    assert said.verdict is verdict
    assert said.claims or "position x is left 2.1 times its expected error" in said.reasons[0]


def test_a_channel_left_over_by_a_simulation_may_be_its_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The error of a coarse step is no unknown effect: the answer says which step to take."""
    said = answer(monkeypatch, channel(6.4, 6.4, 2.1), names=["wind"], simulated_step=0.004)
    assert said.verdict is Verdict.cannot_tell
    assert "a run with time.step=0.001 would tell" in said.reasons[0]
    alone = answer(monkeypatch, channel(8.1, 8.1, 8.1), simulated_step=0.004)
    assert alone.verdict is Verdict.cannot_tell
    assert "a run with time.step=0.001 would tell" in alone.reasons[0]


def test_no_name_without_an_error_that_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the stated model to the one with the effect the held-out misfit must fall by 1 %."""
    off = channel(1.4, 1.4, 1.0)
    said = answer(monkeypatch, off, names=["wind"], stated=1.009)
    assert said.verdict is Verdict.cannot_tell
    assert "decreases by less than 1 %" in said.reasons[0]
    assert answer(monkeypatch, off, names=["wind"], stated=1.1).verdict is Verdict.named


@pytest.mark.parametrize(
    ("effects", "stated", "fitted", "after", "falls"),
    [
        (1, 1.0, 0.99, 0.985, True),
        (2, 1.0, 0.99, 0.985, False),
        (2, 1.0, 0.99, 0.975, True),
        # a wrong number that is named had been taken over by the fit
        (1, 50.0, 1.0, 1.001, True),
        # much is left, and the fitted numbers predict better
        (1, 1.37, 1.33, 1.34, False),
        (1, 1.37, 1.34, 1.33, True),
    ],
)
def test_each_effect_lowers_the_error(
    effects: int,
    stated: float,
    fitted: float,
    after: float,
    falls: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two effects need twice the fall; where much is left, the fitted numbers count as well."""
    base = moved([0.1])
    candidates = base.fitter.candidate_set.candidates[:effects]
    found: Any = SimpleNamespace(best=replace(base, candidates=candidates), nominal=base)
    misfits = {effects: after, 0: fitted}
    monkeypatch.setattr(evidence, "stated_misfit", lambda nominal: stated)
    monkeypatch.setattr(evidence, "held_out_misfit", lambda h: misfits[len(h.candidates)])
    assert evidence._falls(found) is falls


def test_no_tolerance_is_taken_for_less_than_half() -> None:
    """A number within 1.7 tolerances is not wrong, however well the others keep theirs."""
    assert names(moved([0.01] * 25 + [1.7])) == []
    assert names(moved([0.01] * 25 + [1.95])) == ["number_25.value"]


def test_a_flow_that_lowers_no_error_is_not_steady(monkeypatch: pytest.MonkeyPatch) -> None:
    """It lowers one channel to a tenth, and the misfit, beside gusts, by 0.9 %."""
    monkeypatch.setattr(evidence, "weak_flows", lambda *given: [])
    monkeypatch.setattr(evidence, "changing_flow", lambda *given: "")
    errors = channel(3.0, 3.0, 0.3)
    said = answer(monkeypatch, errors, names=["wind"], stated=1.009, flow=True)
    assert said.verdict is Verdict.none_of_these
    assert "small compared with its gusts" in said.reasons[0]


def test_nothing_is_missing_where_the_stated_model_predicts_as_well(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every channel of the stated model in its band, and an error that hardly falls."""
    said = answer(monkeypatch, channel(1.0, 1.0, 1.0), names=["payload"], stated=1.009)
    assert said.verdict is Verdict.nothing_missing


def test_an_interval_that_holds_zero_is_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """An effect of a hundredth of its own uncertainty."""
    said = answer(monkeypatch, channel(3.0, 3.0, 1.0), names=["wind"], value=1e-3)
    assert said.verdict is Verdict.cannot_tell
    assert "hold zero" in said.reasons[0]


def test_inertial_sensors_ahead_of_the_pose_are_bad_data(monkeypatch: pytest.MonkeyPatch) -> None:
    """A delay of -27 ms is a pose that comes late, not a sensor without delay."""
    said = answer(monkeypatch, channel(3.0, 3.0, 1.0), names=["sensor_delay"], value=-0.027)
    assert said.verdict is Verdict.bad_data
    assert "27 ms late" in said.reasons[0]


def test_the_band_follows_the_number_of_independent_samples() -> None:
    """20 s of gusts of 0.35 s: 57 samples, three standard errors of sqrt(2 / 57) above one."""
    windows: Any = SimpleNamespace(
        count=20,
        length=100,
        samples=SimpleNamespace(step=0.01),
        vehicle=SimpleNamespace(gust_time=0.35, gust=np.array([0.1, 0.0])),
    )
    expected = math.sqrt(1.0 + 3.0 * math.sqrt(2.0 * 0.35 / 20.0))
    assert band(windows, 2000, standard_errors=3.0) == pytest.approx(expected)
    calm = SimpleNamespace(gust_time=0.35, gust=np.zeros(2))
    windows.vehicle = calm
    assert band(windows, 2000, standard_errors=3.0) > expected


def test_a_stated_lag_of_zero_leaves_a_plausible_size() -> None:
    """A share of zero is no size: no vehicle without a stated lag ever got the name."""
    subject: Any = SimpleNamespace(
        lag=np.zeros(4), tolerance={"rotor_time_constant": 0.01}, spread=lambda name: 0.0
    )
    freed = RotorLag.additions("rotor_lag", subject)[0].parameters["time_constant_change"]
    assert freed.scale == pytest.approx(0.03)
    subject.lag = np.full(4, 0.05)
    freed = RotorLag.additions("rotor_lag", subject)[0].parameters["time_constant_change"]
    assert freed.scale == pytest.approx(0.05)


def test_a_stated_rotor_drag_may_be_too_large() -> None:
    """It may fall to zero; a change within two tolerances of drags is no effect."""
    own = DragRotor(coefficient=0.1, exponent=0.5, typical=1.2)
    subject: Any = SimpleNamespace(
        lag=np.zeros(4), rotors=True, effects={"rotor_h": own}, weight=5.0, spread=lambda name: 0.3
    )
    (addition,) = DragRotor.additions("rotor_drag", subject)
    size = addition.parameters["coefficient"]
    assert size.bounds[0] == pytest.approx(-0.1)
    assert size.least == pytest.approx(0.06)
    assert (addition.effect.exponent, addition.effect.typical) == (0.5, 1.2)
    subject.effects = {}
    (addition,) = DragRotor.additions("rotor_drag", subject)
    assert addition.parameters["coefficient"].bounds[0] == 0.0


def test_the_printed_error_has_three_steps() -> None:
    """Stated model, its numbers within their tolerances, and with the effect."""
    table = {
        "effects": [{"name": "wind"}],
        "held_out_error": {"stated": 6.83, "before": 0.984, "after": 0.98},
        "channels": [e.to_dict() for e in channel(8.0, 7.0, 1.0).errors],
    }
    assert error_lines(table) == [
        "Error (stated model -> numbers within their tolerances -> with wind):",
        "  held-out misfit 6.83 -> 0.984 -> 0.98 (floor 1)",
        "  position x 0.08 -> 0.07 -> 0.01 m within a second",
    ]


def test_noise_that_is_stated_too_large_is_told() -> None:
    """A third of it is left: smaller effects hide in the rest."""
    table = {
        "effects": [],
        "held_out_error": {"stated": 0.4, "before": 0.2, "after": 0.2},
        "channels": [e.to_dict() for e in channel(0.8, 0.33, 0.33).errors],
    }
    assert error_lines(table)[-1].startswith(
        "  stated noise or gusts are too large: the residual is 0.33 (position) of"
    )


def test_a_wrong_number_is_printed_with_what_to_do() -> None:
    """Both values, how far, the sign, and the command that calibrates it."""
    number = {
        "what": "actuators.rotors.torque_coefficient",
        "calibrates": True,
        "words": "reaction torque of the rotors",
        "stated": 1.36e-7,
        "found": -1.39e-7,
        "unit": "N m/(rad/s)^2",
        "sigma": -20.2,
    }
    first, last = wrong_lines([number])
    assert "stated 1.36e-07 N m/(rad/s)^2, found -1.39e-07" in first
    assert "20.2 tolerances apart; the sign is opposite" in first
    assert "seals calibrate log=FOLDER 'parameters=[actuators.rotors.torque_coefficient]'" in last
    assert wrong_lines([]) == []
    assert wrong_lines([{**number, "calibrates": False}])[1] == "  measure again"


def test_reversed_rotors_are_told_as_directions() -> None:
    """No calibration may give that number: the line of the robot's file to change is printed."""
    number = {
        "what": "actuators.rotors.direction",
        "calibrates": False,
        "file": "robot.yaml",
        "words": "directions of rotors",
        "by": "reaction torque of the rotors",
        "stated": 1.36e-7,
        "found": -1.39e-7,
        "unit": "N m/(rad/s)^2",
        "sigma": -20.2,
        "set": [-1.0, 1.0],
    }
    mass = {**number, "what": "mass", "calibrates": True, "words": "mass", "stated": 1.0}
    del mass["set"], mass["by"]
    first, _, change, last = wrong_lines([number, mass], "log=c robot=quad")
    assert "directions of rotors (actuators.rotors.direction), by the reaction torque" in first
    assert change.endswith("in robot.yaml, actuators.rotors: direction: [-1.0, 1.0]")
    assert last == "  then: seals diagnose log=c robot=quad"


@pytest.mark.parametrize(("moves", "level", "told"), [(1.0, 0.3, True), (0.0, 0.3, False)])
def test_a_frozen_sensor_is_bad_data(moves: float, level: float, told: bool) -> None:
    """A gyroscope that repeats one value for seconds while the vehicle moves; at rest it may."""
    time = np.arange(0.0, 4.0, 0.01)
    rng = np.random.default_rng(3)
    turning = 0.01 * rng.standard_normal((400, 3))
    turning[100:300, 1] = level
    samples: Any = SimpleNamespace(
        time=time,
        channels={
            "position": moves * time[:, None] * np.ones(3) + 0.003 * rng.standard_normal((400, 3)),
            "angular_velocity": turning,
        },
    )
    vehicle: Any = SimpleNamespace(sigma={"position": 0.003})
    log: Any = SimpleNamespace(meta={})
    if told:
        with pytest.raises(
            LogError, match=r"angular_velocity_y reads 0\.3 without change for 2\.0 s"
        ):
            refuse_frozen(log, samples, vehicle)
        log.meta["simulated"] = {}
    refuse_frozen(log, samples, vehicle)


def test_a_pose_that_is_held_while_the_vehicle_moves_is_bad_data() -> None:
    """As motion capture does where it loses the markers; at rest it may repeat itself."""
    time = np.arange(0.0, 4.0, 0.01)
    rng = np.random.default_rng(4)
    place = time[:, None] * np.ones(3) + 0.003 * rng.standard_normal((400, 3))
    place[100:300] = place[100]
    turning = 0.5 * np.sin(3.0 * time)[:, None] * np.ones(3) + 0.01 * rng.standard_normal((400, 3))
    samples: Any = SimpleNamespace(
        time=time, channels={"position": place, "angular_velocity": turning}
    )
    vehicle: Any = SimpleNamespace(sigma={"position": 0.003, "angular_velocity": 0.01})
    log: Any = SimpleNamespace(meta={})
    with pytest.raises(LogError, match=r"position stands without change for 2\.0 s .* was held"):
        refuse_frozen(log, samples, vehicle)
    # one component alone may stand: the motion is planar
    place[100:300, 0] += 0.003 * rng.standard_normal(200)
    refuse_frozen(log, samples, vehicle)


def test_how_far_a_number_is_determined() -> None:
    """Nothing is left to say of one whose uncertainty is that of its tolerance."""
    number = MovedNumber(key="a.b", change=1.0, sigmas=2.0, unknown=1.0)
    assert number.determined == 0.0


@pytest.mark.parametrize(
    ("stated", "verdict", "told"),
    [
        (38.0, Verdict.nothing_missing, [2, 1]),
        (1.0, Verdict.nothing_missing, []),
        (38.0, Verdict.none_of_these, []),
    ],
)
def test_numbers_that_took_the_error_away_are_told(
    monkeypatch: pytest.MonkeyPatch, stated: float, verdict: Verdict, told: list[int]
) -> None:
    """A drag stated twice too high within its tolerance; two numbers that the log leaves open."""
    base = moved([0.2, 1.2, -1.7, 1.5], unknown=[0.1, 0.1, 0.1, 0.9])
    monkeypatch.setattr(
        Diagnosis, "_moved", lambda self, numbers: [int(m.key[len("number_")]) for m in numbers]
    )
    level = DisturbanceLevel(level=1.0, gain=0.0, allowance=0.0, between=1.0)
    found = Diagnosis(
        problem=SimpleNamespace(policy=POLICY),  # type: ignore[arg-type]
        search=Search(nominal=base, best=base),
        answer=EvidenceAnswer(verdict=verdict, claims=(), disturbance_level=level, explained=1.0),
        held_out={"stated": stated, "before": 0.97, "after": 0.97, "noise_floor": 1.0},
        seconds=1.0,
    )
    assert found.within_tolerance() == told


def test_a_correction_of_the_stated_model_is_offered() -> None:
    """Number, both values, and the command that writes the found one."""
    number = {
        "what": "effects.drag.coefficient_y",
        "calibrates": True,
        "words": "quadratic drag in water, y",
        "stated": 434.0,
        "found": 216.7,
        "unit": "N s^2/m^2",
        "sigma": -1.7,
    }
    first, last = moved_lines([number], "log=dive")
    assert first == (
        "  within its tolerance: quadratic drag in water, y (effects.drag.coefficient_y): "
        "stated 434 N s^2/m^2, found 216.7 N s^2/m^2, 1.7 tolerances apart"
    )
    assert last.endswith("seals calibrate log=dive 'parameters=[effects.drag.coefficient_y]'")
    assert moved_lines([{**number, "calibrates": False}])[1:] == []
    assert moved_lines([]) == []
