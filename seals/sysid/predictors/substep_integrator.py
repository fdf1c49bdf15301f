"""Integration of the model in several steps per row of a log, for impacts shorter than two rows."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory, difference
from seals.sysid.predictors.extended_model import ExtendedModel, nonzero
from seals.sysid.predictors.linearise import (
    Columns,
    Dynamics,
    Prediction,
    columns_along,
    dynamics_along,
    read_rows,
)
from seals.sysid.predictors.trajectory_cache import ExpansionPoint
from seals.sysid.predictors.whitened import Whitened
from seals.sysid.predictors.windows import Windows
from seals.sysid.predictors.windows_fit import Fitter


@dataclass(frozen=True, kw_only=True)
class SubstepTrajectory:
    """Simulated states between the rows; T rows of a log, k parts of each.

    Args:
        trajectory: states at every part, T k rows.
        reading: of the inertial sensors at every part, without delay, shape (T k, 6).
        defect: state error at the end of a row against the next row's state, shape (T, 12).
    """

    trajectory: Trajectory
    reading: Floats
    defect: Floats


class SubstepIntegrator:
    """Integrator of a plant without actuators, several steps for each row of its log.

    Args:
        plant: extended model without actuators; its parts say how finely.
    """

    def __init__(self, plant: ExtendedModel) -> None:
        self.plant, self.parts = plant, plant.parts
        self.fine = ExtendedModel(
            plant.vehicle, plant.candidate_set, finer(plant.samples, self.parts), parts=1
        )

    def substeps(self, trajectory: Trajectory, values: Mapping[str, float]) -> SubstepTrajectory:
        """Integrate the model from every row of a trajectory to the next."""
        used, count = nonzero(values), self.plant.samples.rows
        rows = np.arange(count)
        state = trajectory.state(rows)
        twin = self.fine.twin(used, count)
        states, readings = [], []
        for part in range(self.parts):
            states.append(state)
            state, rates = self.fine.advance(twin, state, rows * self.parts + part, None)
            readings.append(read_rows(self.fine, states[-1], rates, used))
        return SubstepTrajectory(
            trajectory=Trajectory.joined(states, [self.parts] * count),
            reading=np.stack(readings, axis=1).reshape(count * self.parts, -1),
            defect=difference(state, trajectory.state(np.minimum(rows + 1, count - 1))),
        )

    def predict(self, substeps: SubstepTrajectory, delay: float) -> Prediction:
        """Predict one step from every row, and the readings at a sensor delay [s]."""
        reading = (
            self._delayed(substeps.reading, delay) if delay else substeps.reading[:: self.parts]
        )
        return Prediction(defect=substeps.defect, reading=reading)

    def dynamics(
        self, substeps: SubstepTrajectory, values: Mapping[str, float]
    ) -> tuple[Dynamics, Dynamics]:
        """Linearise the model from row to row and between the substeps."""
        fine = dynamics_along(self.fine, substeps.trajectory, values)
        size = fine.transition.shape[1]
        rows = Dynamics(
            transition=self._joined(fine, np.zeros_like(fine.transition), start=np.eye(size)),
            input_matrix=self._joined(fine, fine.input_matrix),
            output_matrix=fine.output_matrix[:: self.parts],
            feedthrough=fine.feedthrough[:: self.parts],
        )
        return rows, fine

    def columns(
        self,
        substeps: SubstepTrajectory,
        fine: Dynamics,
        values: Mapping[str, float],
        keys: Sequence[str],
    ) -> Columns:
        """Derivatives by parameters from row to row."""
        found = columns_along(self.fine, substeps.trajectory, values, keys, fine)
        reading = found.reading[:: self.parts].copy()
        late = self.plant.candidate_set.sensor_delay
        if late in keys:
            rate = np.concatenate(
                [
                    np.gradient(substeps.reading[first:last], self.fine.samples.step, axis=0)
                    for first, last in self.fine.samples.runs
                ]
            )
            reading[:, :, keys.index(late)] = -self._delayed(rate, float(values.get(late, 0.0)))
        return Columns(keys=tuple(keys), push=self._joined(fine, found.push), reading=reading)

    def _joined(self, fine: Dynamics, push: Floats, start: Floats | None = None) -> Floats:
        """Accumulate the contribution of every part at the end of its row."""
        rows = self.plant.samples.rows
        steps = fine.transition.reshape(rows, self.parts, *fine.transition.shape[1:])
        pushes = push.reshape(rows, self.parts, *push.shape[1:])
        total = np.zeros_like(pushes[:, 0]) if start is None else pushes[:, 0] * 0.0 + start
        for part in range(self.parts):
            total = np.matmul(steps[:, part], total) + pushes[:, part]
        return total

    def _delayed(self, values: Floats, delay: float) -> Floats:
        """Values at the rows as they were a delay earlier, run by run."""
        out = np.empty((self.plant.samples.rows, values.shape[1]))
        runs = zip(self.plant.samples.runs, self.fine.samples.runs, strict=True)
        for (first, last), (begin, end) in runs:
            wanted = self.plant.samples.time[first:last] - delay
            time = self.fine.samples.time[begin:end]
            for k in range(values.shape[1]):
                out[first:last, k] = np.interp(wanted, time, values[begin:end, k])
        return out


_SHARED = ("integrator", "plant", "candidate_set")


class SubstepFitter(Fitter):
    """Fitter whose model is integrated in several steps per row.

    Args:
        integrator: the plant between the rows.
        trajectory: about which the model is linear.
        windows: of the log.
        fine: derivatives from part to part.
        rows: derivatives from row to row.
        at: parameters of the linearisation of the tolerances.
        columns: responses of the tolerances, when they are known.
        fixed: the same, whitened.
    """

    def __init__(
        self,
        integrator: SubstepIntegrator,
        trajectory: Trajectory,
        windows: Windows,
        *,
        fine: Dynamics,
        rows: Dynamics,
        at: Mapping[str, float],
        columns: Columns | None = None,
        fixed: Whitened | None = None,
    ) -> None:
        self.integrator, self.fine = integrator, fine
        self._known: tuple[Mapping[str, float], SubstepTrajectory] | None = None
        super().__init__(
            integrator.plant, trajectory, rows, windows, at=at, columns=columns, fixed=fixed
        )

    def substeps(self, values: Mapping[str, float]) -> SubstepTrajectory:
        """Integrate the model between the rows at given values."""
        used = nonzero(values)
        if self._known is None or self._known[0] != used:
            self._known = used, self.integrator.substeps(self.trajectory, used)
        return self._known[1]

    def with_windows(self, windows: Windows) -> SubstepFitter:
        """Return the same linearisation in other windows."""
        return SubstepFitter(
            self.integrator,
            self.trajectory,
            windows,
            fine=self.fine,
            rows=self.dynamics,
            at=self.at,
            columns=self.columns,
            fixed=windows.rewhitened(self.fixed) if windows.shares_outputs(self.windows) else None,
        )

    def __getstate__(self) -> dict[str, Any]:
        """Pickle without the parts that every process has."""
        windows = copy.copy(self.windows)
        del windows.vehicle, windows.samples
        rest = {k: v for k, v in self.__dict__.items() if k not in _SHARED}
        return rest | {"_known": None, "windows": windows}

    def attach(self, integrator: SubstepIntegrator) -> None:
        """Attach the plant again after unpickling."""
        plant = integrator.plant
        self.integrator, self.plant, self.candidate_set = integrator, plant, plant.candidate_set
        self.windows.vehicle, self.windows.samples = plant.vehicle, plant.samples

    def prediction(
        self, values: Mapping[str, float], expansion_point: ExpansionPoint | None = None
    ) -> Prediction:
        """Predict one step from every row, always exactly, and the readings."""
        late = float(values.get(self.candidate_set.sensor_delay, 0.0)) - self.windows.delay
        return self.integrator.predict(self.substeps(values), late)

    def columns_at(self, keys: Sequence[str], values: Mapping[str, float]) -> Columns:
        """Return the derivatives by parameters at given values, from row to row."""
        return self.integrator.columns(self.substeps(values), self.fine, values, tuple(keys))


def finer(samples: Samples, parts: int) -> Samples:
    """Return samples with several substeps for each row of a log without commands."""
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
        logs=tuple(
            replace(log, first=log.first * parts, last=log.last * parts) for log in samples.logs
        ),
    )
