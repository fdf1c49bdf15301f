"""Cases of one kind of vehicle flown together: the closed loop, the windows and the readings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.hidden import fly, onsets, references, sensors
from tests.validation.hidden.arm import ArmBody
from tests.validation.hidden.body import Body
from tests.validation.hidden.cases import SECONDS, Case
from tests.validation.hidden.commands import Commands
from tests.validation.hidden.control import Controller
from tests.validation.hidden.fly import Track
from tests.validation.hidden.plant import Plant, stack, take
from tests.validation.hidden.rotation import Array, exponential, matrix, multiply, to_world

STEP = {"drop": 0.02}
PER_ROW = {"drop": 25}
PREROLL = 0.6
WINDOW = 0.5
# windows replayed together: few where every one carries hundreds of cells
CHUNK = {"drop": 120, "crossing": 120}


class Flight:
    """A batch of cases of one body; members are the runs (segments) of all cases in turn."""

    def __init__(self, cases: list[Case], seed: int) -> None:
        self.cases = cases
        self.kind = cases[0].spec.body
        self.step = STEP.get(self.kind, 0.01)
        self.per_row = PER_ROW.get(self.kind, 10)
        self.owner = np.concatenate(
            [np.full(c.runs, i, dtype=np.intp) for i, c in enumerate(cases)]
        )
        self.with_it = take(stack([c.with_it for c in cases]), self.owner)
        self.without = take(stack([c.without for c in cases]), self.owner)
        self.skip = 0 if self.kind == "drop" else round(PREROLL / self.step)
        self._rng = np.random.default_rng(seed)
        spans = [cases[i].active for i in self.owner]
        before = self.skip * self.step
        changes = onsets.schedule(spans, self.with_it, self.without, before, self.make)
        self.body = changes[0][1]
        self.track, self.sent = self._fly(changes[1:])

    def make(self, plant: Plant) -> Any:
        """Equations of motion under given parameters."""
        first = self.cases[0].vehicle
        if first.arm is not None:
            return ArmBody(plant, rotor=True, ground=first.ground, water=first.water)
        return Body(plant, rotor=first.rotor, ground=first.ground, water=first.water)

    def _fly(self, changes: list[tuple[float, Any]]) -> tuple[Track, Commands]:
        seconds = SECONDS[self.kind] + self.skip * self.step
        control: Controller | None = None
        if self.kind == "drop":
            state = self._released()
        else:
            wanted = {
                k: np.stack([c.wanted[k] for c in self.cases], axis=-1)
                for k in self.cases[0].wanted
            }
            dither = np.array([c.dither for c in self.cases])
            control = Controller([c.vehicle for c in self.cases], wanted, dither, self._rng)
            state = self._begun(wanted)
        return fly.closed_loop(
            self.body,
            control,
            state,
            seconds=seconds,
            step=self.step,
            per_row=self.per_row,
            rng=self._rng,
            changes=changes,
        )

    def _begun(self, wanted: references.Wanted) -> Array:
        """On the reference, level, with the actuators near the balance of weight."""
        place, speed, _ = references.at(wanted, 0.0)
        n = place.shape[1]
        half = 0.5 * place[3]
        q = np.stack((np.cos(half), np.zeros(n), np.zeros(n), np.sin(half)))
        spin = np.zeros((3, n))
        spin[2] = speed[3]
        act = np.zeros((self.body.count, n))
        if self.cases[0].vehicle.rotor:
            act = np.sqrt(self.with_it["hover_thrust"] / self.with_it["act_gain"])
        return self.body.still(place[:3], q, speed[:3], spin, act)

    def _released(self) -> Array:
        starts = [s for c in self.cases for s in c.starts]
        both = {k: np.stack([s[k] for s in starts], axis=-1) for k in starts[0]}
        q = multiply(both["orientation"], exponential(both["orientation_miss"]))
        spin = both["angular_velocity"] + both["angular_velocity_miss"]
        place = both["position"] + both["position_miss"]
        velocity = to_world(matrix(q), both["velocity_miss"])
        none = np.zeros((0, place.shape[1]))
        return self.body.still(place, q, velocity, spin, none)

    def joints(self) -> slice | None:
        """Rows of the state that hold the joint angles."""
        return getattr(self.body, "joint_rows", None)

    def readings(self) -> dict[str, Array]:
        """Noise-free readings of the logged rows, each (rows, axes, members)."""
        values = sensors.exact(self.track, self.with_it, self.joints())
        return {k: v[self.skip :] for k, v in values.items()}

    def layout(self) -> tuple[NDArray[np.intp], NDArray[np.intp], int]:
        """Member and first row of every window, and the rows in a window."""
        rows = round(WINDOW / self.step)
        total = self.track.rows.shape[0]
        first = np.arange(self.skip, total - rows + 1, rows)
        members = self.owner.shape[0]
        return np.repeat(np.arange(members), len(first)), np.tile(first, members), rows

    def excess(self) -> None:
        """Differences that the hidden effect makes within windows, into each case's findings."""
        member, first, rows = self.layout()
        hides = np.array([c.spec.level != "null" for c in self.cases])[self.owner]
        first, member = first[hides[member]], member[hides[member]]
        kept: dict[str, list[Array]] = {}
        chunk = CHUNK.get(self.kind, 1500)
        for low in range(0, member.shape[0], chunk):
            some = slice(low, low + chunk)
            one = self.replay(self.with_it, self.sent, member[some], first[some], rows)
            two = self.replay(self.without, self.sent.obeyed(), member[some], first[some], rows)
            kind = self.cases[0].spec.body
            for name, value in sensors.differences(one, two, sensors.CHANNELS[kind]).items():
                # the first rows lack the past that a late sensor reads
                kept.setdefault(name, []).append((value[4:rows] ** 2).mean(0))
        for i, case in enumerate(self.cases):
            mine = self.owner[member] == i
            if not mine.any():
                continue
            case.found["excess"] = {
                name: _worst_quarter(np.concatenate(v, axis=-1)[:, mine])
                for name, v in kept.items()
                if name in sensors.CHANNELS[case.spec.kind]
            }

    def replay(
        self,
        plant: Plant,
        sent: Commands,
        member: NDArray[np.intp],
        first: NDArray[np.intp],
        rows: int,
    ) -> dict[str, Array]:
        """Readings of windows that start in the true states, under given parameters."""
        body = self.make(take(plant, member))
        fine = self.track.fine[first * self.per_row, :, member].T
        state = self.track.rows[first, :, member].T
        state = body.with_motion(state, fine[4:7], fine[7:10], first * self.step)
        track = fly.windows(
            body,
            state,
            sent,
            log=member,
            first=first,
            rows=rows,
            inner=self.track.inner,
            per_row=self.per_row,
        )
        return sensors.exact(track, body.plant, self.joints())


def _worst_quarter(values: Array) -> float:
    """Mean of the worst quarter of windows, worst axis, of (axes, windows)."""
    ordered = np.sort(values, axis=1)[:, ::-1]
    count = max(1, values.shape[1] // 4)
    return float(ordered[:, :count].mean(1).max())
