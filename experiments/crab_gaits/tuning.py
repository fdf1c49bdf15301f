"""Parameters of a central pattern generator, optimised by CMA-ES."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import PhysicsError, optional_import
from seals.experiments.crab_gaits.cases import GAITS
from seals.experiments.crab_gaits.walks import walked
from seals.experiments.trials import write_rows
from seals.logs.atomic import atomic_path

RANGES = {
    "crab": {
        "lowest": (1.0, 6.0),
        "stroke": (0.015, 0.05),
        "lift": (0.003, 0.02),
        "duty": (0.4, 0.8),
        "spread": (-0.012, 0.015),
        "crouch": (-0.010, 0.008),
        "along": (0.2, 0.8),
        "across": (0.2, 0.8),
    },
    "sea_spider": {
        "lowest": (0.2, 1.5),
        "stroke": (0.015, 0.06),
        "lift": (0.004, 0.03),
        "duty": (0.4, 0.85),
        "spread": (-0.03, 0.02),
        "crouch": (-0.015, 0.015),
        "along": (0.2, 0.8),
        "across": (0.2, 0.8),
    },
}
"""Bounds of the parameters of the controller ``cpg``; the highest frequency is the lowest one."""
FACING = {"crab": "sideways", "sea_spider": "ahead"}
SHORT = {"crab": 4.0, "sea_spider": 7.0}
"""Length of a walk of the optimiser [s]."""
SLOW = 4.0
"""Price of a share of the wanted speed that is missing, against the cost of transport [1]."""


WORST = 100.0
"""Price of a walk that cannot be simulated."""


def tune(name: str, out: Path, *, budget: int, seed: int) -> dict[str, float]:
    """Optimise the generator of one gait; write the walks and the best parameters.

    Args:
        name: of the gait, a key of `GAITS`; its overrides say animal, ground and speed.
        out: folder of ``tuning.csv`` and ``best.json``.
        budget: number of walks.
        seed: of the strategy.

    Raises:
        MissingExtra: the package cma is not installed.
    """
    with optional_import(
        "--tune needs the package cma", "Install it: pip install aam-seals[learn]"
    ):
        import cma
    base = [word for word in GAITS[name] if not word.startswith("controller")]
    animal = "sea_spider" if "spider" in base[0] else "crab"
    base.append(f"time.duration={SHORT[animal]}")
    ranges = RANGES[animal]
    options = {"seed": seed + 1, "bounds": [0.0, 1.0], "maxfevals": budget, "verbose": -9}
    strategy: Any = cma.CMAEvolutionStrategy([0.5] * len(ranges), 0.2, options)
    rows: list[dict[str, str]] = []
    while not strategy.stop():
        shares = strategy.ask()
        prices = [_tried(share, base, animal, rows) for share in shares]
        strategy.tell(shares, prices)
        write_rows(out / "tuning.csv", rows)
        print(f"{len(rows)} walks, best price {strategy.result.fbest:.4f}", flush=True)
    best = _values_of(strategy.result.xbest, animal)
    found = {"gait": name, "price": float(strategy.result.fbest), "seed": seed, "values": best}
    with atomic_path(out / "best.json") as beside:
        Path(beside).write_text(json.dumps(found, indent=1), encoding="utf-8")
    return best


def _values_of(shares: Sequence[float], animal: str) -> dict[str, float]:
    """Return parameters from shares of their ranges.

    Example:
        >>> _values_of([0.0] * 8, "crab")["lowest"]
        1.0
    """
    ranges = RANGES[animal]
    pairs = zip(ranges.items(), np.clip(shares, 0.0, 1.0).tolist(), strict=True)
    return {key: low + share * (high - low) for (key, (low, high)), share in pairs}


def _tried(
    share: Sequence[float], base: Sequence[str], animal: str, rows: list[dict[str, str]]
) -> float:
    """Walk once and note it."""
    from seals.config.compose import compose

    values = _values_of(share, animal)
    price, speed, cost = WORST, 0.0, math.inf
    try:
        # the overrides that set the parameters of the generator
        words = [f"controller.{key}={value:.5f}" for key, value in values.items()]
        highest = f"controller.highest={values['lowest']:.5f}"
        walk = walked(
            [*base, *["controller=cpg", f"controller.facing={FACING[animal]}", *words, highest]]
        )
    except PhysicsError as error:
        # legs that are thrown about faster than the engine follows
        print(f"left out: {error}".partition("\n")[0], flush=True)
    else:
        speed, cost = walk.speed, walk.cost
        wanted = float(compose(list(base)).guide.speed)
        # the cost of a walk: transport, missing speed, and tilt
        missing = max(0.0, 1.0 - speed / wanted)
        price = min(min(cost, 20.0) + SLOW * missing + 10.0 * max(0.0, 0.98 - walk.upright), WORST)
    row = {**values, "speed": speed, "cost": cost, "price": price}
    rows.append({"seed": f"{len(rows)}", **{key: f"{value:.5g}" for key, value in row.items()}})
    return price
