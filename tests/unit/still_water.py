"""A fluid whose answers are known: still water that lifts every sample by its volume."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.environment.waves import Sea
from seals.fluid import BodyStates, FluidBody, MomentumBalance, Surrounding
from seals.plugins.fluids.sampling import Samples, sample_pieces

Floats = NDArray[np.float64]


@dataclass(kw_only=True)
class StillWater:
    """Still water: rho g V up at every submerged sample, and a push to all of them."""

    spacing: float = 0.3
    push: float = 0.0
    name: ClassVar[str] = "still_water"
    accounts_for: ClassVar[tuple[str, ...]] = ("buoyancy", "added mass", "slamming")

    def __post_init__(self) -> None:
        """Begin with nothing."""
        self.samples: list[Samples] = []
        self.seen: list[BodyStates] = []
        self.calls = 0
        self.closed = False

    def solids(self, environment: Any) -> Mapping[str, Any]:
        """None."""
        return {}

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Sample the bodies."""
        self.around = around
        self.samples = [sample_pieces(body.pieces, self.spacing) for body in bodies]

    def initialise(self, states: BodyStates) -> None:
        """Forget."""
        self.calls, self.filled = 0, states

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Lift."""
        self.calls += 1
        self.seen.append(states)
        out = np.zeros((len(self.samples), 6))
        level = self.around.environment.water_level
        rows = zip(self.samples, states.position, states.rotation, strict=True)
        for k, (samples, place, turn) in enumerate(rows):
            arm = samples.points @ turn.T
            wet = (place + arm)[:, 2] < level
            lift = 1000.0 * self.around.environment.gravity * samples.volumes * wet
            force = np.stack([self.push * samples.volumes * self.calls, 0 * lift, lift], axis=1)
            out[k, :3] = step * force.sum(axis=0)
            out[k, 3:] = step * np.cross(arm, force).sum(axis=0)
        return out

    def surface(self, position: Any) -> Sea:
        """Flat, a centimetre up so that it can be told from the level."""
        return Sea(np.full((len(position), 1), 0.01), None, None, None, None)

    def momentum_balance(self) -> MomentumBalance | None:
        """None kept."""
        return None

    def diagnostics(self) -> Mapping[str, float]:
        """Calls."""
        return {"calls": float(self.calls)}

    def particles(self) -> tuple[Floats, Floats]:
        """None."""
        return np.zeros((0, 3)), np.zeros((0, 3))

    def snapshot(self) -> Any:
        """The count."""
        return self.calls

    def restore(self, kept: Any) -> None:
        """Put back."""
        self.calls = kept

    def close(self) -> None:
        """Note it."""
        self.closed = True
