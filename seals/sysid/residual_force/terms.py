"""Terms of a formula: unit, description, and wrench along a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.laws import DRIVEN, FORCES, SCALARS, TORQUES

SWING, SHAKE = "swing", "shake"
"""Kinds of two laws each: in phase and a quarter period later."""
STEMS: Mapping[str, tuple[str, ...]] = {
    SWING: ("swing_cos", "swing_sin"),
    SHAKE: ("shake_cos", "shake_sin"),
}
UNITS: Mapping[str, str] = {
    "push": "N",
    "hold": "N",
    "twist": "N m",
    "drag": "N",
    "lift": "kg",
    "spin": "N m s/rad",
    "wheel": "N m s/rad",
    "pull": "N",
    "spot": "N",
    "near": "N",
    "beyond": "N",
    "swing": "N",
    "shake": "N m",
    "thrust": "1",
}
"""Unit of the coefficients of each kind; of a power law at 1 m/s or 1 m."""
SYMBOLS: Mapping[str, str] = {
    "push": "F = c (body)",
    "hold": "F = c (world)",
    "twist": "T = c (body)",
    "drag": "F = -c |v|^{drag_power:.2g} v/|v| (v in m/s)",
    "lift": "F = c (w x v)",
    "spin": "T = -c w",
    "wheel": "T = -(w x c)",
    "pull": "F = c (a - p)/r^{next_power:.2g}, r^2 = |a - p|^2 + {core:.2g}^2, a = {place}",
    "spot": "F = c (world) exp(-|p - a|^2/(2 x {spread:.2g}^2)), a = {place}",
    "near": "F = c up/(z - {level:.2g})^{near_power:.2g}",
    "beyond": "F = c (world) where p . {normal} > {edge:.2g} m",
    "swing": "F = c cos({rate:.3g} t) + s sin({rate:.3g} t) (body)",
    "shake": "T = c cos({rate:.3g} t) + s sin({rate:.3g} t) (body)",
    "thrust": "(F, T) = c x (wrench of the actuators)",
}

FITTED: Mapping[str, int] = {
    "pull": 5,
    "spot": 4,
    "beyond": 3,
    "drag": 1,
    "near": 1,
    "swing": 1,
    "shake": 1,
}
"""Settings that were fitted to the log, by kind."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """Term of a formula: a law times its coefficients.

    Args:
        kind: of the law.
        medium: in which it acts: any, air or water.
        settings: what the law holds besides its coefficients: exponents, places, rates.
        coefficients: one, or one an axis; of a swing first in phase, then a quarter period later.
        sd: their standard errors.
    """

    kind: str
    medium: str = "any"
    settings: Mapping[str, Any] = field(default_factory=dict)
    coefficients: tuple[float, ...] = ()
    sd: tuple[float, ...] = ()

    @property
    def unit(self) -> str:
        """Unit of the coefficients."""
        return UNITS[self.kind]

    @property
    def law(self) -> str:
        """The law in symbols."""
        words: dict[str, Any] = dict(self.settings)
        if "pull_power" in words:
            words["next_power"] = words["pull_power"] + 1.0
        for name in ("place", "normal"):
            if name in words:
                words[name] = "(" + ", ".join(f"{x:.2f}" for x in words[name]) + ")"
        text = SYMBOLS[self.kind].format(**words)
        return text if self.medium == "any" else f"{text}, in {self.medium} only"

    @property
    def freedom(self) -> int:
        """Number of fitted values: coefficients and settings."""
        width = 1 if self.kind in SCALARS else 3 * len(STEMS.get(self.kind, (self.kind,)))
        return width + FITTED.get(self.kind, 0)

    def parameters(self) -> dict[str, float]:
        """Parameters of the effect ``formula`` that switch this term on."""
        out: dict[str, float] = {}
        stems = STEMS.get(self.kind, (self.kind,))
        width = 1 if self.kind in SCALARS else 3
        for k, stem in enumerate(stems):
            part = self.coefficients[k * width : (k + 1) * width]
            names = [stem] if width == 1 else [f"{stem}_{a}" for a in "xyz"]
            out |= dict(zip(names, map(float, part), strict=True))
        for name, value in self.settings.items():
            if np.ndim(value):
                parts = zip("xyz", value, strict=True)
                out |= {f"{name}_{a}": float(x) for a, x in parts}
            else:
                out[name] = float(value)
        return out

    def to_dict(self) -> dict[str, Any]:
        """Return kind, law, settings and coefficients."""
        settings = {k: np.asarray(v, dtype=float).tolist() for k, v in self.settings.items()}
        return {
            "kind": self.kind,
            "law": self.law,
            "medium": self.medium,
            "settings": settings,
            "unit": self.unit,
            "coefficients": list(self.coefficients),
            "sd": list(self.sd),
        }

    def __str__(self) -> str:
        """The law with its coefficients."""
        parts = [f"{c:.3g} +- {s:.2g}" for c, s in zip(self.coefficients, self.sd, strict=True)]
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.law}, c = ({', '.join(parts)}){unit}"


def basis_of(
    kind: str, settings: Mapping[str, Any], around: Conditions, medium: str = "any"
) -> Floats:
    """Return the wrenches of unit coefficients at the knots, body axes, shape (n, 6, c)."""
    scene = around.scene(medium)
    given = {k: np.atleast_2d(np.asarray(v, dtype=float)) for k, v in settings.items()}
    rows = len(around.time)
    if kind == DRIVEN:
        assert around.drive is not None
        return around.drive[:, :, None] * around.share(medium)[:, :, None]
    columns = []
    for stem in STEMS.get(kind, (kind,)):
        law = FORCES.get(stem) or TORQUES[stem]
        first = 0 if stem in FORCES else 3
        for unit in np.ones((1, 1)) if stem in SCALARS else np.eye(3):
            wrench = np.zeros((rows, 6))
            wrench[:, first : first + 3] = law(scene, unit[None, :], given) * scene.share
            columns.append(wrench)
    return np.stack(columns, axis=2)
