"""Radiation force with memory: waves that a floating hull makes act back on it later."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Identification
from seals.errors import ConfigError
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

MOST = 16
"""Largest number of resonators."""


@dataclass(kw_only=True)
class RadiationMemory(Effect):
    """Radiation force of a floating hull with its memory: Cummins' equation in state-space form.

    Equation:
        (F, T) = -g G^T p with p' = -D p - W q + g G nu_r, q' = W p, nu_r = (v_r, w): the
        convolution of the retardation function K(t) with the velocity, whose transform is
        s G^T (s^2 + s D + W^2)^-1 G. W = diag(frequency). g = h (2 - h), h = min(s / s_0,
        (1 - s) / (1 - s_0)): one for a hull that floats as computed, zero in air and deep under
        water. The energy of the waves near the hull, (p^2 + q^2) / 2, only falls without motion.

    Args:
        frequency: W, of m resonators [rad/s].
        damping: D, symmetric m x m matrix, positive definite [1/s].
        coupling: G, one row a resonator for motion along and about body x, y, z
            [kg^0.5/s, kg^0.5 m/s].
        floating_fraction: s_0, submerged share of the hull at which the numbers hold [1].
        strength: factor on the force [1].
        medium: water.

    Assumptions:
        Linear waves about the floating hull, deep water, no forward speed; the added mass at
        infinite frequency belongs to `added_mass` (its ``floating`` matrix). Waves act through the
        relative velocity at the link origin.

    Valid range:
        Amplitudes small against the hull, waves longer than about a tenth of it.

    Limitations:
        The weight g is chosen, not derived; no diffraction beyond the relative velocity, no bottom.
        First order in the step in the batch dynamics, where memory is held over a step.

    References:
        Cummins 1962, Schiffstechnik 9; Ogilvie 1964, 5th Symp. Naval Hydrodynamics; Perez and
        Fossen 2009, Modeling, Identification and Control 30(1).

    Example:
        >>> one = RadiationMemory(
        ...     frequency=[3.0], damping=[[4.0]], coupling=[[0.0, 0.0, 5.0, 0.0, 0.0, 0.0]]
        ... )
        >>> one.memory_size
        2
    """

    frequency: list[float] = field(default_factory=list)
    damping: list[list[float]] = field(default_factory=list)
    coupling: list[list[float]] = field(default_factory=list)
    floating_fraction: float = param(
        0.5, "1", bounds=(0.001, 0.999), tolerance=0.0, source="half submerged", fit=False
    )
    strength: float = param(
        1.0,
        "1",
        bounds=(0.0, 10.0),
        tolerance=0.1,
        source="the numbers as computed from the hull's shape",
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("radiation damping",)
    zero_when_dry: ClassVar[bool] = True
    material: ClassVar[dict[str, list[float] | list[list[float]]]] = {
        "frequency": [3.0, 6.0],
        "damping": [[4.0, 1.0], [1.0, 6.0]],
        "coupling": [[2.0, 1.0, 3.0, 0.1, 0.2, 0.0], [0.5, 2.0, 1.0, -0.1, 0.1, 0.1]],
    }
    # computed from a shape; told from drag only by several runs
    identification: ClassVar[Identification] = Identification(
        confounders=("radiation_damping", "linear_drag"), searched=False, compared=None
    )

    def __post_init__(self) -> None:
        """Refuse matrices of other shapes, and damping that could feed energy.

        Raises:
            ConfigError: shapes do not fit, or the damping is not symmetric positive definite.
        """
        count = len(self.frequency)
        if count > MOST:
            raise ConfigError(
                f"radiation_memory.frequency has {count} numbers.\nAllowed: {MOST} at most."
            )
        _check_rows("damping", self.damping, count, count)
        _check_rows("coupling", self.coupling, count, 6)
        if not all(0.0 < w < 1e6 for w in self.frequency):
            raise ConfigError(
                f"radiation_memory.frequency={list(self.frequency)} is not allowed.\n"
                "Allowed: positive numbers below 1e6 rad/s."
            )
        damping = np.asarray(self.damping, dtype=float).reshape(count, count)
        if count and (
            not np.allclose(damping, damping.T, rtol=1e-6, atol=0.0)
            or np.linalg.eigvalsh(damping)[0] <= 0.0
        ):
            raise ConfigError(
                "radiation_memory.damping is not symmetric and positive definite: "
                "waves would add energy to the motion.\n"
                "Use the numbers that seals new hydrodynamics writes."
            )

    @property
    def memory_size(self) -> int:  # type: ignore[override]
        """Number of memory values per link: real and imaginary part of every mode."""
        return 2 * len(self._modes[0]) if self.frequency else 0

    def constants(self) -> dict[str, Floats]:
        """Return the modes: poles (1, 2, n), input and output coefficients (1, 2, 6, n)."""
        if not self.frequency:
            return {"rate": np.zeros((1, 2, 0))}
        names = ("rate", "entry", "exit")
        return {
            name: np.stack((x.real, x.imag))[None]
            for name, x in zip(names, self._modes, strict=True)
        }

    @functools.cached_property
    def _modes(self) -> tuple[Floats, Floats, Floats]:
        return _modes_of(
            np.asarray(self.frequency, dtype=float),
            np.asarray(self.damping, dtype=float),
            np.asarray(self.coupling, dtype=float),
        )

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force and torque of the waves radiated so far [N, N m]; memory is held at half steps."""
        rate = params["rate"][0, :, :]
        count = rate.shape[1]
        if not count:
            return Wrench(motion.velocity * 0.0, None), memory
        xp = namespace(motion.velocity)
        weight = _weight(medium.submersion, params["floating_fraction"])
        twist = xp.concat((motion.velocity - medium.velocity, motion.angular_velocity), axis=1)
        entry, out = params["entry"], params["exit"]
        before = memory[:, :count], memory[:, count:]
        driven = weight * twist
        pushed = driven @ entry[0, 0, :, :], driven @ entry[0, 1, :, :]
        step = inputs.step
        (x, y), (u, v) = before, pushed
        half, turn = 0.5 * step * rate[0:1, :], 0.5 * step * rate[1:2, :]
        right = x * (1.0 + half) - y * turn + step * u, y * (1.0 + half) + x * turn + step * v
        size = (1.0 - half) ** 2 + turn**2
        after = (
            (right[0] * (1.0 - half) - right[1] * turn) / size,
            (right[1] * (1.0 - half) + right[0] * turn) / size,
        )
        real, imaginary = (0.5 * (a + b) for a, b in zip(before, after, strict=True))
        both = real @ out[0, 0, :, :].T - imaginary @ out[0, 1, :, :].T
        wrench = -params["strength"] * weight * both
        return Wrench(wrench[:, :3], wrench[:, 3:]), xp.concat(after, axis=1)


