"""What guides and controllers are told of a robot, as machine code."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array
from seals.scalar_compiler import Kernel, compiled
from seals.world.compiled import LIKE, CompiledStep
from seals.world.compiled_links import Look
from seals.world.pilot import Pilot, Weighing, Weights


class CompiledWeights:
    """Mass properties, buoyancy and limits of drives of one robot; compiled for each wetting.

    Args:
        laws: of the robot.
        pilot: of the robot; its controller is given what makes machine code.

    Attributes:
        pilot: that it was made for.
    """

    def __init__(self, laws: CompiledStep, pilot: Pilot) -> None:
        self.pilot, self._laws, plant = pilot, laws, pilot.plant
        effects = plant.effects.with_values({}, LIKE, 1)
        self._weighing = Weighing(plant, laws.volume, effects, LIKE)
        self._kernels: dict[str, Kernel] = {}
        self._last: tuple[Look, float, Weights] | None = None
        pilot.compile(compiled)

    def now(self, look: Look, time: float) -> Weights:
        """Return mass properties and buoyancy of the robot now.

        Args:
            look: the links.
            time: [s].
        """
        last = self._last
        if last is not None and last[0] is look and last[1] == time:
            return last[2]
        values = [look.block, time, *look.parts]
        found = self._weighing.weights(self.kernel(look)(*values))
        # who looks at a step's end looks at the same instant as the next command
        self._last = look, time, found
        return found

    def kernel(self, look: Look) -> Kernel:
        """Return the law for hulls wetted as those of a robot, of the block, the time and parts."""
        kernel = self._kernels.get(look.state)
        if kernel is None:
            shapes = [np.shape(x) or (1, 1) for x in (look.block, 0.0, *look.parts)]
            kernel = self._kernels[look.state] = compiled(
                lambda *given: self._law(look.state, *given), shapes
            )
        return kernel

    def _law(self, state: str, block: Array, time: Array, *parts: Array) -> list[Array]:
        return self._weighing.numbers(*self._laws.sampled(state, block, time, parts))
