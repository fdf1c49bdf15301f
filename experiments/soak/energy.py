"""Energy balance of a long flight: work by the load ledger against kinetic energy."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.multibody.equations import weightless
from seals.multibody.spatial import added_terms
from seals.state_records import state_record
from seals.world import Actor


@state_record
class Instant(NamedTuple):
    """Quantities of one instant for the energy balance; the robot has L links and J joints.

    Args:
        kinetic: rigid energy of all links [J].
        twists: of all links, link axes, shape (L, 6).
        loads: power of every effect of the ledger [W], shape (E,).
        rates: of the joints, shape (J,).
        efforts: forces on the joints over the step that begins here [N m], shape (J,).
        water: power that the velocity terms of the added inertias take [W].
        added: added inertia of every link [kg, kg m, kg m^2], shape (L, 6, 6).
    """

    kinetic: float
    twists: Floats
    loads: Floats
    rates: Floats
    efforts: Floats
    water: float
    added: Floats


@state_record
class Totals(NamedTuple):
    """Energies since the start [J].

    Args:
        work: of every effect on the links, shape (E,).
        joints: work of the servos and of what else acts on the joints.
        water: work of the water that the robot accelerates with itself.
        moved: energy that all of these moved in either direction, step by step.
        gained: kinetic energy of the links, now less that at the start.
    """

    work: Floats
    joints: float
    water: float
    moved: float
    gained: float

    @property
    def gap(self) -> float:
        """Gain that the work does not explain, over the energy that was moved [1]."""
        done = float(self.work.sum()) + self.joints + self.water
        return (self.gained - done) / max(self.moved, 1e-12)


class Books:
    """Energy balance of one robot, step by step.

    The kinetic energy is that of the links alone. What changes it: every effect of the ledger
    (weight among them), the forces on the joints, and the reaction of the water that is
    accelerated with the body, which is inertia and no load, so that it is not in the ledger.
    Powers are joined by the trapezoidal rule, forces on the joints are those of the step.

    Args:
        actor: in a world that was reset.
    """

    def __init__(self, actor: Actor) -> None:
        self.actor = actor
        self._last: Instant | None = None
        body: Any = actor.body
        self._apply, body.apply = body.apply, self._hear
        count = len(actor.ledger.effects)
        self.totals = Totals(np.zeros(count), 0.0, 0.0, 0.0, 0.0)

    def keep(self) -> dict[str, Any]:
        """Return the complete state, for a checkpoint."""
        return {"last": self._last, "totals": self.totals}

    def take_up(self, kept: dict[str, Any]) -> None:
        """Restore a state that `keep` returned."""
        self._last, self.totals = kept["last"], kept["totals"]

    def _hear(self, dynamics: Dynamics, step: float) -> None:
        """Pass the step on to the body, and write down what it does."""
        self._apply(dynamics, step)
        now = self._instant(dynamics)
        if self._last is not None:
            self.totals = self._grown(self._last, now, step)
        self._last = now

    def _instant(self, dynamics: Dynamics) -> Instant:
        actor, twists = self.actor, dynamics.moving.twists[0]
        kinetic = 0.5 * np.einsum("lk,lkm,lm->", twists, actor.robot.spatial_inertia, twists)
        loads = np.einsum("elk,lk->e", actor.ledger.wrenches[-1], twists)
        water, inertia = 0.0, np.zeros((len(twists), 6, 6))
        for _, rows, added, medium in dynamics.found.inertias:
            picked = slice(None) if rows is None else rows
            own = twists[picked]
            if not weightless(added):
                inertia[picked] += added.weight[:, :, None] * added.matrix
                motion = dynamics.motion._replace(velocity=own[:, :3], angular_velocity=own[:, 3:])
                force, torque = added_terms(added, medium, motion)
                water -= float((force * own[:, :3]).sum() + (torque * own[:, 3:]).sum())
        lead = 0 if actor.robot.tree.fixed_base else 6
        rates = dynamics.moving.speed[0, lead:].copy()
        body: Any = actor.body
        efforts = np.array(body.joint_forces())
        return Instant(float(kinetic), twists.copy(), loads, rates, efforts, water, inertia)

    def _grown(self, a: Instant, b: Instant, step: float) -> Totals:
        t = self.totals
        work = 0.5 * step * (a.loads + b.loads)
        joints = 0.5 * step * float(a.efforts @ (a.rates + b.rates))
        water = 0.5 * step * (a.water + b.water)
        if a.added.any() or b.added.any():
            turned = np.matmul(a.added + b.added, (b.twists - a.twists)[:, :, None])[:, :, 0]
            water -= 0.25 * float((turned * (a.twists + b.twists)).sum())
        moved = float(np.abs(work).sum()) + abs(joints) + abs(water)
        gained = t.gained + b.kinetic - a.kinetic
        return Totals(t.work + work, t.joints + joints, t.water + water, t.moved + moved, gained)
