"""Residual force by regime: in air or water, slow or fast, low or high."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.dependence import quantities
from seals.sysid.residual_force.residual import Residual

_DRY, _WET = 0.02, 0.98
"""Submerged shares up to which a hull is in air, and from which on it is in water."""
_FEW = 4
"""Points below which a regime is not judged."""


@dataclass(frozen=True, kw_only=True)
class Regime:
    """Size of the residual force under one condition.

    Args:
        name: of the condition.
        points: in time that fall under it.
        force: root mean square of the force less its error bars [N].
        torque: of the torque [N m].
        force_ratio: root mean square of the force in units of its error with the gusts; 1 when none
            is missing.
        torque_ratio: of the torque.
    """

    name: str
    points: int
    force: float
    torque: float
    force_ratio: float
    torque_ratio: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self)


def regimes(found: Residual, around: Conditions) -> tuple[Regime, ...]:
    """Return the residual force of each regime in the log; the whole log comes first."""
    masks = {"whole log": np.ones(len(found.time), bool)}
    if around.water is not None:
        wet = around.submersion
        masks["air"] = wet < _DRY
        masks["entry"] = (wet >= _DRY) & (wet <= _WET)
        masks["water"] = wet > _WET
    for name, words in (
        ("speed", ("slow", "fast")),
        ("height", ("low", "high")),
        ("depth", ("shallow", "deep")),
        ("throttle", ("low throttle", "high throttle")),
        ("tilt", ("level", "tilted")),
        ("time", ("early", "late")),
    ):
        values = quantities(around).get(name)
        if values is not None and np.ptp(values) > 0.0:
            low, high = np.quantile(values, [1 / 3, 2 / 3])
            masks[words[0]], masks[words[1]] = values <= low, values >= high
    return tuple(_regime(n, m, found) for n, m in masks.items() if m.sum() >= _FEW)


def _regime(name: str, mask: NDArray[np.bool_], found: Residual) -> Regime:
    force, force_ratio = _sizes(found.force[mask], found.force_sd[mask], float(found.gust[0]))
    torque, torque_ratio = _sizes(found.torque[mask], found.torque_sd[mask], float(found.gust[1]))
    return Regime(
        name=name,
        points=int(mask.sum()),
        force=force,
        torque=torque,
        force_ratio=force_ratio,
        torque_ratio=torque_ratio,
    )


def _sizes(values: Floats, spread: Floats, gust: float) -> tuple[float, float]:
    """Magnitude beyond error and gusts, and root mean square over both."""
    variance = spread**2 + gust**2
    beyond = np.sum(values**2 - variance, axis=1).mean()
    ratio = np.sqrt(np.mean(values**2 / np.maximum(variance, 1e-30)))
    return float(np.sqrt(max(beyond, 0.0))), float(ratio)
