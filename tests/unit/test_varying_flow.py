"""A wind for a time that is no stronger than its own gusts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.plugins.effects.wind import Wind
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision import evidence, reasons_against
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.reasons_against import changing_flow, varying_flow
from seals.sysid.scores.channels import ChannelError, ChannelErrors

MASS, ROWS = 2.0, 100


def asked(force: float, gust: float, *, timed: bool = True) -> str:
    """Answer to a wind whose force acts in the second half of a log [N], beside gusts [N]."""
    late = np.arange(ROWS) >= ROWS // 2

    def prediction(values: dict[str, float]) -> Any:
        reading = np.zeros((ROWS, 6))
        reading[late, 3] = values["wind.velocity_x"] * force / MASS
        return SimpleNamespace(reading=reading)

    activity: Any = SimpleNamespace(weights=lambda samples: late.astype(float))
    wind = Candidate(
        name="wind",
        keys=("wind.velocity_x",),
        identification=Wind.identification,
        activity=activity if timed else None,
    )
    problem: Any = SimpleNamespace(
        vehicle=SimpleNamespace(
            gust=np.array([gust, 0.0]), robot=SimpleNamespace(mass=np.array([MASS]))
        ),
        samples=None,
        policy=DecisionPolicy(),
    )
    best: Any = SimpleNamespace(
        candidates=(wind,),
        fitter=SimpleNamespace(prediction=prediction),
        fit=SimpleNamespace(values={"wind.velocity_x": 1.0}),
    )
    return varying_flow(problem, best)


@pytest.mark.parametrize(("force", "varies"), [(0.19, True), (0.21, False), (1.0, False)])
def test_a_wind_for_a_time_must_be_twice_its_gusts(force: float, varies: bool) -> None:
    """A turbulence intensity of one half, with gusts of 0.1 N, over the rows where it acts."""
    said = asked(force, 0.1)
    assert bool(said) is varies
    assert not varies or f"{force:.2g} N, is no more than 1.9 times its gusts of 0.1 N" in said


def test_a_wind_throughout_or_without_gusts_is_left_alone() -> None:
    """A weak one that blows all the time may be an average of nothing."""
    assert not asked(0.05, 0.1, timed=False)
    assert not asked(0.05, 0.0)


@pytest.mark.parametrize(
    ("gains", "logs", "gust", "said"),
    [
        ((-21.0, -18.0, -20.0, -22.0), 1, 0.5, ""),
        ((-6.0, -11.0, 17.0, 1.4), 1, 0.5, "12 to 18 s than before and after explains 17 more"),
        ((-6.0, -11.0, 17.0, 1.4), 2, 0.5, ""),
        ((-6.0, -11.0, 17.0, 1.4), 1, 0.2, ""),
    ],
)
def test_a_wind_throughout_is_the_same_in_every_part(
    monkeypatch: pytest.MonkeyPatch, gains: tuple[float, ...], logs: int, gust: float, said: str
) -> None:
    """Beside a steady one, a second wind loses its Occam factor; a strong one may vary."""
    asked_for = iter(gains)
    monkeypatch.setattr(reasons_against, "candidate_keys", lambda candidates: ())
    monkeypatch.setattr(
        reasons_against,
        "scored",
        lambda *given: SimpleNamespace(score=50.0 + next(asked_for)),
    )
    fitter: Any = SimpleNamespace(
        fit=lambda keys, start: None,
        prediction=lambda values: SimpleNamespace(
            reading=np.full((ROWS, 6), values["wind.velocity_x"] / MASS / np.sqrt(3.0))
        ),
    )
    fitter.acting = lambda candidates: fitter
    wind = Candidate(name="wind", keys=("wind.velocity_x",), identification=Wind.identification)
    problem: Any = SimpleNamespace(
        samples=SimpleNamespace(time=np.linspace(0.0, 18.0, ROWS), logs=("log",) * logs),
        vehicle=SimpleNamespace(
            gust=np.array([gust, 0.0]), robot=SimpleNamespace(mass=np.array([MASS]))
        ),
        policy=DecisionPolicy(),
    )
    best: Any = SimpleNamespace(
        candidates=(wind,),
        fitter=fitter,
        fit=SimpleNamespace(values={"wind.velocity_x": 1.0}),
        score=50.0,
    )
    found = changing_flow(problem, best, best)
    assert found.endswith(said) if said else not found


@pytest.mark.parametrize(
    ("gust", "after", "left"), [(0.6, 1.4, True), (0.4, 1.4, False), (0.6, 1.2, False)]
)
def test_a_weak_wind_leaves_no_channel_outside_its_band(
    gust: float, after: float, left: bool
) -> None:
    """A wind of 1 N: with gusts of 0.6 N what a channel keeps beyond its band of 1.26 varies."""
    wind = Candidate(name="wind", keys=("wind.velocity_x",), identification=Wind.identification)

    def prediction(values: dict[str, float]) -> Any:
        return SimpleNamespace(
            reading=np.full((ROWS, 6), values["wind.velocity_x"] / MASS / np.sqrt(3.0))
        )

    problem: Any = SimpleNamespace(
        vehicle=SimpleNamespace(
            gust=np.array([gust, 0.0]), servo=None, robot=SimpleNamespace(mass=np.array([MASS]))
        ),
        policy=DecisionPolicy(),
    )
    best: Any = SimpleNamespace(
        candidates=(wind,),
        fitter=SimpleNamespace(prediction=prediction),
        fit=SimpleNamespace(values={"wind.velocity_x": 1.0}),
    )
    error = ChannelError(
        name="position x",
        channel="position",
        unit="m",
        band=1.26,
        stated=1.9,
        calibrated=1.7,
        after=after,
        rms=(0.04, 0.04, 0.03),
    )
    said = evidence._left_in_channels(problem, best, ChannelErrors(errors=(error,)))
    assert bool(said) is left
