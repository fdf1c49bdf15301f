"""Split of added inertia between an engine's masses and explicit wrenches.

An engine knows a scalar mass and principal moments only. The largest isotropic part of the added
inertia goes into them, where contacts see it. The rest acts as a wrench made from the acceleration
that the full equations predict; contact forces of the last step and limits of joints enter the
prediction, so that a body at rest on the ground feels exactly the applied force.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats, namespace, some
from seals.backend import Dynamics
from seals.coupling.engine import EngineBody, ImplicitDrive
from seals.effects.evaluation import Evaluation
from seals.errors import ConfigError
from seals.frames import skew_last
from seals.multibody.equations import Assembly, scatter, weightless
from seals.multibody.linear import solution
from seals.multibody.servo import driven, heavier
from seals.multibody.spatial import rigid_inertia
from seals.robot.model import RobotModel


class _NearStops(NamedTuple):
    """Joints whose limits act in the next step of the engine.

    Args:
        low: least acceleration that the lower limits allow [rad/s^2 or m/s^2], shape (J,); minus
            infinity for joints that have not passed theirs.
        high: greatest, likewise.
    """

    low: Floats
    high: Floats

    def held(self, matrix: Floats, acceleration: Floats) -> Floats:
        """Return the generalised acceleration with the reactions of the limits, shape (n,).

        Equation:
            M a' = M a + e_j r_j over the joints j at a limit, with a'_j at its bound and the
            reaction r_j pushing inwards; limits that would pull let go (active set).

        Args:
            matrix: M, with the inertia of drives, shape (n, n).
            acceleration: a, without limits, shape (n,).
        """
        joints = len(self.low)
        lead = len(acceleration) - joints
        free = acceleration[lead:]
        bound = np.clip(free, self.low, self.high)
        active = bound != free
        if not active.any():
            return acceleration
        inverse = np.linalg.inv(matrix)
        # every pass adds or drops limits; more passes than sets of one joint each are not needed
        for _ in range(2 * joints + 2):
            rows = lead + np.flatnonzero(active)
            target = np.where(free > self.high, self.high, self.low)[active]
            reaction = np.linalg.solve(inverse[np.ix_(rows, rows)], target - acceleration[rows])
            out: Floats = acceleration + inverse[:, rows] @ reaction
            inwards = np.where(free > self.high, -1.0, 1.0)[active]
            pulling, wrong = reaction * inwards < 0.0, np.zeros(joints, dtype=bool)
            wrong[np.flatnonzero(active)] = pulling
            now = out[lead:]
            beyond = ~active & ((now < self.low - 1e-9) | (now > self.high + 1e-9))
            if not wrong.any() and not beyond.any():
                return out
            free = np.where(beyond, now, free)
            active = (active & ~wrong) | beyond
            if not active.any():
                return acceleration
        return out


class JointStops:
    """Limits of the joints of a robot, as the engine keeps them.

    Equation:
        A limit acts in a step at whose start the joint has passed it by d >= 0, and leaves the rate
        c d / h inwards at least: v' <= -c d / h at an upper limit. A limit that is reached within
        the step does not act yet: a load that counted on its reaction would push the joint through.

    Args:
        lower: [rad or m], minus infinity for none, shape (J,).
        upper: likewise.
        taken_back: c, share of d that the engine takes back in a step [1].
    """

    def __init__(self, lower: Floats, upper: Floats, taken_back: float) -> None:
        self._lower, self._upper, self._taken_back = lower, upper, taken_back
        self._any = bool(np.isfinite(lower).any() or np.isfinite(upper).any())

    def near(self, joints: Floats, rates: Floats, step: float) -> _NearStops | None:
        """Return the limits that act in the next step; None for none.

        Args:
            joints: positions [rad or m], shape (J,).
            rates: [rad/s or m/s], shape (J,).
            step: h [s].
        """
        if not self._any:
            return None
        below, above = joints <= self._lower, joints >= self._upper
        if not (below.any() or above.any()):
            return None
        low, high = np.full(len(joints), -np.inf), np.full(len(joints), np.inf)
        back = self._taken_back / step
        low[below] = ((back * (self._lower - joints) - rates) / step)[below]
        high[above] = ((back * (self._upper - joints) - rates) / step)[above]
        return _NearStops(low, high)


REFRESH = 0.02
"""Relative change of the isotropic part at which the engine's mass is set anew."""


