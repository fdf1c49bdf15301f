"""Change detection of a multirotor, from its flights compared with healthy ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hover_balance import COMMON, SIZES, Airframe, Explanation, explanations
from seals.arrays import Floats
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict

OTHERS_COUNT = 2.0
"""Flights of one's own that the scatter of other vehicles of the type is worth."""
RULED_OUT = 6.0
"""Strong evidence (Kass and Raftery 1995), by which one explanation rules out another [2 ln B]."""
FALSE_ALARMS = 0.025
"""Share of further healthy flights that may be taken for changed ones: half of the 5 % that are
allowed, for sessions differ more than the flights of one."""
_DRAWS = 400
"""Healthy flights drawn to find the evidence that this share of them exceeds."""
PLAUSIBLE = 0.1
"""Plausible relative loss of a rotor, as `WeakRotor` declares it: the prior of estimated losses."""
_MOST = 3
_ROLL, _PITCH, _YAW = 1, 2, 3


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Mean commands of one flight in hover and slow travel, in units of nominal thrust.

    Args:
        vehicle: whose it is.
        legs: mean commands on the legs there and back, shape (2, n).
        travel: directions of the two legs, body axes, unit vectors, shape (2, 2).
    """

    vehicle: str
    legs: Floats
    travel: Floats

    @property
    def mean(self) -> Floats:
        """Commands, shape (n,)."""
        return np.asarray(self.legs.mean(axis=0))

    @property
    def turn(self) -> Floats:
        """Change from the first leg to the second, shape (n,)."""
        return np.asarray(self.legs[1] - self.legs[0])


@dataclass(frozen=True, kw_only=True)
class Changed:
    """Change that a flight shows against healthy ones.

    Args:
        verdict: of the comparison.
        names: explanations, best first, three at most.
        evidence: of the best against a healthy flight [2 ln B].
        losses: estimated lost share of thrust, shape (n,).
        scores: of every explanation.
    """

    verdict: Verdict
    names: tuple[str, ...]
    evidence: float
    losses: Floats
    scores: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Healthy:
    """Reference from healthy flights of one vehicle: mean commands and their scatter.

    The scatter is Student's t in each mode of the vehicle (thrust, roll, pitch, yaw): variances
    from few flights are themselves uncertain, each by itself. Roll and pitch share one, for a
    battery or a deck shifts either way; other vehicles of the type count as `OTHERS_COUNT` flights
    more.

    Args:
        commands: mean, shape (n,).
        turn: mean change between the legs, shape (n,).
        variance: of a further flight's mean commands by mode, shape (n,).
        degrees: of freedom of these variances, shape (n,).
        turn_variance: of the yaw mode of the change between the legs.
        turn_degrees: of freedom of that.
    """

    commands: Floats
    turn: Floats
    variance: Floats
    degrees: Floats
    turn_variance: float
    turn_degrees: float


def modes_of(frame: Airframe) -> Floats:
    """Return the unit vectors of thrust, roll, pitch and yaw among the commands, shape (4, n)."""
    wrench = frame.wrench_of()
    return np.asarray(wrench / np.linalg.norm(wrench, axis=1, keepdims=True))


def healthy_of(frame: Airframe, flights: Sequence[Balance], vehicle: str) -> Healthy:
    """Return the healthy state of a vehicle from healthy flights of it and of others.

    Raises:
        ValueError: the vehicle has no flight, or no vehicle has two.
    """
    modes = modes_of(frame)
    by_vehicle: dict[str, list[Balance]] = {}
    for flight in flights:
        by_vehicle.setdefault(flight.vehicle, []).append(flight)
    own = by_vehicle.get(vehicle, [])
    spread = {v: _squares(modes, [f.mean for f in some]) for v, some in by_vehicle.items()}
    count = {v: len(some) - 1 for v, some in by_vehicle.items()}
    if not own or not any(count.values()):
        raise ValueError(f"vehicle '{vehicle}' has too few healthy flights to compare with")
    beside = sum(count.values()) - count[vehicle]
    of_others = sum((s for v, s in spread.items() if v != vehicle), np.zeros(len(modes)))
    borrowed = min(OTHERS_COUNT, float(beside))
    weight = count[vehicle] + borrowed
    variance = (spread[vehicle] + borrowed * of_others / max(beside, 1)) / weight
    degrees = np.full(len(modes), weight)
    degrees[[_ROLL, _PITCH]] *= 2.0
    turns = sum(_squares(modes, [f.turn for f in some])[_YAW] for some in by_vehicle.values())
    further = 1.0 + 1.0 / len(own)
    return Healthy(
        commands=np.mean([f.mean for f in own], axis=0),
        turn=np.mean([f.turn for f in own], axis=0),
        variance=variance * further,
        degrees=degrees,
        turn_variance=float(turns) / sum(count.values()) * further,
        turn_degrees=float(sum(count.values())),
    )


def _squares(modes: Floats, rows: Sequence[Floats]) -> Floats:
    """Sums of squares about the mean by mode; roll and pitch share theirs."""
    values = np.asarray(rows) @ modes.T
    squares = ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    squares[[_ROLL, _PITCH]] = squares[[_ROLL, _PITCH]].mean()
    return np.asarray(squares)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Reference with which flights of a vehicle are compared.

    Args:
        frame: its rotors.
        healthy: its healthy state.
        known: what may have changed.
        least: evidence that a change needs [2 ln B]; see `comparison_of`.
    """

    frame: Airframe
    healthy: Healthy
    known: tuple[Explanation, ...]
    least: float


