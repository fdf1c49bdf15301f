"""Contract tests of fluid plug-ins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals import registry
from seals.arrays import Floats
from seals.contract import class_of, require
from seals.environment.settings import EnvironmentSettings
from seals.fluid import BodyStates, Fluid, FluidBody, Surrounding
from seals.robot.pieces import Piece
from seals.testing.declaration import check_declaration

STEP = 0.004
"""Step of the checks [s]."""
DEPTH = 0.4
"""Of the water [m]; its level is not zero, so that it cannot be forgotten."""
LEVEL = 0.3
"""Height of the surface [m]."""
EDGE = 0.2
"""Edge of the cube that is held in the water [m]."""


@dataclass(frozen=True, kw_only=True)
class FluidReport:
    """Result of `check_fluid`.

    Args:
        name: of the fluid.
        lift: mean force on a cube held under water against its displaced weight [1].
        gap: largest gap of the momentum balance, over the impulses exchanged in a step [1].
        kept: largest difference of a run taken up from a snapshot, against the lift [1].
        level: largest distance of the surface at rest from the level [m].
    """

    name: str
    lift: float
    gap: float
    kept: float
    level: float

    def table(self) -> str:
        """Return the figures as text."""
        return (
            f"{self.name}: lift {self.lift:.3f} of the displaced weight, momentum within "
            f"{self.gap:.1e}, snapshot {self.kept:.1e}, surface within {self.level * 1e3:.1f} mm"
        )


def check_fluid(fluid: str | type, *, values: Mapping[str, Any] | None = None) -> FluidReport:
    """Check the contract of a fluid.

    It must lift a held cube by the weight of the water it displaces, within a tenth; balance its
    momentum to 1e-4 of what is exchanged in a step; continue from a snapshot; start over when it is
    initialised again; work without any body; and know its surface.

    Args:
        fluid: name of an installed fluid, or its class.
        values: fields of the fluid.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.
    """
    name, cls = class_of("fluid", fluid)
    check_declaration(name, cls)
    check = _FluidCheck(name, lambda: cls(**(values or {})))
    check.names()
    lift, gap, level = check.held()
    kept = check.taken_up()
    check.alone()
    return FluidReport(name=name, lift=lift, gap=gap, kept=kept, level=level)


class _FluidCheck:
    """Parts of the check, each with a fluid of its own."""

    def __init__(self, name: str, make: Any) -> None:
        self.name, self.make = name, make
        self.environment = EnvironmentSettings(
            water_level=LEVEL, tank_bottom=LEVEL - DEPTH, water_density=1000.0
        )
        self.weight = 1000.0 * self.environment.gravity * EDGE**3

    def names(self) -> None:
        """Check the name and the owned phenomena."""
        made = self.make()
        fit = isinstance(made, Fluid) and bool(made.name)
        require(
            fit, self.name, "lacks a method or a name of the protocol", "See seals.fluid.Fluid."
        )
        require(
            "buoyancy" in made.accounts_for,
            self.name,
            "does not account for buoyancy",
            "A fluid that acts on bodies has buoyancy: list it in accounts_for.",
        )

    def opened(self, bodies: int) -> Any:
        """Check opening and initialisation with cubes."""
        made = self.make()
        cube = Piece("box", (EDGE, EDGE, EDGE), np.zeros(3), np.eye(3))
        still = registry.get("wave", "still").load()()
        around = Surrounding(self.environment, still, (), STEP)
        made.open(around, [FluidBody("it/cube", (cube,))][:bodies])
        made.initialise(_held(bodies))
        return made

    def held(self) -> tuple[float, float, float]:
        """Check lift, momentum balance and surface with a cube held under water."""
        made = self.opened(1)
        lifts, gaps = [], []
        for k in range(150):
            impulses = made.exchange(_held(1), k * STEP, STEP)
            fit = impulses.shape == (1, 6) and bool(np.isfinite(impulses).all())
            require(fit, self.name, f"returns {impulses}", "Return finite impulses (K, 6).")
            balance = made.momentum_balance()
            require(
                balance is not None,
                self.name,
                "returns no momentum balance",
                "Return a MomentumBalance after a step.",
            )
            gaps.append(float(np.abs(balance.gap).max()) / max(balance.gross, 1e-12))
            lifts.append(impulses[0, 2] / STEP)
        lift, gap = float(np.mean(lifts[75:])) / self.weight, max(gaps)
        places = np.array([[x, y, 0.0] for x in (-0.15, 0.15) for y in (-0.15, 0.15)])
        level = float(np.abs(np.asarray(made.surface(places).elevation) - LEVEL).max())
        made.close()
        require(
            abs(lift - 1.0) < 0.1,
            self.name,
            f"lifts a submerged cube by {lift:.2f} of the displaced weight",
            "Check the volume that its boundary keeps free.",
        )
        require(
            gap < 1e-4, self.name, f"loses {gap:.1e} of the impulses", "Sum in double precision."
        )
        require(
            level < 0.1 * DEPTH,
            self.name,
            f"has a surface that is off by {level:.3f} m",
            "Use the level.",
        )
        return lift, gap, level

    def taken_up(self) -> float:
        """Check snapshots and reset."""
        made = self.opened(1)
        first = made.exchange(_held(1), 0.0, STEP)
        kept = made.snapshot()
        ends = []
        for _ in range(2):
            for k in range(1, 6):
                last = made.exchange(_held(1), k * STEP, STEP)
            ends.append(last)
            made.restore(kept)
        made.initialise(_held(1))
        again = made.exchange(_held(1), 0.0, STEP)
        made.close()
        scale = self.weight * STEP
        apart = float(np.abs(ends[1] - ends[0]).max()) / scale
        require(apart < 1e-2, self.name, f"goes on {apart:.1e} otherwise", "Keep all that changes.")
        over = float(np.abs(again - first).max()) / scale
        require(over < 1e-2, self.name, f"starts over {over:.1e} otherwise", "Reset in initialise.")
        return apart

    def alone(self) -> None:
        """Check steps without any body."""
        made = self.opened(0)
        none: Floats = made.exchange(_held(0), 0.0, STEP)
        places, velocities = made.particles()
        made.close()
        require(none.shape == (0, 6), self.name, f"returns {none.shape}", "Return (0, 6).")
        fit = places.shape == velocities.shape and places.shape[1:] == (3,)
        require(fit, self.name, "has particle arrays of wrong shape", "Return (n, 3) twice.")


def _held(bodies: int) -> BodyStates:
    """Return a static cube in the middle of the water."""
    place = np.array([[0.0, 0.0, LEVEL - 0.5 * DEPTH]])
    still, turn = np.zeros((1, 3)), np.eye(3)[None]
    whole = BodyStates(place, turn, still, still, np.zeros(1), np.zeros((1, 3, 3)), still)
    return BodyStates(*(field[:bodies] for field in whole))