class InertiaSplit:
    """Split of a robot's inertia between the engine's masses and explicit wrenches.

    Args:
        engine: the robot in the engine.
        robot: its model.
    """

    def __init__(self, engine: EngineBody, robot: RobotModel) -> None:
        self._engine, self._robot = engine, robot
        self._assembly = Assembly(robot.spatial_inertia[None])
        self._iso = np.zeros((len(robot.links), 2))
        self._engine_inertia = robot.spatial_inertia.copy()
        self._scale = np.stack((robot.mass, engine.moments.min(axis=1)), axis=1)
        self._units: dict[str, tuple[bytes, Floats]] = {}
        self._raised = False
        # wanted isotropic part that is known to change nothing, as bytes
        self._same: bytes | None = None

    def snapshot(self) -> Any:
        """Return the isotropic parts held by the engine."""
        return self._iso.copy()

    def restore(self, kept: Any) -> None:
        """Restore the isotropic parts."""
        for link in np.flatnonzero((kept != self._iso).any(axis=1)):
            self._set(int(link), *kept[link])
        self._raised = bool(self._iso.any())

    @property
    def isotropic(self) -> Floats:
        """Mass and moment that the engine holds besides the robot's, shape (L, 2)."""
        return self._iso

    def idle(self, dynamics: Dynamics) -> bool:
        """Return whether the engine's own equations are complete: no added inertia acts."""
        none = all(weightless(added) for _, _, added, _ in dynamics.found.inertias)
        return none and not self._raised and not dynamics.discontinuous

    def act(
        self,
        dynamics: Dynamics,
        contact: Floats | None,
        acting: ImplicitDrive | None,
        stops: _NearStops | None = None,
    ) -> tuple[Floats, Floats]:
        """Return the wrenches that make the engine's step follow the full equations.

        Args:
            dynamics: of the robot at the current time.
            contact: contact wrenches of the last step, None without contact, shape (L, 6).
            acting: drives of the joints, None without.
            stops: limits that joints stand at; None for none.

        Returns:
            Wrenches about the link origins, link axes [N, N m], shape (L, 6), and forces on the
            joints [N m or N], shape (J,).
        """
        self.update(self._wanted(dynamics.found))
        own, joint_force, _ = self.law(dynamics, contact, acting, self._engine_inertia, stops)
        return own, joint_force

    def law(
        self,
        dynamics: Dynamics,
        contact: Array | None,
        acting: ImplicitDrive | None,
        engine: Array,
        stops: _NearStops | None = None,
    ) -> tuple[Array, Array, Array]:
        """Return the wrenches and joint forces of `act`, and the generalised inertia; pure.

        Args:
            dynamics: of the robot at the current time.
            contact: contact wrenches of the last step, None without contact, shape (L, 6).
            acting: drives of the joints, None without.
            engine: inertia of the links in the engine, shape (L, 6, 6).
            stops: limits that joints stand at, on NumPy; None for none.
        """
        kinematics, moving = dynamics.kinematics, dynamics.moving
        total = self._assembly.total_inertia(dynamics.found, 1)
        bias = kinematics.bias(moving)
        still = at_rest(dynamics.found)
        turning = _turning(moving.twists[0])
        if still:
            # the terms are linear in the inertia: those of the sum are the sum
            terms = _terms(turning, total[0], moving.twists[0])[None]
        else:
            terms = self._assembly.velocity_terms(dynamics.motion, dynamics.found)
        load = dynamics.wrench - terms - _times(total, bias)
        seen = load if contact is None else load + contact[None]
        parts = self._assembly.system(kinematics, total, seen, dynamics.joint_force)
        acceleration, joint_force = _accelerations(*parts, dynamics.joint_force, acting)
        if stops is not None:
            armature = None if acting is None else acting.armature
            matrix = parts[0] if armature is None else heavier(parts[0], armature[None])
            acceleration = stops.held(matrix[0], acceleration[0])[None]
        if not self._raised and total is self._assembly.inertia:
            # the engine holds the whole inertia: its own equations are the full ones
            return dynamics.wrench[0], joint_force[0], parts[0][0]
        change = kinematics.twists(acceleration)
        if still:
            rest = total[0] - engine
            own = dynamics.wrench[0] - _terms(turning, rest, moving.twists[0])
            return own - _times(rest, bias[0] + change[0]), joint_force[0], parts[0][0]
        own = load - _times(total - engine, change) + _times(engine[None], bias)
        own = own[0] + _terms(turning, engine, moving.twists[0])
        return own, joint_force[0], parts[0][0]

    def joint_forces(self, dynamics: Dynamics, acting: ImplicitDrive) -> Floats:
        """Return the joint forces of the first step, which has no predecessor, shape (J,)."""
        d = dynamics
        total, bias = self._assembly.inertia, d.kinematics.bias(d.moving)
        terms = self._assembly.velocity_terms(d.motion, d.found)
        load = d.wrench - terms - _times(total, bias)
        parts = self._assembly.system(d.kinematics, total, load, d.joint_force)
        found: Floats = _accelerations(*parts, d.joint_force, acting)[1][0]
        return found

    def _wanted(self, found: Evaluation) -> Floats | None:
        """Return the isotropic part of the added inertias, shape (L, 2); None for nothing."""
        carried = [x for x in found.inertias if not (x[2].apart or weightless(x[2]))]
        if not carried and not self._raised:
            return None
        wanted = np.zeros_like(self._iso)
        for b, rows, added, _ in carried:
            picked = slice(None) if rows is None else rows
            wanted[picked] += added.weight * self._unit(b.name, added.matrix, b.links)
        return wanted

    def update(self, wanted: Floats | None) -> bool:
        """Set the engine's masses where the isotropic part has changed; return whether it has.

        Args:
            wanted: mass [kg] and moment [kg m^2] of every link, shape (L, 2); None for no change.
        """
        if wanted is None:
            return False
        far = self._far(wanted)
        if not far.any():
            return False
        for link in np.flatnonzero(far.any(axis=1)):
            self._set(int(link), *wanted[link])
        self._raised = bool(self._iso.any())
        return True

    def changes(self, wanted: Floats) -> bool:
        """Return whether `update` would set the engine's masses."""
        kept = wanted.tobytes()
        if kept == self._same:
            return False
        changed = bool(self._far(wanted).any())
        self._same = None if changed else kept
        return changed

    def _far(self, wanted: Floats) -> NDArray[np.bool_]:
        """Which links' isotropic parts have changed, shape (L, 2)."""
        if self._robot.tree.fixed_base:
            wanted[0] = 0.0  # it does not move, and engines may let a base loose that has a mass
        far: NDArray[np.bool_] = np.abs(wanted - self._iso) > REFRESH * (self._scale + self._iso)
        return far

    def _unit(self, name: str, matrix: Floats, links: tuple[int, ...]) -> Floats:
        """Isotropic mass [kg] and moment [kg m^2] of an added inertia of weight one, shape (n, 2).

        They are kept until the matrix changes.
        """
        kept = self._units.get(name)
        if kept is not None and kept[0] == matrix.tobytes():
            return kept[1]
        table = [
            _isotropic(matrix[k if len(matrix) > 1 else 0], self._robot.centre[link])
            for k, link in enumerate(links)
        ]
        self._units[name] = (matrix.tobytes(), np.array(table))
        return self._units[name][1]

    def traced(self, found: Evaluation, isotropic: Array) -> tuple[Array, Array]:
        """Return inertia of the links in the engine (L, 6, 6) and wanted isotropic part (L, 2).

        Both are functions of what the engine has now and of the traced weights, for `law` and
        `update`.

        Args:
            found: traced; matrices of added inertias are numbers, but for those apart.
            isotropic: mass and moment that the engine holds besides the robot's, shape (L, 2).
        """
        xp, robot = namespace(isotropic), self._robot
        none = np.zeros((3, 3))
        mass = np.array([rigid_inertia(1.0, c, none) for c in robot.centre])
        moment = np.diag((0.0, 0.0, 0.0, 1.0, 1.0, 1.0))
        pair = isotropic[:, :, None, None]
        engine = pair[:, 0] * xp.asarray(mass) + pair[:, 1] * xp.asarray(moment[None])
        wanted, links = xp.zeros_like(isotropic), len(robot.links)
        for b, rows, added, _ in found.inertias:
            if added.apart:
                continue
            matrix = added.matrix.numbers
            if matrix is None:
                raise ConfigError(
                    f"effects.{b.name}: an added inertia that is not a constant times a weight is "
                    "not supported by this engine"
                )
            part = added.weight * xp.asarray(self._unit(b.name, matrix, b.links))
            wanted = wanted + (part if rows is None else scatter(part, rows, links))
        return engine + xp.asarray(robot.spatial_inertia), wanted

    def _set(self, link: int, mass: float, moment: float) -> None:
        """Put an isotropic part into the engine."""
        robot = self._robot
        self._iso[link] = mass, moment
        self._same = None
        total = float(robot.mass[link] + mass)
        self._engine.set_inertia(link, total, self._engine.moments[link] + moment)
        inertia = robot.inertia[link] + moment * np.eye(3)
        self._engine_inertia[link] = rigid_inertia(total, robot.centre[link], inertia)


