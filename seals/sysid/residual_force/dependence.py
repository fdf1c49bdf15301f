"""Dependence of the residual force on speed, place, time and others, by held-out misfit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.predictors.problem import LOOSE
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.regress import Gain, Table, gain

_QUANTILES = (0.05, 0.35, 0.65, 0.95)
"""Of a quantity, between which its functions are straight."""
_LEAST: Mapping[str, float] = {
    "time": 2.0,
    "speed": 0.1,
    "height": 0.1,
    "depth": 0.1,
    "throttle": 0.03,
    "tilt": 0.03,
    "heading": 0.3,
    "battery": 0.15,
    "place x": 0.1,
    "place y": 0.1,
}
"""Range of a quantity below which nothing can be said (throttle: as a share of its mean)."""
_UNITS: Mapping[str, str] = {
    "time": "s",
    "speed": "m/s",
    "throttle": "N",
    "tilt": "rad",
    "heading": "rad",
    "battery": "V",
    "height": "m",
    "depth": "m",
    "place x": "m",
    "place y": "m",
    "medium": "1",
    "constant": "1",
    "direction of motion": "1",
    "odd in velocity": "1",
    "even in velocity": "1",
    "rotation": "1",
    "commanded wrench": "1",
    "rate of the commanded wrench": "1",
}


@dataclass(frozen=True, kw_only=True)
class Dependence:
    """Fraction of the held-out misfit that a function of one quantity explains.

    Args:
        variable: the quantity.
        unit: of the quantity.
        frame: body or world: in which the force is a function of it.
        low: its 5 % quantile in the log.
        high: its 95 % quantile.
        whole: what the function explains, its constant part among it.
        beyond: what it explains beyond a constant in the same frame.
    """

    variable: str
    unit: str
    frame: str
    low: float
    high: float
    whole: Gain
    beyond: Gain

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "variable": self.variable,
            "unit": self.unit,
            "frame": self.frame,
            "low": self.low,
            "high": self.high,
            "share": self.whole.share,
            "share_sd": self.whole.share_sd,
            "beyond_constant": self.beyond.share,
            "beyond_constant_sd": self.beyond.share_sd,
            "sure": self.beyond.sure,
        }


def dependences(found: Evidence, around: Conditions) -> tuple[Dependence, ...]:
    """Test every quantity in body and world axes; largest explained fraction first."""
    out = []
    nothing = {m: _held(found, around, None, "body", m) for m in (False, True)}
    ones = np.ones((len(around.time), 1))
    for frame in ("body", "world"):
        constant = {m: _held(found, around, ones, frame, m) for m in (False, True)}
        own = gain(nothing[False], constant[False], found)
        out.append(_made("constant", frame, np.zeros(1), own, own))
        for name, values in quantities(around).items():
            low, high = np.quantile(values, [0.05, 0.95])
            least = _LEAST.get(name, 0.0)
            if not bool(high - low > least * (float(values.mean()) if name == "throttle" else 1.0)):
                continue
            # a function of time cannot be foretold for a stretch that was held out
            mixed = name in ("time", "battery")
            weights = (
                np.stack([1.0 - values, values, 4.0 * values * (1.0 - values)], axis=1)
                if name == "medium"
                else hats(values)
            )
            after = _held(found, around, weights, frame, mixed)
            whole = gain(nothing[mixed], after, found)
            beyond = gain(constant[mixed], after, found)
            out.append(_made(name, frame, values, whole, beyond))
    for name, basis in _directed(around).items():
        after = Table(found, basis).held_out(range(basis.shape[2]), ridge=widths(found, basis))
        own = gain(nothing[False], after, found)
        out.append(_made(name, "body", np.zeros(1), own, own))
    return tuple(sorted(out, key=lambda d: -d.whole.share))


def _directed(around: Conditions) -> dict[str, Floats]:
    """Basis wrenches along the velocity, the rotation or the actuator wrench, each (n, 6, c)."""
    size = len(around.time)
    table = {}
    if np.quantile(around.speed, 0.9) > _LEAST["speed"]:
        toward = around.velocity / np.maximum(around.speed, 1e-3)[:, None]
        along = np.zeros((size, 6, 4, 3))
        for axis in range(3):
            along[:, axis, :, axis] = hats(around.speed) * toward[:, axis : axis + 1]
        table[MOTION] = along.reshape(size, 6, 12)
        odd, even = np.zeros((size, 6, 6)), np.zeros((size, 6, 6))
        for axis in range(3):
            own = around.velocity[:, axis]
            odd[:, axis, axis], odd[:, axis, 3 + axis] = own, own * around.speed
            even[:, axis, axis], even[:, axis, 3 + axis] = around.speed, around.speed**2
        table[ODD], table[EVEN] = odd, even
    turning = np.zeros((size, 6, 3))
    for axis in range(3):
        turning[:, 3 + axis, axis] = around.spin[:, axis]
    table[ROTATION] = turning
    if around.drive is not None and around.drive_rate is not None:
        table[DRIVE] = around.drive[:, :, None]
        table[DRIVE_RATE] = around.drive_rate[:, :, None]
    return table


MOTION, ROTATION = "direction of motion", "rotation"
ODD, EVEN = "odd in velocity", "even in velocity"
DRIVE, DRIVE_RATE = "commanded wrench", "rate of the commanded wrench"


def quantities(around: Conditions) -> dict[str, Floats]:
    """Return the quantities on which the force may depend, shape (n,) each."""
    forward = around.turn[:, :, 0]
    table = {
        "time": around.time,
        "speed": around.speed,
        "tilt": np.arccos(np.clip(around.turn[:, 2, 2], -1.0, 1.0)),
        "heading": np.unwrap(np.arctan2(forward[:, 1], forward[:, 0])),
        "place x": around.position[:, 0],
        "place y": around.position[:, 1],
    }
    if around.water is None:
        table["height"] = around.position[:, 2] - (around.ground or 0.0)
    else:
        table["depth"] = around.water - around.position[:, 2]
    if around.crossing:
        table["medium"] = around.submersion
    if around.throttle is not None:
        table["throttle"] = around.throttle
    if around.voltage is not None:
        table["battery"] = around.voltage
    return table


def hats(values: Floats) -> Floats:
    """Piecewise linear hat functions on quantiles of a quantity, constant outside, shape (n, 4)."""
    at = np.maximum.accumulate(np.quantile(values, _QUANTILES))
    at = at + np.arange(len(at)) * 1e-9 * max(float(np.abs(at).max()), 1.0)
    return np.stack([np.interp(values, at, row) for row in np.eye(len(at))], axis=1)


def spread(around: Conditions, weights: Floats, frame: str) -> Floats:
    """Basis wrenches along all axes of a frame for every weight, shape (n, 6, c).

    Body axes hold force and torque, world axes a force.
    """
    count = len(weights)
    if frame == "body":
        axes = np.tile(np.eye(6), (count, 1, 1))
    else:
        axes = np.concatenate([around.turn.transpose(0, 2, 1), np.zeros((count, 3, 3))], axis=1)
    both: Floats = np.einsum("nk,nai->naki", weights, axes).reshape(count, 6, -1)
    return both


def widths(found: Evidence, basis: Floats) -> Floats:
    """Prior precision of columns that allows each the size of the free force, shape (c,)."""
    level = LOOSE * np.repeat(np.maximum(found.gust, 1e-9), 3)
    size = np.sqrt(np.mean(np.sum((basis / level[None, :, None]) ** 2, axis=1), axis=0))
    out: Floats = size**2 + 1e-12
    return out


def _held(
    found: Evidence, around: Conditions, weights: Floats | None, frame: str, mixed: bool
) -> Floats:
    if weights is None:
        return Table(found, np.zeros((len(around.time), 6, 0))).held_out([], mixed=mixed)
    basis = spread(around, weights, frame)
    table = Table(found, basis)
    return table.held_out(range(basis.shape[2]), ridge=widths(found, basis), mixed=mixed)


def _made(name: str, frame: str, values: Floats, whole: Gain, beyond: Gain) -> Dependence:
    low, high = np.quantile(values, [0.05, 0.95])
    return Dependence(
        variable=name,
        unit=_UNITS[name],
        frame=frame,
        low=float(low),
        high=float(high),
        whole=whole,
        beyond=beyond,
    )
