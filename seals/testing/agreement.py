"""Agreement of batch dynamics and simulator under one effect."""

from __future__ import annotations

import itertools
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.contract import ContractError, require
from seals.effects.binding import EffectSet, bind_effects
from seals.effects.effect import Effect
from seals.robot.model import RobotModel
from seals.testing.bodies import free_body, moving_arm
from seals.testing.engines import SAMPLE, Track, follow, simulate
from seals.testing.scenes import ARM_SIZE, LIMITS, Case, companions, start_of

FLOOR = 2e-5
"""Error below which halving the step need not help: interpolated hulls and the reference itself."""

MOST_WITHOUT = 16
"""Motions without the effect under test that are kept."""
_WITHOUT: dict[str, Track] = {}

QUANTITIES = ("position", "attitude", "joints")


@dataclass(frozen=True, kw_only=True)
class SceneReport:
    """Differences between simulator and batch dynamics in one scene.

    Args:
        scene: its name.
        arm: whether the robot has moving links.
        steps: of the simulator [s], falling.
        errors: largest error of position, attitude, joints against their path, by step [1].
        moved: largest change that the effect makes, on the same scale [1].
    """

    scene: str
    arm: bool
    steps: tuple[float, ...]
    errors: tuple[tuple[float, ...], ...]
    moved: float

    @property
    def orders(self) -> tuple[float, ...]:
        """Measured order of the largest error, from each step to the next."""
        worst = [max(*e, 1e-16) for e in self.errors]
        return tuple(math.log(a / b, h / g) for (a, b), (h, g) in zip(
            itertools.pairwise(worst), itertools.pairwise(self.steps), strict=True
        ))  # fmt: skip


class Agreement:
    """Comparison of simulator and batch dynamics for one effect.

    Args:
        name: of the effect.
        duration: compared time [s].
        steps: of the simulator [s], falling, each dividing 4 ms.
        backend: name of the rigid-body backend.
    """

    def __init__(self, name: str, *, duration: float, steps: Sequence[float], backend: str) -> None:
        self.name, self.duration, self.steps, self.backend = name, duration, tuple(steps), backend

    def measure(
        self, effect: Effect, case: Case, *, in_twin: Effect | None = None
    ) -> tuple[SceneReport, ...]:
        """Run one case in both engines.

        Args:
            effect: under test, bound to the links of its own list.
            case: robot and scenes.
            in_twin: another effect for the twin, to see that a difference is found.
        """
        others = companions(effect, size=ARM_SIZE if case.arm else 1.0)
        with tempfile.TemporaryDirectory() as folder:
            robot = (moving_arm if case.arm else free_body)(Path(folder))
            starts = [start_of(robot, scene, k) for k, scene in enumerate(case.scenes)]
            run: dict[str, Any] = {"duration": self.duration}
            try:
                with np.errstate(over="raise", invalid="raise", divide="raise"):
                    laws = _bind(robot, others, in_twin or effect)
                    if not any(b.effect.memory_size for b in laws.bound):
                        # the entering force begins and ends with kinks
                        step = SAMPLE / (4.0 if laws.inertias else 2.0 if laws.joint_loads else 1.0)
                        reference = follow(robot, laws, starts, step=step, duration=self.duration)
                    else:
                        coarse, fine = (
                            follow(robot, laws, starts, step=step, duration=self.duration)
                            for step in (SAMPLE / 2.0, SAMPLE / 4.0)
                        )
                        reference = coarse.extrapolated(fine)
            except FloatingPointError as cause:
                raise ContractError(
                    f"{self.name}: the batch simulation diverges in the scenes "
                    f"{', '.join(case.scenes)}.\n"
                    "Look for a sign that drives the body, or give smaller values=."
                ) from cause
            effects = _bind(robot, others, effect)
            found = [
                simulate(robot, effects, starts, step=step, backend=self.backend, **run).errors(
                    reference
                )
                for step in self.steps
            ]
            # the motion without the effect: many effects have the same companions
            key = repr((others, case, self.duration, self.backend))
            if key not in _WITHOUT:
                if len(_WITHOUT) >= MOST_WITHOUT:
                    _WITHOUT.clear()
                _WITHOUT[key] = simulate(
                    robot,
                    _bind(robot, others),
                    starts,
                    step=SAMPLE,
                    backend=self.backend,
                    duration=self.duration,
                )
            without = _WITHOUT[key]
        moved = without.errors(reference).max(axis=1)
        return tuple(
            SceneReport(
                scene=scene,
                arm=case.arm,
                steps=self.steps,
                errors=tuple(tuple(map(float, table[k])) for table in found),
                moved=float(moved[k]),
            )
            for k, scene in enumerate(case.scenes)
        )

    def judge(self, report: SceneReport, *, least: float = 1.0) -> None:
        """Refuse errors above the limits and steps that do not converge.

        Args:
            report: of one scene.
            least: order of convergence that is asked for.

        Raises:
            ContractError: simulator and twin disagree.
        """
        where = (
            f"in the scene '{report.scene}' {'with a moving arm' if report.arm else 'of one body'}"
        )
        for step, found in zip(report.steps, report.errors, strict=True):
            # only 4 and 1 ms have limits of their own; the order judges the steps between
            limit = LIMITS[report.arm].get(step, math.inf)
            for quantity, error in zip(QUANTITIES, found, strict=True):
                require(
                    error < limit,
                    self.name,
                    f"simulator and batch dynamics differ {where} by {error:.1e} of the {quantity} "
                    f"at a step of {step * 1e3:g} ms",
                    f"Allowed: below {limit:g}. The same hooks must run in both: "
                    "look for state outside memory.",
                )
        for (coarse, fine), order in zip(
            itertools.pairwise(report.errors), report.orders, strict=True
        ):
            require(
                order > least or max(coarse) < FLOOR,
                self.name,
                f"a smaller step reduces the error {where} only "
                f"from {max(coarse):.1e} to {max(fine):.1e}",
                f"Required: order {least:g}, less than half at half the step for order 1. "
                "Look for a jump in the law, or for differences of steps.",
            )


def _bind(robot: RobotModel, others: dict[str, Effect], effect: Effect | None = None) -> EffectSet:
    chosen = others if effect is None else {**others, "it": effect}
    return bind_effects(chosen, robot.links)