def comparison_of(frame: Airframe, healthy: Healthy) -> Comparison:
    """Return the comparison with a healthy state.

    The evidence that a change needs is what `FALSE_ALARMS` of the further healthy flights would
    show for some explanation, drawn from the scatter itself; a common change of thrust, which air
    and battery make, is no alarm.
    """
    known = tuple(explanations(frame, healthy.commands))
    asked = [one for one in known if one.name != COMMON]
    modes = modes_of(frame)
    random = np.random.default_rng(0)
    drawn = random.standard_t(healthy.degrees, size=(_DRAWS, len(modes)))
    changes = (drawn * np.sqrt(healthy.variance)) @ modes
    best = [max(_scores(frame, healthy, asked, change).values()) for change in changes]
    least = float(np.quantile(best, 1.0 - FALSE_ALARMS))
    return Comparison(frame=frame, healthy=healthy, known=known, least=least)


def _scores(
    frame: Airframe, healthy: Healthy, known: Sequence[Explanation], change: Floats
) -> dict[str, float]:
    modes = modes_of(frame)
    before = change @ modes.T
    return {
        one.name: _gain((change - one.changes) @ modes.T, before, healthy.variance, healthy.degrees)
        for one in known
    }


def compared(beside: Comparison, flight: Balance, policy: DecisionPolicy) -> Changed:
    """Return the change of a vehicle since its healthy flights.

    Equation:
        2 ln B = 2 ln (mean over the sizes of L(d - c) / L(d)) with d the change of the commands,
        c that of an explanation, L the product of Student's t over the modes with the scatter of
        healthy flights.
    """
    frame, healthy = beside.frame, beside.healthy
    change = flight.mean - healthy.commands
    scores = _scores(frame, healthy, beside.known, change)
    dragged = {k: _drag(frame, healthy, flight, k) for k in range(healthy.commands.size)}
    asked = RULED_OUT + policy.evidence_further
    for k, evidence in dragged.items():
        # what trails on the floor is an effect beside its weight
        if evidence >= asked:
            scores[f"slung_load@{k + 1}"] = scores[f"payload@{k + 1}"] + evidence
    within = {one.name: one.within for one in beside.known}
    best = max(scores.values())
    names = _near(scores, within, RULED_OUT) if best >= beside.least else ()
    verdict = Verdict.ambiguous if len(names) > 1 else Verdict.named
    return Changed(
        verdict=verdict if names else Verdict.nothing_missing,
        names=names,
        evidence=best,
        losses=_losses(modes_of(frame), healthy, change),
        scores=scores,
    )


def _gain(left: Floats, before: Floats, variance: Floats, degrees: Floats) -> float:
    """Evidence of equally probable changes, rows of what they leave, over none [2 ln B]."""
    power = 0.5 * (degrees + 1.0)
    gains = np.log1p(before**2 / (variance * degrees)) @ power
    gains = gains - np.log1p(left**2 / (variance * degrees)) @ power
    most = float(gains.max())
    return 2.0 * (most + float(np.log(np.exp(gains - most).mean())))


def _drag(frame: Airframe, healthy: Healthy, flight: Balance, rotor: int) -> float:
    """Evidence that something hung at a rotor drags against the travel.

    A drag F at the rotor turns the vehicle about z by -F (x t_y - y t_x), t the direction of
    travel, and so the other way on the way back. F is a share of the weight times a friction.
    """
    x, y = frame.position[rotor, :2]
    torque = -(x * flight.travel[:, 1] - y * flight.travel[:, 0])
    yaw = np.linalg.pinv(frame.wrench_of())[:, _YAW]
    mode = modes_of(frame)[_YAW]
    per_force = float((-torque[1] + torque[0]) * (yaw @ mode))
    change = (flight.turn - healthy.turn) @ mode
    left = change - per_force * float(healthy.commands.sum()) * SIZES**2
    variance, degrees = np.array([healthy.turn_variance]), np.array([healthy.turn_degrees])
    return _gain(left[:, None], np.array([change]), variance, degrees)


def _near(
    scores: Mapping[str, float], within: Mapping[str, tuple[str, ...]], gap: float
) -> tuple[str, ...]:
    """Explanations that none rules out; a second fault that the evidence does not ask for goes."""
    ordered = sorted(scores, key=lambda n: -scores[n])
    near = [n for n in ordered if scores[n] > scores[ordered[0]] - gap]
    asked = [n for n in near if all(scores[one] < scores[n] for one in within.get(n, ()))]
    return tuple(asked[:_MOST])


def _losses(modes: Floats, healthy: Healthy, change: Floats) -> Floats:
    """Most probable lost shares of thrust, all rotors at once, given the scatter."""
    scatter = modes.T @ np.diag(healthy.variance) @ modes
    prior = np.diag((PLAUSIBLE * healthy.commands) ** 2)
    more = prior @ np.linalg.solve(prior + scatter, change)
    return np.asarray(more / (healthy.commands + more))
