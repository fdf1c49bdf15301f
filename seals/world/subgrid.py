"""Sub-grid drag: what the stated drag of a robot has more than the drag that its fluid resolves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Array, Floats
from seals.effects.binding import BoundEffect, EffectSet
from seals.effects.effect import Effect, MediumKind
from seals.effects.evaluation import Evaluation, Evaluator
from seals.environment.sample import Sample
from seals.environment.sampler import EnvironmentSampler
from seals.frames import unrotate
from seals.motion import Inputs, Joints, Motion, Wrench
from seals.robot.model import RobotModel

MOST = 4.0
"""Largest drag that counts as resolved, over the stated one [1]."""
WAY = 1.0
"""Way over which powers are averaged, and the drag comes up [diameters]; in turning twice as much
in radians."""
WET = 0.999
"""Least submerged share of a body: at the surface slams and waves would count as drag [1]."""
TINY = 1e-30
"""In place of zero in a divisor."""
_DONE, _STATED, _GONE, _TRUST, _ENERGY = (slice(k, k + 2) for k in range(0, 10, 2))
_TWIST, _PUSH, _PLACE, _WIDTH = slice(10, 16), slice(16, 22), slice(22, 25), 25
"""Columns of the memory: work of water and of the stated drag, way, T, energy of the added mass,
each of translation and turning; twist; wrench of the water without buoyancy; place."""


class SubgridDrag:
    """Difference between the drag that a robot states and the one that its fluid resolves.

    Equation:
        F = T (1 - r) F_s, r = min(<P> / <P_s>, <P> / <v> v / P_s, MOST), not below 0, of forces
        and of torques apart: F_s is the stated drag now and P_s its power against the motion; P
        that of the water's wrench without buoyancy, less what the energy of the stated added mass
        gains; < > sums with exp(-way / reach), T = 1 - exp(-way / reach), reach is `WAY` diameters.

    A body in steady motion so has its stated drag in the mean, whatever part of it is resolved.
    Where the particles brake more than stated, the term pushes, but never more than they braked:
    of the resolved force and the resolved coefficient the smaller counts, so that neither a start
    nor a stop makes it drive the body. After a body was at the surface the term comes up anew. It
    acts on the body alone: the water does not feel it, and it is not in the fluid's momentum.

    Args:
        robot: the robot.
        stated: drag, added mass and buoyancy as effects.
        surroundings: of its links.
        roots: links that bear the wrenches of the fluid; the drag of others is left out.

    Limitations:
        The stated drag is that of open water at rest: what a wall, a wake or waves change in the
        mean drag is taken out as an error of the particles. Effects that have a memory see none.
    """

    name = "subgrid_drag"

    def __init__(
        self,
        robot: RobotModel,
        stated: EffectSet,
        surroundings: EnvironmentSampler,
        roots: Sequence[int],
    ) -> None:
        # as which its load is among those of the robot's effects
        self.bound = BoundEffect(
            name=self.name, effect=Effect(), links=(), kind=MediumKind.water, params={}
        )
        self._memory = stated.zero_memory()
        self._lifting = {b.name for b in stated.bound if "buoyancy" in b.effect.accounts_for}
        self._evaluator = Evaluator(
            stated, surroundings, links=len(robot.links), batch=1, joint_links=robot.tree.child
        )
        # diameter of the sphere that displaces as much
        volume = robot.bodies(np.zeros(1)).volume
        self._diameter = np.cbrt(6.0 / np.pi * volume)
        self._bears = np.zeros((len(robot.links), 1))
        self._bears[list(roots)] = 1.0
        self._bears[self._diameter <= 0.0] = 0.0

    def loads(
        self, motion: Motion, joints: Joints, inputs: Inputs, memory: Array | None, sample: Sample
    ) -> tuple[Wrench, Floats]:
        """Return the wrench about the link origins, and the memory for `note`.

        Args:
            motion: of the links.
            joints: positions and rates.
            inputs: of the effects.
            memory: of the last step, shape (L, 25); None at a start.
            sample: surroundings of the links.
        """
        found = self._evaluator.evaluate(motion, joints, inputs, self._memory, sample)
        drag, lift = np.zeros((2, len(self._bears), 6))
        for b, rows, wrench in found.loads:
            total = lift if b.name in self._lifting else drag
            where = slice(None) if rows is None else rows
            for part, columns in ((wrench.force, slice(0, 3)), (wrench.torque, slice(3, 6))):
                if part is not None:
                    total[where, columns] += part
        velocity = motion.velocity
        if memory is not None:
            # by the way of the last step: the velocity now goes with the water's last force, whose
            # noise would count as work
            velocity = unrotate(
                motion.rotation, (motion.position - memory[:, _PLACE]) / inputs.step
            )
        twist = np.hstack([velocity - sample.water_velocity, motion.angular_velocity])
        new = np.zeros((len(drag), _WIDTH))
        new[:, _PLACE] = motion.position
        new[:, _TWIST], new[:, _PUSH] = twist, -lift
        speed, power = _speeds(twist), -_powers(drag, twist)
        # the water begins at rest: it has no energy of the added mass then
        if memory is not None:
            new[:, _ENERGY] = _energy(found, twist)
            self._add(new, memory, power, inputs.step)
        new[:, : _TRUST.stop] *= self._bears * (sample.submersion >= WET)
        done = np.maximum(new[:, _DONE], 0.0)
        force = done / np.maximum(new[:, _GONE], TINY) * speed / np.maximum(power, TINY)
        share = np.minimum(done / np.maximum(new[:, _STATED], TINY), np.minimum(force, MOST))
        missing = new[:, _TRUST] * (1.0 - share)
        return Wrench(missing[:, :1] * drag[:, :3], missing[:, 1:] * drag[:, 3:]), new

    def _add(self, new: Floats, old: Floats, power: Floats, step: float) -> None:
        """Add the work of the last step to the sums, which fade with the way."""
        middle = 0.5 * (old[:, _TWIST] + new[:, _TWIST])
        way = step * _speeds(middle)
        reach = WAY * np.hstack([self._diameter, np.full_like(self._diameter, 2.0)])
        fade = np.exp(-way / np.maximum(reach, TINY))
        done = -step * _powers(old[:, _PUSH], middle) + old[:, _ENERGY] - new[:, _ENERGY]
        new[:, _DONE] = fade * old[:, _DONE] + done
        new[:, _STATED] = fade * old[:, _STATED] + step * power
        new[:, _GONE] = fade * old[:, _GONE] + way
        new[:, _TRUST] = 1.0 - fade * (1.0 - old[:, _TRUST])

    @staticmethod
    def note(memory: Floats, wrench: Floats) -> Floats:
        """Return the memory with the wrenches of the fluid in this step, shape (L, 6)."""
        noted: Floats = memory.copy()
        noted[:, _PUSH] += wrench
        return noted


def _speeds(twist: Floats) -> Floats:
    """Speed [m/s] and rate of turning [rad/s], shape (L, 2)."""
    return np.asarray(np.sqrt((twist**2).reshape(-1, 2, 3).sum(axis=2)))


def _powers(wrench: Floats, twist: Floats) -> Floats:
    """Power of force and torque [W], shape (L, 2)."""
    return np.asarray((wrench * twist).reshape(-1, 2, 3).sum(axis=2))


def _energy(found: Evaluation, twist: Floats) -> Floats:
    """Kinetic energy of the stated added mass, of translation and of turning [J], shape (L, 2)."""
    energy = np.zeros((len(twist), 2))
    for _, rows, added, _ in found.inertias:
        where = slice(None) if rows is None else rows
        momentum = np.einsum("nij,nj->ni", added.weight[:, :, None] * added.matrix, twist[where])
        energy[where] += 0.5 * _powers(momentum, twist[where])
    return energy
