"""Prediction of cases by batch dynamics at the sensors' sample times; what may be fitted in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.batch import BatchDynamics, Rates, TwinState
from seals.compare.case import Case
from seals.effects.binding import EffectSet
from seals.effects.effect import Effect
from seals.errors import ConfigError, refuse_unlisted
from seals.frames import conjugate, multiply, rotation_vector
from seals.robot.model import RobotModel
from seals.run.settings import RunSettings
from seals.schema import Parameter, parameters_of


@dataclass(frozen=True, kw_only=True)
class FitKey:
    """Number to fit: one parameter, or several axes tied to one value.

    Args:
        key: as written by the user.
        targets: ``"effect.parameter"`` values that it sets, tied together.
        parameter: unit and bounds.
        start: configured value.
    """

    key: str
    targets: tuple[str, ...]
    parameter: Parameter
    start: float

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.targets[0].partition(".")[0]


def fit_keys(keys: list[str], effects: Mapping[str, Effect]) -> list[FitKey]:
    """Resolve keys such as ``effects.drag.coefficient_x+coefficient_y``.

    Raises:
        ConfigError: an effect or parameter does not exist, or may not be fitted.
    """
    return [_resolve(key, effects) for key in keys]


_ELSEWHERE = ("robot", "mass", "inertia", "hulls", "actuators")
"""Heads of keys that a comparison does not fit."""


def _resolve(key: str, effects: Mapping[str, Effect]) -> FitKey:
    name, _, rest = key.removeprefix("effects.").partition(".")
    if name in _ELSEWHERE:
        raise ConfigError(
            f"fit: '{key}' is not a parameter of an effect, and a comparison fits only such "
            "parameters.\n"
            "Masses, inertia, hulls, actuators: seals calibrate log=FOLDER parameters=[mass]"
        )
    refuse_unlisted(name, effects, f"fit: there is no effect '{name}' in '{key}'")
    known = {n: p for n, p in parameters_of(effects[name]).items() if p.fit}
    tied = rest.split("+")
    for parameter in tied:
        refuse_unlisted(
            parameter,
            known,
            f"fit: effect '{name}' has no parameter '{parameter}' that may be fitted",
        )
    return FitKey(
        key=key,
        targets=tuple(f"{name}.{parameter}" for parameter in tied),
        parameter=known[tied[0]],
        start=float(getattr(effects[name], tied[0])),
    )


PREDICTABLE = (
    "position",
    "orientation",
    "velocity",
    "angular_velocity",
    "specific_force",
    "depth",
    "joint_position",
    "joint_velocity",
)


class Job(NamedTuple):
    """Simulation to run: case, deviation of the start, fitted values."""

    case: int
    deviation: Floats
    values: Floats


class Predictor:
    """Predictor that simulates all jobs in one batch.

    Args:
        settings: the model.
        robot: the robot.
        effects: bound effects.
        keys: fitted parameters, in the order of the jobs' values.
        cases: stretches to simulate.
        step: integration step [s].
    """

    def __init__(
        self,
        settings: RunSettings,
        robot: RobotModel,
        effects: EffectSet,
        keys: Sequence[FitKey],
        cases: Sequence[Case],
        *,
        step: float,
    ) -> None:
        self.settings, self.robot, self.effects = settings, robot, effects
        self.keys, self.cases, self.step = tuple(keys), tuple(cases), step

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Return the predicted samples of every job, channel to shape (rows, k)."""
        twin = self.twin_of(jobs, [1] * len(jobs), more={}, waves=self.settings.wave)
        starts = [self.cases[j.case].start.state.moved(j.deviation[None]) for j in jobs]
        state = TwinState(*map(np.concatenate, zip(*starts, strict=True)))
        state = twin.start(**state._asdict())
        steps = max(int(np.ceil(self.cases[j.case].time[-1] / self.step - 1e-9)) for j in jobs) + 1
        wanted = sorted({channel for j in jobs for channel in self.cases[j.case].measured})
        record: dict[str, list[Floats]] = {channel: [] for channel in wanted}
        for k in range(steps):
            following, rates = twin.step(state, k * self.step, self.step)
            for channel in wanted:
                record[channel].append(self._read(channel, state, rates))
            state = following
        for channel in wanted:
            record[channel].append(self._read(channel, state, twin.rates(state, steps * self.step)))
        tables = {channel: np.stack(rows) for channel, rows in record.items()}
        return [self._sample(tables, b, self.cases[j.case]) for b, j in enumerate(jobs)]

    def twin_of(
        self, jobs: Sequence[Job], counts: Sequence[int], *, more: Mapping[str, Any], waves: Any
    ) -> BatchDynamics:
        """Return batch dynamics with ``counts`` rows per job; ``more`` adds to the keys' values."""
        values: dict[str, Array] = {}
        for p, key in enumerate(self.keys):
            column = np.repeat([j.values[p] for j in jobs], counts)
            values.update(dict.fromkeys(key.targets, column))
        for name, extra in more.items():
            values[name] = values.get(name, 0.0) + extra
        return BatchDynamics(
            self.robot,
            self.effects,
            self.settings.environment,
            waves,
            batch=int(np.sum(counts)),
            values=values,
        )

    def _read(self, channel: str, state: TwinState, rates: Rates) -> Floats:
        """Return readings of a perfect sensor, shape (B, k); attitude as x, y, z, w."""
        level = self.settings.environment.water_level
        readings = {
            "position": state.position,
            "orientation": state.quaternion,
            "velocity": state.velocity,
            "angular_velocity": state.angular_velocity,
            "specific_force": rates.specific_force,
            "depth": (0.0 if level is None else level) - state.position[:, 2:3],
            "joint_position": state.joints,
            "joint_velocity": state.joint_velocity,
        }
        return np.array(readings[channel])

    def _sample(self, tables: dict[str, Floats], b: int, case: Case) -> dict[str, Floats]:
        """Interpolate one job's records at the times of the case."""
        place = case.time / self.step
        index = np.minimum(place.astype(np.int64), len(next(iter(tables.values()))) - 2)
        share = (place - index)[:, None]
        return {
            channel: (1.0 - share) * tables[channel][index, b]
            + share * tables[channel][index + 1, b]
            for channel in case.measured
        }


def residuals(case: Case, predicted: dict[str, Floats]) -> dict[str, Floats]:
    """Measured less predicted, channel to shape (rows, k).

    An attitude becomes a rotation vector in body axes [rad].
    """
    out = {}
    for channel, measured in case.measured.items():
        if channel == "orientation":
            q = measured[:, [1, 2, 3, 0]]
            model = predicted[channel] / np.linalg.norm(predicted[channel], axis=1, keepdims=True)
            out[channel] = rotation_vector(multiply(conjugate(model), q))
        else:
            out[channel] = measured - predicted[channel]
    return out


def whitened(case: Case, parts: dict[str, Floats]) -> Floats:
    """Residuals of all channels divided by their noise, as one vector; missing samples are zero."""
    rows = [np.nan_to_num(parts[c] / case.sigma[c]).ravel() for c in case.measured]
    return np.concatenate(rows)
