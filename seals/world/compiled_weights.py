"""What guides and controllers are told of a robot, as machine code."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, Floats
from seals.control.actuator_limits import ActuatorLimits
from seals.control.batched_estimators import BatchActuatorLimitEstimator, BatchImmersionEstimator
from seals.control.mass_properties import MassNow, MassPropertyEstimator
from seals.control.protocols import Buoyancy
from seals.world.compiled import LIKE, CompiledStep
from seals.world.compiled_links import Look
from seals.world.pilot import Pilot, Weights
from seals.world.scalar_compiler import Kernel, compiled


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
        self._links = len(plant.robot.links)
        self._mass = MassPropertyEstimator(plant.robot)
        self._total = float(plant.robot.mass.sum())
        self._gravity = plant.gravity
        effects = plant.effects.with_values({}, LIKE, 1)
        self._limits = BatchActuatorLimitEstimator(
            plant, effects, links=self._links, like=LIKE, batch=1
        )
        self._kernels: dict[str, Kernel] = {}
        pilot.compile(compiled)

    def now(self, look: Look, time: float) -> Weights:
        """Return mass properties and buoyancy of the robot now.

        Args:
            look: the links.
            time: [s].
        """
        values = [look.block, time, *look.parts]
        kernel = self._kernels.get(look.state)
        if kernel is None:
            shapes = [np.shape(x) or (1, 1) for x in values]
            kernel = self._kernels[look.state] = compiled(
                lambda *given: self._law(look.state, *given), shapes
            )
        centre, inertia, centre_map, momentum_map, wet, force, place, *limits = kernel(*values)
        mass = MassNow(self._total, centre, inertia, centre_map, momentum_map)
        buoyancy = Buoyancy(force.item(), place)
        return Weights(mass, wet.item(), buoyancy, ActuatorLimits(*limits))

    def _law(self, state: str, block: Array, time: Array, *parts: Array) -> list[Array]:
        kinematics, motion, sample = self._laws.sampled(state, block, time, parts)
        mass = self._mass.now(kinematics)
        wet: tuple[Array | Floats, ...] = np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 3))
        if state not in ("none", "dry"):
            turn = kinematics.rotations[0, 0]
            arms = (kinematics.origins[0] - kinematics.origins[0, :1]) @ turn
            places = [arms[k : k + 1] for k in range(self._links)]
            turns = [turn.T @ kinematics.rotations[0, k] for k in range(self._links)]
            volume = self._laws.volume
            wet = BatchImmersionEstimator(places, turns, volume, self._gravity).now(sample)
        limits = self._limits.now(motion, sample)
        return [*mass[1:], wet[0], wet[1], wet[2].reshape(-1), *(x.reshape(-1) for x in limits)]