def _accelerations(
    matrix: Array, right: Array, joint_force: Array, acting: ImplicitDrive | None
) -> tuple[Array, Array]:
    """Generalised acceleration (1, n) and forces on the joints (1, J)."""
    if acting is None:
        return solution(matrix, right), joint_force
    whole = heavier(matrix, acting.armature[None])
    change, pull = driven(whole, right, acting.drive, acting.gain)
    turned = acting.armature * change[:, -len(acting.armature) :]
    return change, joint_force + pull - turned


def _isotropic(added: Floats, centre: Floats) -> tuple[float, float]:
    """Largest isotropic mass and moment inside an added inertia, about the centre of mass."""
    mass = max(float(np.linalg.eigvalsh(added[:3, :3])[0]), 0.0)
    about = added[3:, 3:] - rigid_inertia(mass, centre, np.zeros((3, 3)))[3:, 3:]
    return mass, max(float(np.linalg.eigvalsh(about)[0]), 0.0)


def _times(matrix: Array, vectors: Array) -> Array:
    """Matrices (..., 6, 6) times vectors (..., 6)."""
    return namespace(vectors).matmul(matrix, vectors[..., None])[..., 0]


def _turning(twists: Array) -> Array:
    """Matrices that give the Kirchhoff terms of momenta, shape (L, 6, 6); twists (L, 6)."""
    both = skew_last(twists.reshape(-1, 2, 3))
    if type(both) is np.ndarray:
        out = np.zeros((len(twists), 6, 6))
        out[:, :3, :3] = out[:, 3:, 3:] = both[:, 1]
        out[:, 3:, :3] = both[:, 0]
        return out
    xp = namespace(both)
    upper = xp.concat((both[:, 1], both[:, 1] * 0.0), axis=2)
    return xp.concat((upper, xp.concat((both[:, 0], both[:, 1]), axis=2)), axis=1)


def _terms(turning: Array, inertia: Array, twists: Array) -> Array:
    """Velocity terms of inertias (L, 6, 6) at twists (L, 6), see `seals.multibody.spatial`."""
    xp = namespace(twists)
    return xp.matmul(turning, xp.matmul(inertia, twists[:, :, None]))[:, :, 0]


def at_rest(found: Evaluation) -> bool:
    """Return whether the media of all added inertias rest, and none has directions of the world."""
    if any(added.apart for _, _, added, _ in found.inertias):
        return False
    fields = {id(x): x for *_, m in found.inertias for x in (m.velocity, m.acceleration)}
    return not any(some(x) for x in fields.values())