def _weight(submersion: Array, floating: Array) -> Array:
    """Weight by submersion: 1 with zero slope at the floating fraction, 0 when dry or submerged."""
    xp = namespace(submersion)
    lack = xp.clip((floating - submersion) / floating, 0.0, None)
    surplus = xp.clip((submersion - floating) / (1.0 - floating), 0.0, None)
    return 1.0 - (lack + surplus) ** 2


def _modes_of(
    frequency: Floats, damping: Floats, coupling: Floats
) -> tuple[Floats, Floats, Floats]:
    """Modes of the resonators, one of every conjugate pair.

    Returns:
        Complex poles [1/s], shape (n,); entry from the velocity, and exit to the wrench, twice for
        one of a pair, shape (6, n) each.
    """
    count = len(frequency)
    matrix = np.zeros((2 * count, 2 * count))
    matrix[:count, :count] = -damping
    matrix[:count, count:], matrix[count:, :count] = -np.diag(frequency), np.diag(frequency)
    rate, vectors = np.linalg.eig(matrix)
    into = np.linalg.solve(vectors, np.vstack((coupling, np.zeros_like(coupling))) + 0j)
    out = vectors[:count].T @ coupling
    kept = rate.imag >= 0.0
    twice = np.where(rate.imag > 0.0, 2.0, 1.0)[:, None]
    return rate[kept], into[kept].T, (twice * out)[kept].T


def _check_rows(name: str, rows: Sequence[Sequence[float]], count: int, width: int) -> None:
    found = [len(row) for row in rows]
    finite = all(np.isfinite(x) for row in rows for x in row)
    if found != [width] * count or not finite:
        raise ConfigError(
            f"radiation_memory.{name} has rows of {found} numbers, or one is not finite.\n"
            f"Allowed: {count} rows of {width} finite numbers, one row for every frequency."
        )
