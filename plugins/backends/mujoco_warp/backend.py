"""Backend ``mujoco_warp``: MuJoCo in a run; in learning thousands of worlds on one GPU."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.errors import optional_import
from seals.field_roles import roles
from seals.plugins.backends.mujoco import BackendMujoco
from seals.schema import setting

if TYPE_CHECKING:
    from seals.batch.loads import BatchLoads
    from seals.effects.binding import EffectSet
    from seals.environment.settings import EnvironmentSettings
    from seals.environment.waves import Waves
    from seals.plugins.backends.mujoco_warp.laws import LawKernel
    from seals.plugins.backends.mujoco_warp.worlds import WarpWorlds
    from seals.robot.model import RobotModel


@roles(data="repeatable")
@dataclass(kw_only=True)
class BackendMujocoWarp(BackendMujoco):
    """Backend ``mujoco`` in a run; in learning on a GPU many worlds with contacts in one batch.

    Equation:
        (M + J^T A J + gains of the drives) a = forces + J_c^T f, semi-implicit Euler steps, as
        ``mujoco``; added mass A enters M before it is factored, by world.

    Args:
        solver_iterations: most iterations of the contact solver.
        second_order: see `BackendMujoco`; batches take first-order steps.
        compiled: see `BackendMujoco`; the laws of a batch become one kernel, unless ``false``, or
            where parameters differ between the worlds.
        touching: most contact points of a robot, on average over the batch.
        slope: steepest slope of the ground under the worlds of a batch, each with one of its own
            about the origin of the ground, drawn once [rad].
        repeatable: whether sums are taken in one order, so that runs repeat bit for bit; slower.

    Assumptions:
        Those of ``mujoco``; every world has the same robots, with free bases.

    Limitations:
        float32. The convex contact problem is solved once a step: a sliding contact opens by
        friction times slip. Joint drives are limited by the acceleration of the step before.

    References:
        Todorov, Erez and Tassa 2012, doi:10.1109/IROS.2012.6386109; MuJoCo Warp, Google DeepMind
        and NVIDIA, 2025.

    Example:
        >>> BackendMujocoWarp().repeatable
        False
    """

    touching: int = 24
    slope: float = setting(0.0, "rad", bounds=(0.0, 1.0), source="chosen: level")
    repeatable: bool = False

    def worlds(
        self,
        robots: Sequence[tuple[RobotModel, EffectSet]],
        environment: EnvironmentSettings,
        waves: Waves,
        *,
        count: int,
        step: float,
        device: str,
        values: Mapping[str, Any] | None = None,
    ) -> WarpWorlds:
        """Return a batch of worlds.

        Args:
            robots: of every world, with the effects bound to their links.
            environment: of every world.
            waves: motion of the water surface.
            count: number of worlds B.
            step: h [s].
            device: ``cuda`` or ``cpu``.
            values: ``"effect.parameter"`` of the first robot to a number or B numbers, in place of
                the settings.

        Raises:
            ConfigError: mujoco-warp is not installed, or a robot has no form in a batch.
        """
        import torch

        from seals.batch.loads import BatchLoads
        from seals.plugins.backends.mujoco_warp.worlds import WarpWorlds

        with optional_import(
            "backend=mujoco_warp needs the package mujoco-warp",
            "Install it: pip install 'aam-seals[warp]'",
        ):
            import mujoco_warp  # noqa: F401
        like = torch.zeros(1, dtype=torch.float32, device=device)
        parts = []
        for k, (robot, effects) in enumerate(robots):
            own = values if k == 0 else None
            loads = BatchLoads(
                robot, effects, environment, waves, batch=count, like=like, values=own
            )
            # parameters that differ between the worlds are no numbers of a program
            kernel = None
            if self.compiled != "false" and not own:
                one = BatchLoads(robot, effects, environment, waves, batch=1, like=np.zeros(1))
                kernel = self._kernel(one, like, count=count, step=step)
            parts.append((loads, kernel or loads))
        return WarpWorlds(self, parts, environment, step=step)

    def _kernel(self, one: BatchLoads, like: Any, *, count: int, step: float) -> LawKernel | None:
        """Return the laws of one robot as a kernel; None, with a warning, where they have none."""
        from seals.plugins.backends.mujoco_warp.laws import LawKernel
        from seals.scalar_compiler import CannotCompile

        try:
            return LawKernel(one, step=step, batch=count, like=like)
        except CannotCompile as problem:
            if self.compiled == "true":
                raise
            warnings.warn(f"the worlds continue uncompiled: {problem}", stacklevel=2)
        return None
