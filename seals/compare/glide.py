"""Prediction of steady glides: force balance at the measured pitch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.batch import BatchDynamics
from seals.compare.case import Case
from seals.compare.noise import moving_mean, noise_of
from seals.compare.predict import Job
from seals.compare.sampled import SampledPredictor, bare_case, divided
from seals.compare.settings import CompareSettings
from seals.errors import ConfigError, LogError
from seals.logs.log import Log
from seals.robot.model import RobotModel

NEEDED = ("depth", "pitch", "ballast_volume", "water_density")
_WINDOW = 15
"""Samples over which a log of one a second is smoothed."""
_SHALLOW, _FLAT, _FASTEST = 6.0, 0.2, 0.6
"""Depth [m], pitch [rad] and rate [m/s] within which a glide is not steady."""
_PUMPING = 0.5e-6
"""Ballast rate from which on the pump runs [m^3/s]."""
_SETTLING = 30
"""Samples on each side of pumping that are left out."""
_SHORTEST = 60
_ITERATIONS = 20
_ACROSS = 0.2
"""Speed across the axis up to which a glide is looked for: beyond it a wing has stalled [m/s]."""


def glide_cases(logs: Sequence[Log], settings: CompareSettings, robot: RobotModel) -> list[Case]:
    """Cut a flight into dives and climbs; the later half is called ``late``.

    Raises:
        LogError: a channel is missing.
    """
    found: list[Case] = []
    for log in logs:
        missing = [c for c in NEEDED if not log.has(c)]
        if missing:
            raise LogError(f"log '{log.name}' lacks {', '.join(missing)}.\nA glide needs them.")
        found += _glides(log, max(1, settings.compare.stride))
    return divided(found, settings)


def _glides(log: Log, stride: int) -> list[Case]:
    depth, pitch, ballast, density = (log.channel(c)[:, 0] for c in NEEDED)
    rate = moving_mean(np.gradient(depth, log.time), _WINDOW)
    pitch, density = moving_mean(pitch, _WINDOW), moving_mean(density, _WINDOW)
    ballast = moving_mean(ballast, _WINDOW)
    pumping = np.abs(np.gradient(ballast, log.time)) > _PUMPING
    near = np.convolve(pumping, np.ones(2 * _SETTLING + 1), "same") > 0
    good = (depth > _SHALLOW) & (np.abs(pitch) > _FLAT) & ~near & np.isfinite(rate)
    good &= np.abs(rate) < _FASTEST
    good[: 4 * _WINDOW] = good[-4 * _WINDOW :] = False
    sense = np.sign(pitch) * good
    edges = np.flatnonzero(np.diff(sense) != 0) + 1
    sigma = noise_of(np.gradient(depth, log.time)[:, None], stated=None) / np.sqrt(_WINDOW)
    middle = 0.5 * (log.time[0] + log.time[-1])
    out: list[Case] = []
    for rows in np.split(np.arange(log.rows), edges):
        if not sense[rows[0]] or rows.size < _SHORTEST:
            continue
        # from the middle of a step: the first rows of a glide are the least steady ones
        kept = rows[stride // 2 :: stride]
        kind = "climb" if sense[kept[0]] > 0 else "dive"
        part = "early" if log.time[kept[0]] < middle else "late"
        measured = {"depth_rate": rate[kept, None]}
        noise = {"depth_rate": sigma}
        if log.has("speed_through_water"):
            measured["speed_through_water"] = log.channel("speed_through_water")[kept]
            noise["speed_through_water"] = noise_of(log.channel("speed_through_water"), stated=0.01)
        case = bare_case(f"{part}/{kind}_{len(out) + 1}", log.time[kept], measured, noise)
        columns = (pitch[kept], ballast[kept], density[kept], depth[kept])
        case.given.update(zip(("pitch", "ballast", "density", "depth"), columns, strict=True))
        out.append(case)
    return out


class GlidePredictor(SampledPredictor):
    """Predictor of glide speeds by force balance along and across the axis.

    A model without any law across the axis is one that moves along it: there the angle of attack is
    held at zero.
    """

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Return depth rate and speed of every job."""
        rows = self.rows_of(jobs)
        counts = [r.stop - r.start for r in rows]
        given = {
            k: np.concatenate([self.cases[j.case].given[k] for j in jobs])
            for k in ("pitch", "ballast", "density", "depth")
        }
        twin = self.twin_of(
            jobs, counts, more=self._volume(jobs, counts, given), waves=self.settings.wave
        )
        velocity = _balanced(twin, given["pitch"], given["depth"])
        along, up = velocity[:, 0], velocity[:, 1]
        climb = along * np.sin(given["pitch"]) + up * np.cos(given["pitch"])
        table = {"depth_rate": -climb, "speed_through_water": np.hypot(along, up)}
        return [
            {c: table[c][r, None] for c in self.cases[j.case].measured}
            for j, r in zip(jobs, rows, strict=True)
        ]

    def _volume(
        self, jobs: Sequence[Job], counts: Sequence[int], given: dict[str, Floats]
    ) -> dict[str, Floats]:
        """Return the displaced volume that ballast and the measured density add."""
        level = self.settings.environment.water_density
        if level is None or "buoyancy" not in self.effects.index:
            raise ConfigError(
                "a glide needs buoyancy and one density.\n"
                "Give water=fossen and environment.water_density, the water density for which "
                "the hull is trimmed."
            )
        hull = self.robot.hulls[0]
        volume = 0.0 if hull is None else hull.volume
        change = np.repeat([self.value("buoyancy.volume_change", j, 0.0) for j in jobs], counts)
        whole = volume + change + given["ballast"]
        return {"buoyancy.volume_change": given["density"] / level * whole - volume - change}


def _balanced(twin: BatchDynamics, pitch: Floats, depth: Floats) -> Floats:
    """Return the equilibrium velocity along body x and z, shape (N, 2), by Newton's method."""
    count = len(pitch)
    rpy = np.stack([np.zeros(count), -pitch, np.zeros(count)], axis=1)
    base = twin.start(position=np.stack([0 * depth, 0 * depth, -depth], axis=1), rpy=rpy)

    def push(v: Floats) -> Floats:
        full = np.stack([v[:, 0], np.zeros(count), v[:, 1]], axis=1)
        rates = twin.rates(base._replace(velocity=full), 0.0)
        return np.asarray(rates.velocity[:, [0, 2]])

    limit = np.array([1.5, _ACROSS])
    v = np.stack([np.full(count, 0.3), np.zeros(count)], axis=1)
    v[:, 1] = 0.02 * np.sign(pitch)
    slope = (push(v + np.array([0.0, 1e-3])) - push(v))[:, 1] / 1e-3
    free = np.abs(slope) > 1e-9
    v[:, 1] *= free
    for _ in range(_ITERATIONS):
        at = push(v)
        a = (push(v + np.array([1e-5, 0.0])) - at) / 1e-5
        b = (push(v + np.array([0.0, 1e-5])) - at) / 1e-5
        b = np.where(free[:, None], b, [0.0, 1.0])
        at = np.where(np.stack([np.ones(count, dtype=bool), free], axis=1), at, 0.0)
        a = np.where(free[:, None], a, a * [1.0, 0.0])
        det = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        det = np.where(np.abs(det) < 1e-12, -1e-12, det)
        step = np.stack(
            [
                (at[:, 0] * b[:, 1] - at[:, 1] * b[:, 0]) / det,
                (a[:, 0] * at[:, 1] - a[:, 1] * at[:, 0]) / det,
            ],
            axis=1,
        )
        v = np.clip(v - np.clip(step, -0.1, 0.1), -limit, limit)
    return v
