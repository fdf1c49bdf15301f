"""Residual force and torque over time, with error bars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import rotate
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.regress import FLOOR, drawn

POINTS = 400
"""Points of a curve that are written at most."""


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Residual external wrench at n points in time.

    Args:
        time: [s], shape (n,).
        force: body axes [N], shape (n, 3).
        force_sd: 1-sigma, tolerances of the model in uncertainty, shape (n, 3).
        torque: about the body origin, body axes [N m], shape (n, 3).
        torque_sd: shape (n, 3).
        turn: from body to world axes, shape (n, 3, 3).
        force_world: world axes [N], shape (n, 3).
        force_world_sd: shape (n, 3).
        gust: stated level of gusts [N, N m], shape (2,).
        before: misfit per number observed under the stated gusts, over the noise floor.
        after: the same when any force may act.
        strength: misfit that the free force removes per number it may choose; 1 when none acts.
        ceiling: share of the misfit's excess over the noise floor that any force could explain.
        ceiling_sd: its standard error.
        missing: True when something beyond disturbance, noise and tolerances is left over.
    """

    time: Floats
    force: Floats
    force_sd: Floats
    torque: Floats
    torque_sd: Floats
    turn: Floats
    force_world: Floats
    force_world_sd: Floats
    gust: Floats
    before: float
    after: float
    strength: float
    ceiling: float
    ceiling_sd: float
    missing: bool

    def to_dict(self) -> dict[str, Any]:
        """Return figures and thinned curves as plain lists."""
        keep = thinned_rows(len(self.time))
        curves: Mapping[str, Floats] = {
            name: getattr(self, name)[keep]
            for name in (
                "time",
                "force",
                "force_sd",
                "torque",
                "torque_sd",
                "force_world",
                "force_world_sd",
            )
        }
        out: dict[str, Any] = {k: np.round(v, 6).tolist() for k, v in curves.items()}
        out["gust"] = self.gust.tolist()
        for name in ("before", "after", "strength", "ceiling", "ceiling_sd"):
            out[name] = float(getattr(self, name))
        return out | {"missing": self.missing}


def thinned_rows(count: int) -> Floats:
    """Return the rows of a curve that are written."""
    return np.unique(np.linspace(0, count - 1, min(count, POINTS)).round().astype(int))


def residual(found: Evidence, around: Conditions) -> Residual:
    """Return the posterior of the free wrench at the knots."""
    mean, covariance, _ = found.posterior
    count, knots = found.count, found.knots
    wrench = mean.transpose(0, 2, 1).reshape(-1, 6)
    table = covariance.reshape(count, 6, knots, 6, knots)
    own = np.einsum("wakbk->wkab", table).reshape(-1, 6, 6)
    spread = np.sqrt(np.maximum(np.einsum("naa->na", own), 0.0))
    turned = np.einsum("nij,njk,nlk->nil", around.turn, own[:, :3, :3], around.turn)
    tight, loose = float(found.before.sum()), float(found.after.sum())
    freedom = float(found.freedom.sum())
    floor = FLOOR * found.observed
    ceiling, uncertainty = _ceiling(found)
    before, strength = tight / floor, (tight - loose) / max(freedom, 1.0)
    policy = found.policy
    return Residual(
        time=around.time,
        force=wrench[:, :3],
        force_sd=spread[:, :3],
        torque=wrench[:, 3:],
        torque_sd=spread[:, 3:],
        turn=around.turn,
        force_world=rotate(around.turn, wrench[:, :3]),
        force_world_sd=np.sqrt(np.maximum(np.einsum("nii->ni", turned), 0.0)),
        gust=found.gust,
        before=before,
        after=loose / max(floor - freedom, 1.0),
        strength=strength,
        ceiling=ceiling,
        ceiling_sd=uncertainty,
        missing=strength > policy.force_strength or before > policy.force_misfit,
    )


def _ceiling(found: Evidence) -> tuple[float, float]:
    """Fraction of the excess misfit that a free force explains, with its standard error."""
    excess = found.before - FLOOR * found.observed / found.count
    fall = found.before - found.after - found.freedom
    total = float(excess.sum())
    if total < 2.0 * np.sqrt(2.0 * found.observed):
        return 0.0, 1.0
    share = float(np.clip(fall.sum() / total, 0.0, 1.0))
    draws = [fall[d].sum() / max(excess[d].sum(), 0.1 * total) for d in drawn(found.count)]
    return share, float(np.std(draws))
