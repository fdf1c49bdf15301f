"""Airy wave: one regular wave of small steepness on deep water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, columns, namespace
from seals.effects import Addition, Freed, Identification, Residual, Stage, Subject
from seals.effects.discrepancy import WaveMoment
from seals.effects.effect import Effect, MediumKind
from seals.environment.seawater import FRESH_WATER
from seals.environment.waves import Sea, WaveOptions, gradient_along
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.schema import param

_POINT = 0.3
"""1-sigma of the place where the push of waves acts, as a share of the way from origin to centre of
buoyancy: a hull feels them all along its length."""
_KEEP = 2
"""Starting values that are kept."""
_SHORTEST, _LONGEST, _FINEST = 0.5, 6.0, 0.005
"""Periods that are tried [s], and the least relative step between them."""


@roles(data="second_order")
@dataclass(kw_only=True)
class WaveAiry(WaveOptions):
    """Airy wave on deep water: elevation, velocity and acceleration of the water.

    Equation:
        eta = a cos(theta), theta = k (x cos b + y sin b) - 2 pi t/P + phi, k = (2 pi/P)^2/g;
        orbital velocity a w exp(k z) (cos b cos theta, sin b cos theta, sin theta), z below the
        mean level. With the second-order crest of Stokes, eta gains k a^2/2 cos(2 theta).

    Args:
        amplitude: a [m].
        period: P [s].
        direction: b, toward which the wave runs, from east anticlockwise [rad].
        phase: phi [rad].
        gravity: [m/s^2].
        second_order: whether crests are sharper and troughs flatter, by Stokes' second order.

    A copy (``copy.copy``) may hold an array of shape (N,) in any field: one wave for each of the N
    points given to `at`, in their array library.

    Assumptions:
        Linear theory, deep water.

    Valid range:
        Steepness k a below 0.3; depth above half a wave length.

    Limitations:
        No breaking, velocity above the mean level held at its value there.

    References:
        Airy 1845; Stokes 1847; Faltinsen 1990, Sea Loads on Ships and Offshore Structures, ch. 2.

    Example:
        >>> round(WaveAiry(amplitude=0.1, period=2.0).wavenumber, 4)
        1.0061
    """

    amplitude: float = param(0.05, "m", bounds=(0.0, 30.0), tolerance=0.005, source="chosen")
    period: float = param(2.0, "s", bounds=(0.1, 60.0), tolerance=0.02, source="chosen")
    direction: float = param(0.0, "rad", bounds=(-7.0, 7.0), tolerance=0.05, source="chosen")
    phase: float = param(0.0, "rad", bounds=(-7.0, 7.0), tolerance=0.05, source="chosen")
    gravity: float = param(
        9.81, "m/s^2", bounds=(0.1, 30.0), tolerance=0.01, source="standard gravity", fit=False
    )

    second_order: bool = False

    candidate: ClassVar[str] = "waves"
    per_log: ClassVar[tuple[str, ...]] = ("phase",)
    """Fields of which each of several logs has its own: their times have other origins."""
    identification: ClassVar[Identification] = Identification(
        scales={"amplitude": 0.03, "period": 1.0, "direction": 2.0, "phase": 2.0},
        guessed=True,
        placed=True,
        approximate=True,
    )

    @classmethod
    def additions(cls, subject: Subject) -> list[Addition]:
        """Return the candidate waves, with the moment of the wave force about the link origin."""
        if not subject.has_water:
            return []
        order, bounds = (Stage.water, 0, 5), {"period": (0.3, 20.0), "amplitude": (0.0, 2.0)}
        free = (-math.inf, math.inf)
        parameters = {
            k: Freed(scale=v, bounds=bounds.get(k, free))
            for k, v in cls.identification.scales.items()
        }
        sea = Addition(instance=cls.candidate, effect=None, parameters=parameters, order=order)
        found = [
            Addition(
                instance=name,
                effect=effect,
                parameters={"share": Freed(tolerance=_POINT, scale=1.0)},
                named=(),
                order=order,
            )
            for name, effect in cls.beside().items()
        ]
        return [sea, *found]

    @classmethod
    def of_log(cls, **parameters: float) -> WaveAiry:
        """Return the waves that a log states by these parameters, with second-order crests."""
        return cls(**parameters, second_order=True)

    @staticmethod
    def beside() -> dict[str, Effect]:
        """Return the effects that accompany the waves of a log: their force acts on the origin."""
        return {"wave_moment": WaveMoment()}

    @staticmethod
    def guesses(residual: Residual) -> list[dict[str, float]]:
        """Return starting values: the waves that fit the residual force best."""
        return _guessed(residual)

    @staticmethod
    def plausible(position: Floats) -> dict[str, float]:
        """Return plausible parameters: a small wave."""
        return {"amplitude": 0.03, "period": 2.0, "direction": 0.5, "phase": 0.3}

    def __post_init__(self) -> None:
        """Refuse waves too steep for the theory."""
        steepness = self.wavenumber * self.amplitude
        if steepness > 0.3:
            raise ConfigError(
                f"a wave of amplitude {self.amplitude} m and period {self.period} s "
                f"has the steepness {steepness:.2f}.\n"
                "Allowed: k a up to 0.3; lower the amplitude or raise the period."
            )

    @property
    def wavenumber(self) -> float:
        """Wave number k [rad/m] of the deep-water dispersion relation."""
        return (2.0 * math.pi / self.period) ** 2 / self.gravity

    @property
    def shortest(self) -> float:
        """Length of the wave [m]."""
        return 2.0 * math.pi / self.wavenumber

    def _angle(self, position: Array, time: Array) -> Array:
        """Angle theta at points, shape (N,)."""
        (east, north), omega = _heading(self.direction), 2.0 * math.pi / self.period
        along = east * position[:, 0] + north * position[:, 1]
        return self.wavenumber * along - omega * time[:, 0] + self.phase

    def displacement(self, position: Array, time: Array, level: float) -> Array:
        """Return the displacement of the water from its rest position [m], shape (N, 3)."""
        xp = namespace(position)
        (east, north), k = _heading(self.direction), self.wavenumber
        theta = self._angle(position, time)
        radius = self.amplitude * xp.exp(k * xp.clip(position[:, 2] - level, None, 0.0))
        back = -radius * xp.sin(theta)
        lift = radius * xp.cos(theta) + 0.5 * k * radius * radius
        return columns(east * back, north * back, lift)

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points."""
        xp = namespace(position)
        (east, north), k = _heading(self.direction), self.wavenumber
        omega = 2.0 * math.pi / self.period
        theta = self._angle(position, time)
        cosine, sine = self.amplitude * xp.cos(theta), self.amplitude * xp.sin(theta)
        slope, crest, lift = -k * sine, cosine, sine
        if self.second_order:
            crest = crest + 0.5 * k * (cosine * cosine - sine * sine)
            lift = sine + 2.0 * k * sine * cosine
            slope = -k * lift
        length = xp.sqrt(1.0 + slope * slope)
        decay = xp.exp(k * xp.clip(position[:, 2] - level, None, 0.0))
        speed, push = omega * decay, omega * omega * decay
        return Sea(
            elevation=(level + crest)[:, None],
            normal=columns(-east * slope / length, -north * slope / length, 1.0 / length),
            rise=(omega * lift / length)[:, None],
            velocity=columns(east * speed * cosine, north * speed * cosine, speed * sine),
            acceleration=columns(east * push * sine, north * push * sine, -push * cosine),
            gradient=gradient_along(east, north, -k * speed * sine, k * speed * cosine),
        )


