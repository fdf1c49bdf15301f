"""Logs of many cases of one family flown together, and what of a hidden effect they show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.hidden import fly, sensors
from tests.validation.hidden.body import Body
from tests.validation.hidden.commands import Commands
from tests.validation.hidden.control import Controller
from tests.validation.hidden.fly import Track
from tests.validation.hidden.plant import Plant, stack
from tests.validation.hidden.rotation import (
    Array,
    exponential,
    from_angles,
    matrix,
    multiply,
    to_world,
)
from tests.validation.hidden.wild.cases import Case, Log, begin, joint_start
from tests.validation.hidden.wild.manoeuvres import PREROLL
from tests.validation.hidden.wild.tree import TreeBody

# inner steps [s]: small against the lags of the rotors, the servos and the thrusters
INNER = {"grip": 0.003, "dual": 0.002, "torpedo": 0.004, "spar": 0.004, "rov8": 0.004}
INNER |= {"rov6": 0.005, "boat": 0.005, "buoy": 0.005, "float": 0.005}
WINDOW = 0.5
CHUNK = 160
Index = NDArray[np.intp]


@dataclass
class Member:
    """One run: a log, or one segment of it."""

    owner: int
    log: Log
    segment: int


class Crew:
    """A batch of cases of one family and one step; members are the segments of all logs."""

    def __init__(self, cases: list[Case], seed: int) -> None:
        self.cases, self.step = cases, cases[0].spec.step
        self.first = cases[0].robot
        self.per_row = round(self.step / INNER.get(cases[0].spec.family, 0.002))
        driven = bool(cases[0].logs[0].wanted)
        self.skip = round(PREROLL / self.step) if driven else 0
        self.members = [
            Member(i, log, s)
            for i, case in enumerate(cases)
            for log in case.logs
            for s in range(max(len(log.starts), 1))
        ]
        self.owner = np.array([m.owner for m in self.members], dtype=np.intp)
        self._rng = np.random.default_rng(seed)
        self.with_it = self._plants(None)
        self.body = self.make(self._plants(0.0))
        self.track, self.sent = self._fly()
        self.body = self.make(self.with_it)

    def make(self, plant: Plant) -> Any:
        """Equations of motion under given parameters."""
        v, tree = self.first.vehicle, self.first.tree
        if tree is not None:
            return TreeBody(plant, tree.parents, ground=v.ground)
        return Body(plant, rotor=v.rotor, ground=v.ground, water=v.water)

    def _plants(
        self,
        t: float | None,
        *,
        source: str = "plant",
        leave: int | None = None,
        bare: bool = False,
    ) -> Plant:
        """Plants of all members with what acts at t, from the first row; with all; or bare.

        The source is the true plant, the nominal one, or the one of the folder's sheet.
        """
        out = []
        for m in self.members:
            case = self.cases[m.owner]
            plant = case.at(getattr(case, source), m.log, t, leave, bare=bare)
            if self.first.tree is not None:
                plant["joint_start"] = joint_start(m.log, 0.0)
            out.append(plant)
        return stack(out)

    def _times(self) -> list[float]:
        """Times of all steps of effects, from the first row."""
        spans = [s for c in self.cases for a in c.active for s in a.values()]
        return sorted({t for span in spans for t in span if t is not None})

    def _fly(self) -> tuple[Track, Commands]:
        case = self.cases[0]
        seconds = (round(case.seconds / self.step) + self.skip) * self.step
        control = None
        if case.logs[0].wanted:
            keys = case.logs[0].wanted
            wanted = {k: np.stack([m.log.wanted[k] for m in self.members], axis=-1) for k in keys}
            dither = np.full(len(self.members), 6.0 if self.first.vehicle.rotor else 0.4)
            vehicles = [self.cases[m.owner].robot.vehicle for m in self.members]
            control = Controller(vehicles, wanted, dither, self._rng)
        before = self.skip * self.step
        changes = [(t + before, self.make(self._plants(t))) for t in self._times()]
        return fly.closed_loop(
            self.body,
            control,
            self._begun() if control is not None else self._released(),
            seconds=seconds,
            step=self.step,
            per_row=self.per_row,
            rng=self._rng,
            changes=changes,
        )

    def _begun(self) -> Array:
        both = [begin(m.log, 0.0) for m in self.members]
        place = np.stack([b[0] for b in both], axis=-1)
        speed = np.stack([b[1] for b in both], axis=-1)
        q = np.stack([from_angles(0.0, 0.0, yaw) for yaw in place[3]], axis=-1)
        spin = np.zeros((3, len(both)))
        spin[2] = speed[3]
        act = np.zeros((self.body.count, len(both)))
        if self.first.vehicle.rotor:
            act = np.sqrt(self.with_it["hover_thrust"] / self.with_it["act_gain"])
        return self.body.still(place[:3], q, speed[:3], spin, act)

    def _released(self) -> Array:
        starts = [m.log.starts[m.segment] for m in self.members]
        both = {k: np.stack([s[k] for s in starts], axis=-1) for k in starts[0]}
        q = multiply(both["orientation"], exponential(both["orientation_miss"]))
        spin = both["angular_velocity"] + both["angular_velocity_miss"]
        velocity = to_world(matrix(q), both["velocity"] + both["velocity_miss"])
        place = both["position"] + both["position_miss"]
        none = np.zeros((0, len(starts)))
        return self.body.still(place, q, velocity, spin, none)

    def _joints(self) -> slice | None:
        return getattr(self.body, "joint_rows", None)

    def measure(self) -> list[dict[str, Array]]:
        """What the sensors of every member read, rows by axes."""
        values = sensors.exact(self.track, self.with_it, self._joints())
        out = []
        for i, m in enumerate(self.members):
            channels = self.cases[m.owner].robot.channels | self._battery()
            rates = {k: (s, 1.0 / every) for k, (s, every) in channels.items()}
            mine = {k: v[self.skip :, :, i] for k, v in values.items()}
            out.append(sensors.measured(mine, rates, 1.0, self._rng))
        return out

    def _battery(self) -> dict[str, tuple[float, int]]:
        return {"battery_voltage": (0.01, 1)} if self.first.vehicle.battery else {}

    def misfits(self, readings: list[dict[str, Array]]) -> None:
        """Into each case: misfit of the stated vehicle without its effects over that with them."""
        most = max((len(c.hidden) for c in self.cases), default=0)
        asked = any(c.spec.level in {"data_sheet", "calibrate"} for c in self.cases)
        if not most and not asked:
            for case in self.cases:
                case.found["misfit"], case.found["each"] = {}, []
            return
        member, first = self._windows()
        floor = self._residual(self._plants(None, source="nominal"), member, first, readings)
        bare = self._residual(
            self._plants(None, source="sheet", bare=True), member, first, readings
        )
        each = []
        for leave in range(most):
            plants = self._plants(None, source="nominal", leave=leave)
            each.append(self._residual(plants, member, first, readings))
        for i, case in enumerate(self.cases):
            mine = self.owner[member] == i
            case.found["misfit"] = _ratios(bare, floor, mine)
            case.found["each"] = [
                max(_ratios(e, floor, mine).values()) for e in each[: len(case.hidden)]
            ]

    def _windows(self) -> tuple[Index, Index]:
        """Member and first row of windows in which all effects of a fitted log act."""
        rows = round(WINDOW / self.step)
        total = self.track.rows.shape[0]
        member, first = [], []
        for i, m in enumerate(self.members):
            case = self.cases[m.owner]
            if m.log.name == "h":
                continue
            for row in range(self.skip, total - rows - 1, rows):
                t = (row - self.skip) * self.step
                spans = [a.get(m.log.name) for a in case.active]
                if all(_inside(s, t, t + WINDOW) for s in spans):
                    member.append(i)
                    first.append(row)
        return np.array(member, dtype=np.intp), np.array(first, dtype=np.intp)

    def _residual(
        self, plant: Plant, member: Index, first: Index, readings: list[dict[str, Array]]
    ) -> dict[str, Array]:
        """Mean squared residual in units of the noise of each window, by channel."""
        rows = round(WINDOW / self.step)
        out: dict[str, list[Array]] = {}
        for low in range(0, member.size, CHUNK):
            some = slice(low, low + CHUNK)
            m, f = member[some], first[some]
            values = self._replay({k: v[..., m] for k, v in plant.items()}, m, f, rows)
            here = [slice(a - self.skip, a - self.skip + rows + 1) for a in f]
            noise = [self.cases[self.owner[i]].robot.channels for i in m]
            for k in dict.fromkeys(name for c in noise for name in c):
                # a channel that a member lacks counts for nothing
                blank = np.full(values[k].shape[:2], np.nan)
                read = [readings[i].get(k) for i in m]
                parts = [blank if x is None else x[h] for x, h in zip(read, here, strict=True)]
                seen, unit = {k: np.stack(parts, axis=-1)}, {k: (1.0, 1.0)}
                sigma = np.array([c.get(k, (1.0, 1))[0] for c in noise])
                gap = (sensors.differences(seen, values, unit)[k][4:] / sigma) ** 2
                count = np.maximum(np.isfinite(gap).sum((0, 1)), 1)
                out.setdefault(k, []).append(np.nansum(gap, axis=(0, 1)) / count)
        return {k: np.concatenate(v) for k, v in out.items()}

    def _replay(self, plant: Plant, member: Index, first: Index, rows: int) -> dict[str, Array]:
        body = self.make(plant)
        fine = self.track.fine[first * self.per_row, :, member].T
        state = self.track.rows[first, :, member].T
        state = body.with_motion(state, fine[4:7], fine[7:10], first * self.step)
        track = fly.windows(
            body,
            state,
            self.sent,
            log=member,
            first=first,
            rows=rows,
            inner=self.track.inner,
            per_row=self.per_row,
        )
        return sensors.exact(track, body.plant, self._joints())


def _inside(span: Any, low: float, high: float) -> bool:
    if span is None:
        return False
    start, end = span
    return (start is None or start <= low) and (end is None or high <= end)


def _ratios(top: dict[str, Array], floor: dict[str, Array], mine: Array) -> dict[str, float]:
    """Mean of the worst quarter of windows over that of the floor, by channel."""
    out = {}
    for k, value in top.items():
        count = max(1, int(mine.sum()) // 4)
        worst, quiet = (np.sort(v[mine])[-count:].mean() for v in (value, floor[k]))
        if quiet > 0.0:
            out[k] = float(worst / quiet)
    return out
