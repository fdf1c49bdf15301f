"""The model between the rows of a log: an impact is over in less than two of them."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.fit import Fitter
from seals.sysid.linearise import (
    DELAY,
    Columns,
    Dynamics,
    Prediction,
    columns_along,
    dynamics_along,
)
from seals.sysid.plant import Plant, nonzero
from seals.sysid.samples import Samples
from seals.sysid.trajectory import Course, difference
from seals.sysid.whitened import Whitened
from seals.sysid.windows import Windows


@dataclass(frozen=True, kw_only=True)
class Track:
    """What the model makes of the time between the rows; T rows of a log, k parts of each.

    Args:
        course: states at every part, T k rows.
        reading: of the inertial sensors at every part, without delay, shape (T k, 6).
        defect: state error at the end of a row against the next row's state, shape (T, 12).
    """

    course: Course
    reading: Floats
    defect: Floats


class Between:
    """A plant that nothing drives, looked at between the rows of its log.

    Args:
        plant: extended model without actuators; its parts say how finely.
    """

    def __init__(self, plant: Plant) -> None:
        """Set up the finer rows."""
        self.plant, self.parts = plant, plant.parts
        self.fine = Plant(plant.vehicle, plant.library, finer(plant.samples, self.parts), parts=1)

    def track(self, course: Course, values: Mapping[str, float]) -> Track:
        """Follow the model from every row of a course to the next."""
        used, count = nonzero(values), self.plant.samples.rows
        rows = np.arange(count)
        state = course.state(rows)
        twin = self.fine.twin(used, count)
        states, readings = [], []
        for part in range(self.parts):
            states.append(state)
            state, rates = self.fine.advance(twin, state, rows * self.parts + part, None)
            seen = self.fine.reading(states[-1], rates, used)
            readings.append(np.concatenate([seen.angular_velocity, seen.specific_force], axis=1))
        names = ("position", "quaternion", "velocity", "spin", "joints", "rates")
        joined = (np.stack([s[i] for s in states], axis=1) for i in range(len(names)))
        flat = (x.reshape(count * self.parts, -1) for x in joined)
        return Track(
            course=Course(**dict(zip(names, flat, strict=True))),
            reading=np.stack(readings, axis=1).reshape(count * self.parts, -1),
            defect=difference(state, course.state(np.minimum(rows + 1, count - 1))),
        )

    def predict(self, track: Track, delay: float) -> Prediction:
        """One step from every row, and readings that are late by a delay [s]."""
        reading = self._late(track.reading, delay) if delay else track.reading[:: self.parts]
        return Prediction(defect=track.defect, reading=reading)

    def dynamics(self, track: Track, values: Mapping[str, float]) -> tuple[Dynamics, Dynamics]:
        """Derivatives from row to row, and those from part to part that they are made of."""
        fine = dynamics_along(self.fine, track.course, values)
        size = fine.transition.shape[1]
        rows = Dynamics(
            transition=self._joined(fine, np.zeros_like(fine.transition), start=np.eye(size)),
            kick=self._joined(fine, fine.kick),
            sense=fine.sense[:: self.parts],
            feel=fine.feel[:: self.parts],
            slope=fine.slope[:: self.parts],
        )
        return rows, fine

    def columns(
        self, track: Track, fine: Dynamics, values: Mapping[str, float], keys: Sequence[str]
    ) -> Columns:
        """Derivatives by parameters from row to row."""
        found = columns_along(self.fine, track.course, values, keys, fine)
        reading = found.reading[:: self.parts].copy()
        if DELAY in keys:
            slope = np.concatenate(
                [
                    np.gradient(track.reading[first:last], self.fine.samples.step, axis=0)
                    for first, last in self.fine.samples.runs
                ]
            )
            reading[:, :, keys.index(DELAY)] = -self._late(slope, float(values.get(DELAY, 0.0)))
        return Columns(keys=tuple(keys), push=self._joined(fine, found.push), reading=reading)

    def _joined(self, fine: Dynamics, push: Floats, start: Floats | None = None) -> Floats:
        """Carry what every part adds to the end of its row."""
        rows = self.plant.samples.rows
        steps = fine.transition.reshape(rows, self.parts, *fine.transition.shape[1:])
        pushes = push.reshape(rows, self.parts, *push.shape[1:])
        total = np.zeros_like(pushes[:, 0]) if start is None else pushes[:, 0] * 0.0 + start
        for part in range(self.parts):
            total = np.matmul(steps[:, part], total) + pushes[:, part]
        return total

    def _late(self, values: Floats, delay: float) -> Floats:
        """Values at the rows as they were a delay earlier, run by run."""
        out = np.empty((self.plant.samples.rows, values.shape[1]))
        runs = zip(self.plant.samples.runs, self.fine.samples.runs, strict=True)
        for (first, last), (begin, end) in runs:
            wanted = self.plant.samples.time[first:last] - delay
            time = self.fine.samples.time[begin:end]
            for k in range(values.shape[1]):
                out[first:last, k] = np.interp(wanted, time, values[begin:end, k])
        return out


_SHARED = ("between", "plant", "library")


class FineFitter(Fitter):
    """A fitter whose model is followed between the rows.

    Args:
        between: the plant between the rows.
        course: about which the model is linear.
        windows: of the log.
        fine: derivatives from part to part.
        rows: derivatives from row to row.
        at: parameters of the linearisation of the tolerances.
        columns: responses of the tolerances, when they are known.
        fixed: the same, whitened.
    """

    def __init__(
        self,
        between: Between,
        course: Course,
        windows: Windows,
        *,
        fine: Dynamics,
        rows: Dynamics,
        at: Mapping[str, float],
        columns: Columns | None = None,
        fixed: Whitened | None = None,
    ) -> None:
        self.between, self.fine = between, fine
        self._known: tuple[Mapping[str, float], Track] | None = None
        super().__init__(between.plant, course, rows, windows, at=at, columns=columns, fixed=fixed)

    def track(self, values: Mapping[str, float]) -> Track:
        """The model between the rows at given values."""
        used = nonzero(values)
        if self._known is None or self._known[0] != used:
            self._known = used, self.between.track(self.course, used)
        return self._known[1]

    def seen_through(self, windows: Windows) -> FineFitter:
        """Return the same linearisation in other windows."""
        return FineFitter(
            self.between,
            self.course,
            windows,
            fine=self.fine,
            rows=self.dynamics,
            at=self.at,
            columns=self.columns,
            fixed=windows.again(self.fixed) if windows.like(self.windows) else None,
        )

    def __getstate__(self) -> dict[str, Any]:
        """Travel between processes without what every one of them has."""
        windows = copy.copy(self.windows)
        del windows.vehicle, windows.samples
        rest = {k: v for k, v in self.__dict__.items() if k not in _SHARED}
        return rest | {"_known": None, "windows": windows}

    def settle(self, between: Between) -> None:
        """Take up the plant again after a journey."""
        plant = between.plant
        self.between, self.plant, self.library = between, plant, plant.library
        self.windows.vehicle, self.windows.samples = plant.vehicle, plant.samples

    def predicted(self, values: Mapping[str, float]) -> Prediction:
        """What the model makes of the course."""
        late = float(values.get(DELAY, 0.0)) - self.windows.delay
        return self.between.predict(self.track(values), late)

    def misfit(self, values: Mapping[str, float]) -> Whitened:
        """Whitened misfit of the model at given values."""
        return self.windows.whiten(self.windows.residual(self.predicted(values))[:, :, None])

    def _columns(self, keys: Sequence[str], values: Mapping[str, float]) -> Columns:
        return self.between.columns(self.track(values), self.fine, values, tuple(keys))


def finer(samples: Samples, parts: int) -> Samples:
    """Rows without measurements, several for each one of a log that nothing drives."""
    step = samples.step / parts
    time = samples.time[:, None] + step * np.arange(parts)
    return replace(
        samples,
        time=time.ravel(),
        step=step,
        runs=tuple((first * parts, last * parts) for first, last in samples.runs),
        channels={},
        command=np.repeat(samples.command, parts, axis=0),
        joint_command=np.repeat(samples.joint_command, parts, axis=0),
    )
