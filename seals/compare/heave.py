"""Prediction of heave in regular waves: amplitude relative to the undisturbed wave."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.batch import BatchDynamics
from seals.compare.case import Case
from seals.compare.predict import Job
from seals.compare.sampled import SampledPredictor, bare_case, divided
from seals.compare.settings import CompareSettings
from seals.errors import ConfigError, LogError
from seals.logs.log import Log
from seals.robot.model import RobotModel

Complex = NDArray[np.complex128]
PROBES = (4, 6)
"""Probes on both sides of the model's place."""
_WAY, _RAMP, _PERIODS = 7.0, 8, 6
"""Way from wave maker to model [m], periods until steady, periods that are measured."""
_PHASES = 12
_ROUNDS = 4
_LARGEST = 0.1
"""Amplitude up to which the model's own motion is followed [m]."""
_SMALL = 1e-3


def heave_cases(logs: Sequence[Log], settings: CompareSettings, robot: RobotModel) -> list[Case]:
    """Return one case for every pair of runs, with the body and with the waves alone.

    Raises:
        LogError: there is no run with the model, or one lacks the same waves without it.
    """
    bare = [log for log in logs if not log.has("position")]
    waves = {log.meta["wave"]["index"] + _height(log): log for log in bare}
    found: list[Case] = []
    for log in [log for log in logs if log.has("position")]:
        alone = waves.get(log.meta["wave"]["index"] + _height(log))
        if alone is None:
            raise LogError(f"log '{log.name}' has no run of the same waves without the model.")
        found.append(_case(log, alone))
    if not found:
        raise LogError(
            "no run contains the heave of the model (position_z).\nGive runs with the model."
        )
    return divided(found, settings)


def _height(log: Log) -> str:
    return f"/{log.meta['wave']['nominal_height']}"


def _case(log: Log, alone: Log) -> Case:
    omega = float(log.meta["wave"]["angular_frequency"])
    gravity = 9.81
    begin = _onset(log)
    shift = begin - _onset(alone)
    period = 2.0 * np.pi / omega
    # the group runs at half the phase speed
    first = begin + _WAY * 2.0 * omega / gravity + _RAMP * period
    span = (first, first + _PERIODS * period)
    parts = [
        abs(
            _amplitude(
                alone.time + shift,
                alone.channel("wave_elevation")[:, _column(alone, p)],
                omega,
                span,
            )
        )
        for p in PROBES
    ]
    wave = float(np.mean(parts))
    heave = log.channel("position")[:, 2]
    size = abs(_amplitude(log.time, heave, omega, span)) / wave
    halves = [
        abs(_amplitude(log.time, heave, omega, (a, a + 2.0 * period))) / wave
        for a in first + 2.0 * period * np.arange(3)
    ]
    spread = float(np.hypot(np.std(halves), size * abs(parts[0] - parts[1]) / wave / 2.0))
    case = bare_case(
        log.name,
        np.array([first]),
        {"heave_response": np.array([[size]])},
        {"heave_response": np.array([max(spread, 1e-3)])},
        notes=[f"wave of {1e3 * wave:.1f} mm amplitude, {omega:.3f} rad/s"],
    )
    case.given.update({"amplitude": np.array([wave]), "omega": np.array([omega])})
    return case


def _column(log: Log, probe: int) -> int:
    from seals.logs.channels import columns_of

    return columns_of("wave_elevation", log.columns).index(f"wave_elevation_{probe}")


def _onset(log: Log) -> float:
    stroke = log.channel("wave_maker_position")[:, 0]
    away = np.abs(stroke - np.median(stroke[:200]))
    return float(log.time[np.argmax(away > 0.05 * away.max())])


def _amplitude(time: Floats, values: Floats, omega: float, span: tuple[float, float]) -> complex:
    rows = (time > span[0]) & (time < span[1]) & np.isfinite(values)
    t = time[rows]
    table = np.stack([np.cos(omega * t), np.sin(omega * t), np.ones(t.size)], axis=1)
    found = np.linalg.lstsq(table, values[rows], rcond=None)[0]
    return complex(found[0] - 1j * found[1])


class HeavePredictor(SampledPredictor):
    """Predictor of heave by harmonic balance.

    Equation:
        -w^2 Z = F(w) + a(Z): F is the first harmonic of the acceleration of the held body in the
        wave, a that of the body moving with amplitude Z in calm water, found in turn.
    """

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Return the heave response of every job."""
        given = [self.cases[j.case].given for j in jobs]
        wave, omega = (np.array([g[k][0] for g in given]) for k in ("amplitude", "omega"))
        phases = 2.0 * np.pi * np.arange(_PHASES) / _PHASES
        turn = np.tile(phases, len(jobs))
        every = np.repeat(omega, _PHASES)
        excited = self._harmonic(
            self._twin_in(jobs, np.repeat(wave, _PHASES), every), turn, every, 0.0 * every
        )
        calm = self._twin_in(jobs, 0.0 * every, every)
        size = wave.copy()
        for _ in range(_ROUNDS):
            followed = np.clip(size, _SMALL, _LARGEST)
            own = self._harmonic(calm, turn, every, np.repeat(followed, _PHASES)) / followed
            found = excited / (-(omega**2) - own)
            size = np.clip(np.abs(found), _SMALL, None)
        return [{"heave_response": np.array([[r]])} for r in np.abs(found) / wave]

    def _twin_in(self, jobs: Sequence[Job], amplitude: Floats, omega: Floats) -> BatchDynamics:
        sea: Any = copy.copy(self.settings.wave)
        if not hasattr(sea, "amplitude"):
            raise ConfigError("heave in waves needs waves.\nUse wave=airy.")
        sea.amplitude, sea.period = amplitude, 2.0 * np.pi / omega
        return self.twin_of(jobs, [_PHASES] * len(jobs), more={}, waves=sea)

    def _harmonic(
        self, twin: BatchDynamics, turn: Floats, omega: Floats, amplitude: Floats
    ) -> Complex:
        """First harmonic of the vertical acceleration, one complex number a job."""
        zero = np.zeros_like(turn)
        height = self.settings.initial.position[2]
        position = np.stack([zero, zero, height + amplitude * np.cos(turn)], axis=1)
        velocity = np.stack([zero, zero, -omega * amplitude * np.sin(turn)], axis=1)
        state = twin.start(position=position, velocity=velocity)
        rates = twin.rates(state, (turn / omega)[:, None])
        pushed = np.asarray(rates.velocity[:, 2]).reshape(-1, _PHASES)
        wave = np.exp(-1j * turn.reshape(-1, _PHASES))
        return np.asarray(2.0 * (pushed * wave).mean(axis=1))
