"""Change of a vehicle since its healthy flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.stats import t as student
from scipy.stats.qmc import Sobol

from seals.arrays import Floats
from seals.errors import LogError
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.healthy_flights.balance import Balance, DriveLayout
from seals.sysid.healthy_flights.explanations import LARGEST, SMALLEST, Explanation, explanations
from seals.sysid.healthy_flights.scatter import OTHER_TURNS, Modes, Scatter, scatter_of

COMMON = ("thrust_coefficient", "payload")
"""Changes of all drives alike, which air and battery make as well."""
RULED_OUT = 6.0
"""Strong evidence (Kass and Raftery 1995), by which one explanation rules out another [2 ln B]."""
FALSE_ALARMS = 0.025
"""Share of further healthy flights that may be taken for changed ones: half of the 5 % that are
allowed, for sessions differ more than the flights of one."""
UNEXPLAINED = 1e-3
"""Probability of what an explanation leaves, below which it does not explain a flight."""
_FINE, _COARSE = 180, 45
"""Sizes of each effect: to compare a flight, and to find what healthy flights show by chance."""
_DRAWS = 1024
"""Healthy flights, spread evenly, to find the evidence that this share of them exceeds."""
PLAUSIBLE = 0.1
"""Plausible relative loss of a drive, as `WeakRotor` declares it: the prior of lost shares."""
_BARE = 2.0
"""Evidence not worth more than a bare mention (Kass and Raftery 1995) [2 ln B]."""
_MOST = 3
_FACTOR = 2.0
"""Ratio of all thrusts above which a flight is not one of the same vehicle."""


@dataclass(frozen=True, kw_only=True)
class Changed:
    """Change that a flight shows against healthy ones.

    Args:
        verdict: of the comparison.
        names: explanations, best first, three at most.
        evidence: of the best against a healthy flight [2 ln B].
        lost_shares: estimated lost share of thrust of each drive, shape (n,).
        scores: of every explanation [2 ln B].
        change: from the healthy thrusts by mode [N], shape (modes,).
        unexplained: probability that the best explanation, or none, leaves so much.
    """

    verdict: Verdict
    names: tuple[str, ...]
    evidence: float
    lost_shares: Floats
    scores: Mapping[str, float]
    change: Floats
    unexplained: float


@dataclass(frozen=True)
class Reference:
    """Healthy flights of a vehicle, with which others are compared.

    Args:
        layout: drives of the vehicle.
        flights: healthy ones, one at least.
    """

    layout: DriveLayout
    flights: tuple[Balance, ...]

    @cached_property
    def modes(self) -> Modes:
        """Directions by which the drives act."""
        return Modes.of(self.layout)

    @cached_property
    def scatter(self) -> Scatter:
        """Of the mean thrusts."""
        return scatter_of(self.modes, self.flights, [f.mean for f in self.flights])

    @cached_property
    def turn(self) -> Scatter | None:
        """Of the change from the first leg to the second; None where not all fly there and back."""
        if "yaw" not in self.modes.names or not all(f.turned for f in self.flights):
            return None
        turns = [f.legs[1] - f.legs[0] for f in self.flights]
        return scatter_of(self.modes, self.flights, turns, OTHER_TURNS)

    @cached_property
    def known(self) -> tuple[Explanation, ...]:
        """What may have changed."""
        return tuple(explanations(self.layout, self.scatter.mean, _FINE))

    @cached_property
    def least(self) -> float:
        """Evidence that a change needs [2 ln B].

        What `FALSE_ALARMS` of the further healthy flights would show for some explanation, drawn
        from the scatter itself; a common change of thrust, which air and battery make, is no alarm.
        """
        known = explanations(self.layout, self.scatter.mean, _COARSE)
        rows = self._rows([one for one in known if one.name not in COMMON])
        even = Sobol(len(self.modes.names), scramble=True, rng=0).random(_DRAWS)
        changes = student.ppf(even, self.scatter.degrees) * np.sqrt(self.scatter.variance)
        best = [self._evidence(rows, change).max() for change in changes]
        return max(_BARE, float(np.quantile(best, 1.0 - FALSE_ALARMS)))

    @cached_property
    def smallest(self) -> dict[str, float]:
        """Size from which on each explanation would be seen; NaN for none.

        In the unit of its parameter, for explanations with one.
        """
        out = {}
        for one in explanations(self.layout, self.scatter.mean, _COARSE):
            if one.sizes.size:
                sizes, rows = one.sizes[-_COARSE:], one.changes[-_COARSE:] @ self.modes.vectors.T
                seen = [_evidence(self._gains(one, change)) >= self.least for change in rows]
                out[one.name] = float(sizes[int(np.argmax(seen))]) if any(seen) else np.nan
        return out

    def without(self, session: int) -> Reference | None:
        """Return the reference without a session; None if nothing is left."""
        left = tuple(f for f in self.flights if f.session != session)
        return Reference(self.layout, left) if left else None

    def compared(self, flight: Balance, policy: DecisionPolicy) -> Changed:
        """Return the change of a vehicle since its healthy flights.

        Equation:
            2 ln B = 2 ln (mean over the sizes of L(d - c) / L(d)) with d the change of the thrusts,
            c that of an explanation, L the product of Student's t over the modes with the scatter
            of healthy flights.

        Raises:
            LogError: the flight is not one of this vehicle.
        """
        ratio = float(np.abs(flight.mean).sum() / np.abs(self.scatter.mean).sum())
        lifted = not any(one.floats for one in self.flights)
        if lifted and not 1.0 / _FACTOR < ratio < _FACTOR:
            raise LogError(
                f"log '{flight.name}' needs {ratio:.2g} times the thrust of the healthy flights."
                "\nGive healthy flights of the same vehicle, with commands in the same units."
            )
        change = self.modes.vectors @ (flight.mean - self.scatter.mean)
        every = [one.name for one in self.known]
        scores = dict(zip(every, self._evidence(self._felt, change).tolist(), strict=True))
        scores |= self._slung(flight, scores, RULED_OUT + policy.evidence_further)
        within = {one.name: one.within for one in self.known}
        best = max(scores, key=lambda n: scores[n])
        seen = scores[best] >= _BARE and scores[best] >= self.least
        names = _near(scores, within) if seen else ()
        left = self._left(best, change) if seen else self.scatter.improbable(change)
        verdict = Verdict.ambiguous if len(names) > 1 else Verdict.named
        if left < UNEXPLAINED:
            verdict, names = Verdict.none_of_these, ()
        elif not names:
            verdict = Verdict.nothing_missing
        # most probable lost shares of thrust, all drives at once, given the scatter
        modes, healthy = self.modes.vectors, self.scatter.mean
        prior = np.diag((PLAUSIBLE * healthy) ** 2)
        felt = modes @ prior @ modes.T + np.diag(self.scatter.variance)
        more = prior @ modes.T @ np.linalg.solve(felt, change)
        return Changed(
            verdict=verdict,
            names=names,
            evidence=scores[best],
            lost_shares=np.asarray(more / np.where(healthy + more == 0.0, 1.0, healthy + more)),
            scores=scores,
            change=change,
            unexplained=left,
        )

    def parameters(self, name: str, changed: Changed) -> dict[str, Any]:
        """Return the estimate of the parameter of an explanation, as ``diagnosis.json`` has it."""
        one = self._behind(name)
        if not one.sizes.size:
            return {}
        weight = np.exp(self._gains(one, changed.change) - self._gains(one, changed.change).max())
        order = np.argsort(one.sizes)
        share = np.cumsum(weight[order]) / weight.sum()
        low, high = (float(one.sizes[order][np.searchsorted(share, q)]) for q in (0.05, 0.95))
        value = float(weight @ one.sizes / weight.sum())
        return {one.parameter: {"value": value, "low90": low, "high90": high, "unit": one.unit}}

    @cached_property
    def _felt(self) -> tuple[Floats, NDArray[np.int64]]:
        return self._rows(self.known)

    def _rows(self, known: Sequence[Explanation]) -> tuple[Floats, NDArray[np.int64]]:
        """Changes by mode of all explanations, shape (rows, modes), and the first row of each."""
        rows = [one.changes @ self.modes.vectors.T for one in known]
        return np.concatenate(rows), np.cumsum([0, *(len(r) for r in rows[:-1])])

    def _evidence(self, rows: tuple[Floats, NDArray[np.int64]], change: Floats) -> Floats:
        """Evidence of each explanation, its rows equally probable, over none [2 ln B]."""
        felt, first = rows
        gains = _gains(change - felt, change, self.scatter.variance, self.scatter.degrees)
        counts = np.diff([*first, len(felt)])
        most = np.maximum.reduceat(gains, first)
        mean = np.add.reduceat(np.exp(gains - np.repeat(most, counts)), first) / counts
        return np.asarray(2.0 * (most + np.log(mean)))

    def _gains(self, one: Explanation, change: Floats) -> Floats:
        """Log-likelihood of each row of an explanation over that of none, shape (rows,)."""
        left = change - one.changes @ self.modes.vectors.T
        return _gains(left, change, self.scatter.variance, self.scatter.degrees)

    def _behind(self, name: str) -> Explanation:
        """Return the explanation of a name; a slung load changes what a payload does."""
        name = name.replace("slung_load", "payload")
        return next(one for one in self.known if one.name == name)

    def _left(self, name: str, change: Floats) -> float:
        """Probability of what an explanation leaves, next to its best row.

        With many sessions the scatter is finer than the grid of sizes.
        """
        one = self._behind(name)
        felt = one.changes @ self.modes.vectors.T
        best = int(np.argmax(self._gains(one, change)))
        near = _between(felt, best, change, np.sqrt(self.scatter.variance))
        return max(self.scatter.improbable(change - row) for row in near)

    def _slung(
        self, flight: Balance, scores: Mapping[str, float], asked: float
    ) -> dict[str, float]:
        """Evidence of loads on a string: what trails on the floor is an effect beside its weight.

        A drag F at the drive turns the vehicle about z by -F (x t_y - y t_x), t the direction of
        travel, and so the other way on the way back. F is a share of the weight times a friction.
        """
        if self.turn is None or not flight.turned:
            return {}
        yaw, out = self.modes.names.index("yaw"), {}
        mode = self.modes.vectors[yaw]
        felt = float(np.linalg.pinv(self.layout.wrench)[:, 5] @ mode)
        change = float((flight.legs[1] - flight.legs[0] - self.turn.mean) @ mode)
        variance, degrees = self.turn.variance[yaw : yaw + 1], self.turn.degrees[yaw : yaw + 1]
        weight, sizes = float(self.scatter.mean.sum()), np.geomspace(SMALLEST, LARGEST, _FINE)
        for k, (x, y, _) in enumerate(self.layout.position):
            torque = -(x * flight.travel[:, 1] - y * flight.travel[:, 0])
            left = change - (torque[0] - torque[1]) * felt * weight * sizes**2
            gains = _gains(left[:, None], np.array([change]), variance, degrees)
            evidence = _evidence(gains)
            if evidence >= asked:
                out[f"slung_load@{k + 1}"] = scores[f"payload@{k + 1}"] + evidence
        return out


def _gains(left: Floats, before: Floats, variance: Floats, degrees: Floats) -> Floats:
    """Log-likelihood of what each row leaves over that of the whole change, shape (rows,)."""
    out = np.zeros(len(left))
    for free in np.unique(degrees):
        # one logarithm of the product of all modes with these degrees of freedom
        at, power = degrees == free, 0.5 * (free + 1.0)
        scale = variance[at] * free
        terms = np.prod(1.0 + left[:, at] ** 2 / scale, axis=1)
        out += power * (np.log1p(before[at] ** 2 / scale).sum() - np.log(terms))
    return out


def _between(felt: Floats, best: int, change: Floats, sigma: Floats) -> list[Floats]:
    """Return a row, and what is nearest to a change between it and the next ones.

    Next are the two sizes beside it, and the same size of the next ratio or share: rows come in
    blocks of `_FINE` sizes. In between changes go linearly.
    """
    found, here = [felt[best]], best // _FINE
    sizes = [k for k in (best - 1, best + 1) if k >= 0 and k // _FINE == here and k < len(felt)]
    others = [k for k in (best - _FINE, best + _FINE) if 0 <= k < len(felt)]
    for ends in product(sizes, others) if others else zip(sizes, strict=True):
        ways = (felt[list(ends)] - felt[best]).T
        share = lsq_linear(ways / sigma[:, None], (change - felt[best]) / sigma, (0.0, 1.0)).x
        found.append(felt[best] + ways @ share)
    return found


def _evidence(gains: Floats) -> float:
    """Evidence of equally probable rows over none [2 ln B]."""
    most = float(gains.max())
    return 2.0 * (most + float(np.log(np.exp(gains - most).mean())))


def _near(scores: Mapping[str, float], within: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Explanations that none rules out; a second fault that the evidence does not ask for goes."""
    ordered = sorted(scores, key=lambda n: -scores[n])
    near = [n for n in ordered if scores[n] > scores[ordered[0]] - RULED_OUT]
    asked = [n for n in near if all(scores[one] < scores[n] for one in within.get(n, ()))]
    return tuple(asked[:_MOST])
