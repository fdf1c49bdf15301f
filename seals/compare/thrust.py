"""Prediction of the specific force along the rotor axis from the commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case, Regime
from seals.compare.noise import moving_mean, noise_of
from seals.compare.predict import Job
from seals.compare.sampled import SampledPredictor, bare_case, divided
from seals.compare.settings import CompareSettings
from seals.control.actuator_response import respond
from seals.errors import LogError
from seals.logs.log import Log
from seals.motion import Inputs, Reading
from seals.robot.model import RobotModel

_STEP = 1e-3
"""Time between samples after resampling [s]."""
_WINDOW = 11
"""Samples over which accelerometer and prediction are smoothed alike: vibration of the rotors."""
_LOWEST, _FASTEST, _FORCE = 0.3, 250.0, (2.0, 25.0)
"""Pulse width, turning rate [deg/s] and force [m/s^2] outside which the vehicle is not flying."""
_LEAD = 400
"""Samples before a stretch that let the lag settle."""
_LONGEST, _SHORTEST = 3000, 500


def thrust_cases(logs: Sequence[Log], settings: CompareSettings, robot: RobotModel) -> list[Case]:
    """Divide flights into cases in the air; those of the later half are called ``late``.

    Raises:
        LogError: a channel is missing.
    """
    found: list[Case] = []
    for log in logs:
        missing = [c for c in ("specific_force", "motor_pwm") if not log.has(c)]
        if missing:
            raise LogError(f"log '{log.name}' lacks {', '.join(missing)}.\nThrust needs them.")
        found += _stretches(log, max(1, settings.compare.stride))
    for case in found:
        case.given["idle"] = np.array([settings.compare.idle_speed])
    return divided(found, settings)


def _stretches(log: Log, stride: int) -> list[Case]:
    order = np.argsort(log.time, kind="stable")
    time = np.arange(log.time.min(), log.time.max(), _STEP)

    def even(values: Floats) -> Floats:
        return np.stack([np.interp(time, log.time[order], v[order]) for v in values.T], axis=1)

    pulse, force = even(log.channel("motor_pwm")), even(log.channel("specific_force"))
    turning = np.degrees(np.abs(even(log.channel("angular_velocity"))).max(axis=1))
    flying = (pulse.min(axis=1) > _LOWEST) & (turning < _FASTEST)
    flying = np.convolve(~flying, np.ones(401), "same") < 0.5
    flying &= (force[:, 2] > _FORCE[0]) & (force[:, 2] < _FORCE[1])
    smooth = moving_mean(force[:, 2], _WINDOW)
    sigma = noise_of(smooth[flying][::_WINDOW, None], stated=None)
    total, passed = int(flying.sum()), 0
    out: list[Case] = []
    for run in np.split(np.arange(len(time)), np.flatnonzero(np.diff(flying)) + 1):
        if not flying[run[0]]:
            continue
        for rows in np.array_split(run, max(1, round(len(run) / _LONGEST))):
            part = "early" if passed < total // 2 else "late"
            passed += len(rows)
            if len(rows) < _SHORTEST:
                continue
            # from the middle of a step: stretches begin and end beside collisions
            kept = rows[stride // 2 :: stride]
            name = f"{part}/{log.name}_{len(out) + 1}"
            measured = np.full((len(kept), 3), np.nan)
            measured[:, 2] = smooth[kept]
            case = bare_case(
                name,
                time[kept],
                {"specific_force": measured},
                {"specific_force": np.repeat(sigma, 3)},
                regime=Regime.air,
            )
            first = max(0, rows[0] - _LEAD)
            # a window more than is compared: smoothing sees zeros beyond its end
            case.given["pulse"] = pulse[first : rows[-1] + 1 + _WINDOW]
            case.given["rows"] = (kept - first).astype(float)
            out.append(case)
    return out


class ThrustPredictor(SampledPredictor):
    """Specific force of the rotors' thrust on a vehicle whose air forces are neglected."""

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Return the specific force of every job."""
        rows = self.rows_of(jobs)
        counts = [r.stop - r.start for r in rows]
        twin = self.twin_of(jobs, counts, more={}, waves=self.settings.wave)
        drive = np.concatenate([self._drive(j) for j in jobs])
        inputs = Inputs(0.0, twin.no_torque(), drive=drive)
        force = twin.rates(twin.start(), 0.0, inputs).specific_force
        reading = Reading(angular_velocity=force * 0.0, specific_force=force)
        for b in twin.effects.measures:
            reading = b.hooks.measure(reading, b.params)
        return [{"specific_force": np.array(reading.specific_force[r])} for r in rows]

    def _drive(self, job: Job) -> Floats:
        """Rotor speeds after delay and lag at the samples of a job."""
        given = self.cases[job.case].given
        motor = self.effects.actuators[0].hooks
        idle = float(given["idle"][0])
        command = idle + given["pulse"] * (motor.limit.max() - idle)
        lag = delay = 0.0
        for b in self.effects.timings:
            for name in ("time_constant_change", "delay"):
                if hasattr(b.effect, name):
                    value = self.value(f"{b.name}.{name}", job, float(getattr(b.effect, name)))
                    lag, delay = (lag + value, delay) if name[0] == "t" else (lag, delay + value)
        state = respond(
            command,
            _STEP,
            lag=np.maximum(motor.lag + lag, 1e-6) * np.ones(command.shape[1]),
            delay=max(delay, 0.0),
            parts=1,
        )[:, 0]
        smooth = np.stack([moving_mean(s, _WINDOW) for s in state.T], axis=1)
        return np.asarray(smooth[given["rows"].astype(int)])
