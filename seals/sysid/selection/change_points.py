"""Search for the times at which an effect begins and ends, log by log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.sysid.candidates.activity import Activity, Moment, Span
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.activity_equations import ActivityEquations, Blocks

_SWEEPS = 4
"""Rounds over the logs at most."""
_TAIL = 0.05
"""Probability below, and above, a 90 % interval."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """Part of one log in which an effect acts, by indices of possible times.

    Args:
        acts: whether it acts in this log at all.
        start: place from which it acts; None for the first row.
        end: place up to which it acts; None for the last row.
    """

    acts: bool = True
    start: int | None = None
    end: int | None = None

    @property
    def times(self) -> int:
        """Number of change points in this log: 0, 1 or 2."""
        return (self.start is not None) + (self.end is not None)


@dataclass(frozen=True, kw_only=True)
class ChangePoints:
    """Result of a search for the times at which one effect begins and ends.

    Args:
        activity: the times; None where acting throughout is as likely.
        gain: fall of the cost against the model without the effect, less the Occam factor of the
            times.
        throughout: the same where it acts throughout.
        values: of the effect's parameters, shape (k,).
        parts: of every log.
    """

    activity: Activity | None
    gain: float
    throughout: float
    values: Floats
    parts: tuple[Part, ...]


class LogPlaces:
    """Possible times in one log at which an effect begins or ends.

    Args:
        equations: of the effect.
        windows: numbers of the log's windows, in order.
    """

    def __init__(self, equations: ActivityEquations, windows: NDArray[np.int64]) -> None:
        self.tail, self.head = equations.tail(windows), equations.head(windows)
        self.whole = equations.on[windows, 0].over()
        self.offsets = len(equations.offsets)
        rows, samples = equations.fitter.windows.rows, equations.fitter.plant.samples
        begin = samples.time[rows[windows, 0]]
        self.time = (begin[:, None] + equations.offsets[None, :] * samples.step).ravel()
        self.step = samples.step
        self.span = float(len(windows) * rows.shape[1] * samples.step)

    @property
    def count(self) -> int:
        """Number of possible times."""
        return len(self.time)

    def block(self, part: Part) -> Blocks:
        """Inner products of the effect when it acts in one part of the log."""
        if not part.acts:
            return self.whole.less(self.whole)
        if part.start is None and part.end is None:
            return self.whole
        if part.end is None:
            return self.tail[part.start]
        if part.start is None:
            return self.head[part.end]
        return (self.tail[part.start] + self.head[part.end]).less(self.whole)

    def windowed(self, starts: NDArray[np.int64], ends: NDArray[np.int64]) -> Blocks:
        """Inner products of the effect when it acts in each of several time spans."""
        return (self.tail[starts] + self.head[ends]).less(self.whole[None])


class ChangePointSearch:
    """Search for the part of every log in which one effect acts.

    Args:
        equations: of the effect.
        candidate: the effect, which says whether it may begin and end.
        policy: Occam factor of the times.
    """

    def __init__(
        self, equations: ActivityEquations, candidate: Candidate, policy: DecisionPolicy
    ) -> None:
        self.equations, self.candidate, self.policy = equations, candidate, policy
        self.logs = [LogPlaces(equations, w) for w in equations.windows_of_logs()]

    def run(self, known: Sequence[Part] = ()) -> ChangePoints:
        """Find the most likely part of every log.

        Args:
            known: parts to start from beside acting throughout.
        """
        throughout = tuple(Part() for _ in self.logs)
        starts = [throughout, *([tuple(known)] if known else [])]
        if len(self.logs) > 1:
            starts += [
                tuple(Part(acts=i == k) for i in range(len(self.logs)))
                for k in range(len(self.logs))
            ]
        whole, values = self._fall(throughout)
        best, gain = throughout, whole
        for start in starts:
            parts = self._swept(start)
            found = self._fall(parts)
            if found[0] - self._factor(parts) > gain - self._factor(best):
                best, (gain, values) = parts, found
        if best == throughout:
            return ChangePoints(
                activity=None, gain=whole, throughout=whole, values=values, parts=best
            )
        # a law holds to a share only, which may differ from one part of a log to another
        occam_factor = self._factor(best) + self.policy.activity + self.policy.activity_share * gain
        return ChangePoints(
            activity=Activity(spans=self._spans(best), occam_factor=occam_factor),
            gain=gain - occam_factor,
            throughout=whole,
            values=values,
            parts=best,
        )

    def _fall(self, parts: Sequence[Part]) -> tuple[float, Floats]:
        blocks = self._others(parts, None)
        found, values = self.equations.fall(blocks[None])
        return float(found[0]), values[0]

    def _others(self, parts: Sequence[Part], without: int | None) -> Blocks:
        """Sum of the equations over all logs but one."""
        total = self.logs[0].whole.less(self.logs[0].whole)
        for k, (log, part) in enumerate(zip(self.logs, parts, strict=True)):
            if k != without:
                total = total + log.block(part)
        return total

    def _swept(self, parts: tuple[Part, ...]) -> tuple[Part, ...]:
        """Choose the part of each log in turn, the others held, until nothing changes."""
        for _ in range(_SWEEPS):
            before = parts
            for k in range(len(self.logs)):
                parts = (*parts[:k], self._chosen(parts, k), *parts[k + 1 :])
            if parts == before or len(self.logs) == 1:
                break
        return parts

    def _chosen(self, parts: Sequence[Part], k: int) -> Part:
        """Choose the best part of one log."""
        log, others = self.logs[k], self._others(parts, k)
        known = self.candidate.identification
        alone = not any(p.acts for i, p in enumerate(parts) if i != k)
        options = [Part()] if alone else [Part(), Part(acts=False)]
        best = max(options, key=lambda p: self._worth(log, others, p))
        if known.may_begin:
            best = self._better(log, others, best, Part(start=self._best(log, others, log.tail)))
        if known.may_end:
            best = self._better(log, others, best, Part(end=self._best(log, others, log.head)))
        if known.may_begin and known.may_end and log.count > 2 * log.offsets:
            best = self._better(log, others, best, self._window(log, others))
        return best

    def _better(self, log: LogPlaces, others: Blocks, one: Part, other: Part) -> Part:
        gains = [self._worth(log, others, p) for p in (one, other)]
        return other if gains[1] > gains[0] else one

    def _worth(self, log: LogPlaces, others: Blocks, part: Part) -> float:
        fall = float(self.equations.fall((others + log.block(part))[None])[0][0])
        return fall - self._part_factor(log, part)

    def _best(self, log: LogPlaces, others: Blocks, choices: Blocks) -> int:
        """Index of the best possible time but the first, which selects all or none of the log."""
        falls = self.equations.fall(others[None] + choices)[0]
        return 1 + int(np.argmax(falls[1:])) if len(falls) > 1 else 0

    def _window(self, log: LogPlaces, others: Blocks) -> Part:
        """Best time span: first between whole windows, then each end refined separately."""
        coarse = np.arange(0, log.count, log.offsets)
        i, j = np.triu_indices(len(coarse), 1)
        starts, ends = coarse[i], coarse[j]
        falls = self.equations.fall(others[None] + log.windowed(starts, ends))[0]
        at = int(np.argmax(falls))
        start, end = int(starts[at]), int(ends[at])
        for _ in range(2):
            choices = np.arange(0, (end // log.offsets) * log.offsets)
            if len(choices):
                found = log.windowed(choices, np.full_like(choices, end))
                start = int(choices[np.argmax(self.equations.fall(others[None] + found)[0])])
            choices = np.arange((start // log.offsets + 1) * log.offsets, log.count)
            found = log.windowed(np.full_like(choices, start), choices)
            end = int(choices[np.argmax(self.equations.fall(others[None] + found)[0])])
        return Part(start=start, end=end)

    def _factor(self, parts: Sequence[Part]) -> float:
        return sum(self._part_factor(g, p) for g, p in zip(self.logs, parts, strict=True))

    def _part_factor(self, log: LogPlaces, part: Part) -> float:
        """Occam factor of the choice of one part among all possible parts."""
        if part == Part():
            return 0.0
        instants = max(log.span / self.policy.activity_resolution, 1.0)
        return float(2.0 * (np.log(_KINDS) + part.times * np.log(instants)))

    def _spans(self, parts: Sequence[Part]) -> tuple[Span, ...]:
        """Convert parts to seconds, with intervals from the profile of each time."""
        spans = []
        for k, part in enumerate(parts):
            if not part.acts:
                continue
            start = None if part.start is None else self._moment(parts, k, "start")
            end = None if part.end is None else self._moment(parts, k, "end")
            spans.append(Span(log=k, start=start, end=end))
        return tuple(spans)

    def _moment(self, parts: Sequence[Part], k: int, which: str) -> Moment:
        """Time with the 90 % interval of its profile, all other times held."""
        log, part, others = self.logs[k], parts[k], self._others(parts, k)
        places = np.arange(log.count)
        if which == "start":
            fits = places // log.offsets < (
                log.count if part.end is None else part.end // log.offsets
            )
            places = places[fits]
            found = (
                log.tail[places]
                if part.end is None
                else log.windowed(places, np.full_like(places, part.end))
            )
            chosen = part.start
        else:
            fits = places // log.offsets > (-1 if part.start is None else part.start // log.offsets)
            places = places[fits]
            found = (
                log.head[places]
                if part.start is None
                else log.windowed(np.full_like(places, part.start), places)
            )
            chosen = part.end
        falls = self.equations.fall(others[None] + found)[0]
        time = log.time[places]
        odds = falls / self.policy.temperature
        value = float(log.time[chosen])
        step = log.step
        edges = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
        weight = np.exp(odds - odds.max()) * np.maximum(np.diff(edges), 1e-9)
        reached = np.concatenate([[0.0], np.cumsum(weight)]) / weight.sum()
        low, high = (float(np.interp(p, reached, edges)) for p in (_TAIL, 1.0 - _TAIL))
        return Moment(value=value, low90=min(low, value - step), high90=max(high, value + step))


_KINDS = 5.0
"""Ways in which an effect may act in a log: throughout, not at all, from, until, from until."""