def _heading(direction: Array) -> tuple[Array, Array]:
    """Cosine and sine of the direction: numbers of a number, arrays (N,) of an array."""
    if isinstance(direction, int | float):
        return math.cos(direction), math.sin(direction)
    xp = namespace(direction)
    return xp.cos(direction), xp.sin(direction)


def _guessed(residual: Residual) -> list[dict[str, float]]:
    """Waves whose force fits best, over a grid of periods and directions."""
    log = np.broadcast_to(np.asarray(residual.log), len(residual.force))
    logs = [_RegularPush(residual, log == k) for k in np.unique(log)]
    longest = max(float(np.ptp(part.time)) for part in logs)
    directions = np.arange(0.0, 2.0 * np.pi, np.pi / 8.0)
    found = []
    out = [_SHORTEST]
    while out[-1] < _LONGEST:
        out.append(out[-1] * (1.0 + min(max(0.25 * out[-1] / longest, _FINEST), 0.04)))
    for period in out:
        fits = [part.fit(period, directions) for part in logs]
        left = np.sum([f[0] for f in fits], axis=0)
        for k in np.argsort(left)[:_KEEP]:
            found.append((float(left[k]), period, float(directions[k]), [f[1][k] for f in fits]))
    found.sort(key=lambda f: f[0])
    kept: list[Any] = []
    for one in found:
        if all(_apart(one, other) for other in kept) and len(kept) < _KEEP:
            kept.append(one)
    return [_values(period, direction, waves) for _, period, direction, waves in kept]


