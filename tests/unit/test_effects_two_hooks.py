"""One effect may push by more than one hook: all of its pushes reach the body."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.arrays import Array
from seals.effects.effect import Effect, Parameters
from seals.motion import Body, Drives, Inputs, Medium, Motion, Wrench
from seals.schema import param
from seals.testing.agreement import Agreement
from seals.testing.scenes import Case
from seals.world import Ledger


@dataclass(kw_only=True)
class Pushing(Effect):
    """A push along x, a share of the thrust along y, and a mass at the origin with its weight."""

    push: float = param(2.0, "N", bounds=(-9.0, 9.0), tolerance=0.1, source="test")
    share: float = param(0.1, "1", bounds=(-1.0, 1.0), tolerance=0.1, source="test")
    mass: float = param(0.2, "kg", bounds=(0.0, 1.0), tolerance=0.1, source="test")
    links: list[str] = field(default_factory=lambda: ["*"])

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """A constant force."""
        return Wrench(motion.velocity * 0.0 + params["push"] * np.array([[1.0, 0.0, 0.0]]), None), (
            memory
        )

    @staticmethod
    def drive_loads(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Any
    ) -> tuple[Wrench, Array]:
        """A force across the rotors' axes."""
        pull = np.sum(drives.thrust, axis=1, keepdims=True) * params["share"]
        return Wrench(motion.velocity * 0.0 + pull * np.array([[0.0, 1.0, 0.0]]), None), memory

    @staticmethod
    def inertia_change(body: Body, params: Parameters) -> Array:
        """A point mass at the origin."""
        return body.mass[:, :, None] * 0.0 + params["mass"] * np.diag([1.0, 1.0, 1.0, 0, 0, 0])


def test_simulator_and_twin_apply_every_hook_of_one_effect() -> None:
    """Force, rotors' side force and weight of one effect: the engines move alike at 4 and 1 ms."""
    agreement = Agreement("pushing", duration=1.0, steps=(0.004, 0.001), backend="pybullet")
    for report in agreement.measure(Pushing(), Case(("air",), False)):
        agreement.judge(report)
        assert report.moved > 0.1


@pytest.mark.parametrize("rows", [None, slice(1, 2), np.array([1])])
def test_the_ledger_adds_what_one_effect_writes_twice(rows: Any) -> None:
    """Two wrenches of one name in one row add up; a row used again starts at zero."""
    ledger = Ledger(["a"], ["x", "y"], steps=1)
    count = 2 if rows is None else 1
    force, torque = np.full((count, 3), 2.0), np.full((count, 3), 5.0)
    for _ in range(2):
        row = ledger.open_row(0.0)
        ledger.write(row, "a", rows, Wrench(force, None))
        ledger.write(row, "a", rows, Wrench(0.5 * force, torque))
        assert_allclose(ledger.of("a")[0, 1], [3.0, 3.0, 3.0, 5.0, 5.0, 5.0])
        ledger.rewind(0)
