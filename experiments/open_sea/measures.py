"""Metrics of the tow."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import markdown
from seals.experiments.open_sea.tow import START, Tow

SETTLED = 2.0
"""Times of the start after which figures count [1]."""
PART = 0.1
"""Share of the way at each end over which the cost is averaged [1]."""
NONE = float("nan")
BLINK = 5
"""Steps on either side of a shift that are averaged for its jump."""


class Measured(NamedTuple):
    """Figures by name, unit in the name, with the bound that is wanted (NaN for none)."""

    figures: dict[str, tuple[float, float]]

    def table(self) -> str:
        """Return the figures as a table in Markdown."""
        rows = [
            (name, f"{value:.4g}", "" if np.isnan(bound) else f"{bound:.4g}")
            for name, (value, bound) in self.figures.items()
        ]
        return markdown(("figure", "value", "bound"), rows)


def measures(alone: Tow, ball: Tow) -> Measured:
    """Return the metrics of the tow.

    Args:
        alone: the window without a body, for the waves.
        ball: with a ball in tow, for forces and cost.
    """
    found = {
        "way [m]": (float(ball.place[-1]), NONE),
        "shifts by one cell": (float(ball.shifted.sum()), NONE),
        "boundary samples": (float(ball.samples), NONE),
    }
    for name, tow in (("alone", alone), ("ball", ball)):
        found |= {
            f"{name}: particles at the start": (float(tow.particles[0]), NONE),
            f"{name}: fewest": (float(tow.particles.min()), NONE),
            f"{name}: most": (float(tow.particles.max()), NONE),
            f"{name}: came": (tow.come, NONE),
            f"{name}: went": (tow.gone, NONE),
        }
    late, wide = _late(alone), alone.amplitude / 100.0
    off, tops = (alone.inside - alone.outside)[late], (alone.tops - alone.outside)[late]
    last = alone.time > alone.time[-1] - 4.0
    found |= (
        {
            "elevation inside against outside, rms over amplitude [%]": (_rms(off) / wide, 10.0),
            "the same over the last 4 s [%]": (
                _rms((alone.inside - alone.outside)[last]) / wide,
                10.0,
            ),
            "mean difference over amplitude [%]": (float(off.mean()) / wide, NONE),
            "rms by the highest particles alone, over amplitude [%]": (_rms(tops) / wide, NONE),
        }
        | _cost("alone", alone)
        | _cost("ball", ball)
        | _forces(ball)
    )
    gap = max(float(alone.gap.max()), float(ball.gap.max()))
    return Measured({**found, "largest gap of the momentum balance [1]": (gap, 1e-4)})


def _late(tow: Tow) -> Any:
    return tow.time > SETTLED * START


def _cost(name: str, tow: Tow) -> dict[str, tuple[float, float]]:
    few = round(PART * len(tow.time))
    first, last = (float(np.mean(c)) for c in (tow.cost[:few], tow.cost[-few:]))
    return {
        f"{name}: processor time of a step, first tenth of the way [ms]": (first * 1e3, NONE),
        f"{name}: the same, last tenth [ms]": (last * 1e3, NONE),
        f"{name}: change of the cost [%]": ((last / first - 1.0) * 100.0, 5.0),
    }


def _forces(tow: Tow) -> dict[str, tuple[float, float]]:
    late = _late(tow)
    # mean size of the force at the frequency of encounter, largest axis [N]. Not a number where
    # fewer than two waves were met
    if not np.isfinite(tow.encounter):
        size = NONE
    else:
        angle = tow.encounter * tow.time[late]
        basis = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        found = np.linalg.lstsq(basis, tow.force[late], rcond=None)[0]
        size = float(2.0 / np.pi * np.hypot(found[1], found[2]).max())
    rows = np.flatnonzero(tow.shifted.astype(bool) & late)
    rows = rows[rows < len(tow.time) - BLINK]
    steps = [
        tow.force[k : k + BLINK].mean(axis=0) - tow.force[k - BLINK : k].mean(axis=0) for k in rows
    ]
    share, jumps, twins = size / 100.0, np.array(steps).reshape(-1, 3), tow.twins
    calm = np.diff(tow.force, axis=0)[late[1:] & ~tow.shifted[1:].astype(bool)]
    error = jumps.std(axis=0) / np.sqrt(len(jumps))
    out = {
        "mean wave force, largest axis [N]": (size, NONE),
        "mean drag [N]": (-float(tow.force[late, 0].mean()), NONE),
        "mean jump at a shift over mean wave force [%]": (_most(jumps.mean(axis=0)) / share, 2.0),
        "its standard error [%]": (_most(error) / share, NONE),
        "rms change from step to step without a shift [%]": (
            _most(np.sqrt((calm**2).mean(axis=0))) / share,
            NONE,
        ),
    }
    if len(twins):
        mean, ripple = twins.mean(axis=(0, 1)), np.sqrt((twins.mean(axis=0) ** 2).mean(axis=0))
        out["with the shift less without it, mean of 10 steps [%]"] = (_most(mean) / share, 2.0)
        out["with the shift less without it, rms of its mean course [%]"] = (
            _most(ripple) / share,
            NONE,
        )
    return out


def _most(x: Floats) -> float:
    return float(np.abs(x).max())


def _rms(x: Floats) -> float:
    return float(np.sqrt((x**2).mean()))