def _apart(one: Any, other: Any) -> bool:
    """Return true if two waves are not neighbours in period and direction."""
    turn = abs(math.remainder(one[2] - other[2], 2.0 * math.pi))
    return turn > 0.25 * math.pi or abs(math.log(one[1] / other[1])) > 0.1


def _values(period: float, direction: float, waves: Sequence[Floats]) -> dict[str, float]:
    """Parameters of a wave from its two phases in every log."""
    amplitude = float(np.mean([np.hypot(*pair) for pair in waves]))
    phases = {
        f"phase_{k + 1}" if k else "phase": float(np.arctan2(pair[1], pair[0]))
        for k, pair in enumerate(waves)
    }
    return {"amplitude": amplitude, "period": period, "direction": direction} | phases


class _RegularPush:
    """Force of regular waves of unit amplitude along one log, fitted to the residual force.

    Equation:
        F = (rho V + M_A) a_water, and rho g A_wp eta upward where the hull pierces the surface.
    """

    def __init__(self, residual: Residual, rows: Any) -> None:
        subject, environment = residual.subject, residual.subject.environment
        hull, density = subject.hull, environment.water_density or FRESH_WATER
        volume = hull.volume if hull is not None else 0.0
        area = hull.plan_area if hull is not None else 0.0
        added = float(subject.nominal("added_mass", "mass", MediumKind.water)[2])
        self.mass, self.gravity = density * volume + added, environment.gravity
        self.position, self.force = residual.position[rows], residual.force[rows]
        self.time = residual.time[rows]
        self.depth = self.position[:, 2] - (environment.water_level or 0.0)
        pierces = np.abs(self.depth) < volume / max(area, 1e-9)
        self.stiffness = density * environment.gravity * area * pierces

    def fit(self, period: float, directions: Floats) -> tuple[Floats, Floats]:
        """Residual sum of squares and the two phases of the best wave, for some directions.

        Returns:
            Square [N^2], shape (D,), and amplitude times cosine and sine of the phase, (D, 2).
        """
        omega = 2.0 * np.pi / period
        k = omega**2 / self.gravity
        decay = np.exp(k * np.minimum(self.depth, 0.0))
        level = self.mass * omega**2 * decay
        upward = self.stiffness - level
        heading = np.stack([np.cos(directions), np.sin(directions)])
        theta = k * heading.T @ self.position[:, :2].T - omega * self.time
        sine, cosine = np.sin(theta), np.cos(theta)
        along, lift = heading.T @ self.force[:, :2].T * level, self.force[:, 2] * upward
        inner = np.empty((len(directions), 2, 2))
        inner[:, 0, 0] = sine**2 @ level**2 + cosine**2 @ upward**2
        inner[:, 1, 1] = cosine**2 @ level**2 + sine**2 @ upward**2
        inner[:, 0, 1] = inner[:, 1, 0] = (sine * cosine) @ (level**2 - upward**2)
        right = np.stack(
            [(sine * along + cosine * lift).sum(1), (cosine * along - sine * lift).sum(1)], axis=1
        )
        inner += 1e-12 * np.trace(inner, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        solved: Floats = np.linalg.solve(inner, right[:, :, None])[:, :, 0]
        left: Floats = np.sum(self.force**2) - np.sum(solved * right, axis=1)
        return left, solved
