"""Cascaded velocity and attitude control for vehicles that tilt to direct their thrust."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace, some
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.added import added_inertia, water_drag
from seals.control.allocation import LIFT_ROWS, Allocation, Saturation
from seals.control.attitude import attitude_error, lean_for
from seals.control.filters import Lag, Rate, Trend, summed
from seals.control.fins import Fins, with_fins
from seals.control.limbs import Reckoned, joint_targets, servo_lag, stowed, way_of
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import ROTOR, UPWARD, lifting
from seals.control.protocols import CommandLaw, Compiler, of_one
from seals.control.tilts import tilted_drives, tilts_of
from seals.errors import ConfigError
from seals.frames import cross
from seals.plugins.controllers.cascade.gains import CascadeSettings, Gains
from seals.plugins.controllers.compiled_law import CompiledController, PackedState, packed
from seals.state_records import state_record

WEIGHTS = np.array([0.02, 1.0, 1.0, 0.002])
"""Importance of lift, roll, pitch and yaw where the rotors cannot do it all."""
NEARLY = 1.0 - 1e-6
"""Share of a limit from which a drive counts as being at it: roots of squares round, and so do
numbers in single precision."""
SERVO_LAG = 0.05
"""Lag of joints that no servo drives [s]."""


LEAST_PULL = 0.2
"""Thrust of a tilted rotor, by its share of the weight, that a tilt counts on [1]."""


@state_record
class CascadeState(NamedTuple):
    """State of the cascade controller between calls; immutable. One robot is a batch of one.

    Args:
        sum: of the velocity error, world axes [m], shape (B, 3).
        turn_sum: of the attitude error, body axes [rad s], shape (B, 3).
        drive: states of the drives as reckoned [rad/s or N], shape (B, n).
        fresh: 1 before the first call, when the drives are taken to be where they are wanted.
        velocity: with its rate, world axes; None without a gain on that rate.
        inner: what the motion of the joints does; None if they are held.
        known: acceleration that is fed forward, with its rates, world axes; None if nothing is.
        joints: targets of the joints [rad or m], shape (J,); None if they are held.
    """

    sum: Array
    turn_sum: Array
    drive: Array
    fresh: Array
    velocity: Rate | None = None
    inner: Inner | None = None
    known: Trend | None = None
    joints: Floats | None = None


class HeldState(NamedTuple):
    """State of the cascade where joints are held and nothing is fed forward; see `CascadeState`."""

    sum: Array
    turn_sum: Array
    drive: Array
    fresh: Array


@state_record
class Inner(NamedTuple):
    """Predicted motion of the joints and its reaction on the body.

    Args:
        arm: motion of the joints; None before the first call.
        moved: with its rates, body axes: velocity of the centre of gravity, momentum of the
            joints, and inertia of the robot as nine numbers.
    """

    arm: Reckoned | None
    moved: Trend


class Asked(NamedTuple):
    """Demand on the rotors.

    Args:
        wrench: lift, and torque about the centre of gravity [N, N m], shape (B, 4); of no meaning
            where there are speeds.
        error: of the velocity, world axes [m/s], shape (B, 3).
        turn_error: of the attitude, body axes [rad], shape (B, 3).
        gains: at this submersion.
        kept: the memory with what is known already.
        speeds: of the rotors that the reference asks for [rad/s], shape (B, n); None for those of
            the wrench.
    """

    wrench: Array
    error: Array
    turn_error: Array
    gains: Gains
    kept: CascadeState
    speeds: Array | None = None


@dataclass(kw_only=True)
class Cascade(CascadeSettings):
    """Velocity PID with gravity and acceleration fed forward, over geometric attitude control.

    Equation:
        F = M (a + k_p (v_ref - v) + k_i sum (v_ref - v) + k_d (a - v')) + m (g + c'') - buoyancy,
        and the drag at v_ref under water,
        M = m + s M_A; the robot leans so that its z axis lies along F.
        T = J (-k_R e_R - k_w (w - w_d) - k_I sum e_R) + w x (J w + h) + h' - buoyancy's torque,
        J with s times the added inertia, h and c'' the joints' momentum and the acceleration of
        the centre of gravity in the body by their motion. The rotors' speeds follow by the
        allocation about the live centre of gravity.
        A reference with body rates gives w_d and the lift, with k_R = k_I = 0; one with thrusts T
        gives the speeds, sqrt(T / (gain k_T)), which follow with the rotors' own lag.

    Args:
        rate: calls a second [Hz]; the other fields are those of `CascadeSettings`.

    Assumptions:
        The rotors push upward; one that does not, such as the pusher of a vehicle with wings,
        rests. A joint may tilt one rotor each, and its angle then serves as a drive. The model of
        the robot is known, its load is not.

    Valid range:
        Leans below a right angle; under water, thrusts above those that point nowhere.

    Limitations:
        Linear drag, and drag in air, are left to the sum of the error. A robot as heavy as its
        water cannot move sideways without rising.

    References:
        Mellinger and Kumar 2011 (doi 10.1109/ICRA.2011.5980409); Lee, Leok, McClamroch 2010, CDC.
    """

    inner: ClassVar[bool] = True

    def bind(self, plant: Plant) -> None:
        """Find allocation, added mass and rest pose of the robot.

        Raises:
            ConfigError: the robot has fewer than four rotors that push upward.
        """
        self._bind(plant, np.zeros(1))

    def _bind(self, plant: Plant, like: Array, joints: Floats | None = None) -> None:
        """Prepare the law in the library of an array; for held joints, or for those that move."""
        plant = plant._replace(layout=lifting(plant.layout))
        layout = plant.layout
        self._tilts = _refuse_unfit(plant)
        self._tilted = tilted_drives(plant.robot, layout, self._tilts)
        self._plant, self._like, self._g = plant, like, plant.gravity
        estimator = MassPropertyEstimator(plant.robot)
        self.allocation = Allocation(
            with_fins(layout, self._tilts) if self._tilted else layout,
            rows=LIFT_ROWS,
            saturation=self.saturation,
            weights=WEIGHTS,
            centre=None if joints is None else estimator.at(joints).centre,
            like=like,
        )
        if not self.allocation.full:
            raise ConfigError(
                f"controller=cascade: the drives of robot '{plant.robot.name}' do not command "
                "lift, roll, pitch and yaw independently.\n"
                "Check position, axis, direction and coefficients of its rotors: "
                f"seals check robot={plant.robot.name}"
            )
        self._lag = Lag(layout.lag, layout.fall, like)
        strongest = layout.thrust_coefficient * layout.limit**2
        # of all rotors at once, along body z [N]; each one's largest speed in air [rad/s]
        self._lift = as_like(np.full((1, 1), strongest @ layout.axis[:, 2]), like)
        self._fastest = as_like(layout.limit[None], like)
        added = added_inertia(plant)
        self._added, self._added_turn = as_like(added[:3, :3], like), as_like(added[3:, 3:], like)
        self._drag = as_like(water_drag(plant)[None], like)
        self._rest = stowed(plant.robot)
        self._at_rest = estimator.at(self._rest)
        self._servo_lag = servo_lag(plant, SERVO_LAG)
        self._way = 0.0, self._servo_lag
        self._media = [
            Gains(*(as_like(np.atleast_2d(x), like) for x in self.gains(k))) for k in (0, 1)
        ]
        self._rated = max(self.rate_gain) > 0.0
        self._compiled: CompiledController | None = None

    def batched(self, plant: Plant, joints: Floats | None, like: Array) -> CascadeBatch:
        """Return this law over a batch, see `ControllerOptions`.

        Raises:
            ConfigError: see `bind`; or the cascade has a gain on the rate of the velocity.
        """
        law = copy.copy(self)
        law._bind(plant, like, joints)
        if law._tilts.joints:
            raise ConfigError(
                f"a batch cannot have a joint that tilts a rotor, as robot '{plant.robot.name}' "
                "does.\n"
                "Run it in a world: backend=pybullet"
            )
        if law._rated:
            raise ConfigError(
                f"controller.rate_gain={list(self.rate_gain)} has no batched form.\n"
                "Allowed: [0.0, 0.0]"
            )
        return CascadeBatch(law, held=joints is not None)

    def start(self, batch: int = 1) -> CascadeState:
        """Return zero integrators; arms stowed, grippers open."""
        return CascadeState(
            *self.zero(batch),
            velocity=Rate(None, np.zeros((1, 3))) if self._rated else None,
            inner=Inner(None, Trend.flat(15)) if self._rest.size else None,
            known=Trend.flat(3),
            joints=self._rest if batch == 1 else np.tile(self._rest, (batch, 1)),
        )

    def zero(self, batch: int) -> HeldState:
        """Return zero integrators of B robots whose joints are held; nothing is fed forward."""
        zero = as_like(np.zeros((batch, 3)), self._like)
        drive = as_like(np.zeros((batch, self._plant.layout.drives)), self._like)
        return HeldState(zero, zero, drive, drive[:, 0:1] + 1.0)

    def command(
        self, situation: RobotState, aim: Reference, memory: CascadeState | PackedState
    ) -> tuple[ActuatorCommand, CascadeState | PackedState]:
        """Return speeds of the rotors and targets of the servos."""
        s, quick = situation if self.cog_compensation else self._unaware(situation), self._compiled
        if isinstance(memory, PackedState):
            if quick is not None:
                last = self._rest if memory.joints is None else memory.joints
                joints = joint_targets(aim, last, self._plant.robot)
                return quick.command(s, aim, joints, memory)
            memory = memory.unpacked(self._form())
        order, tilts, kept = self.moving(*of_one(s, aim), memory)
        # tilts are no motion to feed forward: what they do is in the allocation
        targets = np.array(kept.joints)
        targets[list(self._tilts.joints)] = tilts[0]
        return ActuatorCommand(order[0], targets), kept if quick is None else packed(kept)

    def moving(
        self, s: RobotState, aim: Reference, memory: CascadeState
    ) -> tuple[Floats, Floats, CascadeState]:
        """Return commands of rotors and of servos that tilt some, (B, n) and (B, k), and memory."""
        last = self._rest if memory.joints is None else memory.joints
        joints = joint_targets(aim, last, self._plant.robot)
        asked = self.asked(s, aim, joints, memory)
        wanted, tilts = self._allocated(s, asked, memory.drive)
        order, kept = self.ordered(s, wanted, asked, memory)
        return order, tilts, kept

    def compile(self, compiled: Compiler | None) -> None:
        """Evaluate the law by machine code, for rotors that no servo tilts, or without."""
        fit = not self._tilted and not self._rated and self.saturation is Saturation.priority
        if compiled is None or not fit:
            self._compiled = None
        else:
            self._compiled = CompiledController(self, self._form(), compiled)

    def command_law(self, period: float, memory: Any, aim: Reference) -> CommandLaw | None:
        """Return its law where there is machine code, after the first call."""
        if self._compiled is None or not self.cog_compensation:
            return None
        return self._compiled.law(period, aim) if isinstance(memory, PackedState) else None

    def _form(self) -> CascadeState:
        """Return a state after a call, of any numbers."""
        state, zero = self.start(), np.zeros((1, 3))
        both, inner = Rate(zero, zero), state.inner
        if inner is not None:
            wide, rest = Rate(np.zeros((1, 15)), np.zeros((1, 15))), self._rest[None]
            inner = Inner(Reckoned(rest, rest), Trend(wide, wide))
        return state._replace(inner=inner, known=Trend(both, both))

    def asked(
        self, s: RobotState, aim: Reference, joints: Floats | None, memory: CascadeState
    ) -> Asked:
        """Return the demand on the rotors; pure, batch first, on any array library."""
        xp, (air, water) = namespace(s.velocity), self._media
        gains = Gains.between(air, water, s.submersion)
        inner, known, velocity = memory.inner, memory.known, memory.velocity
        # turning about the centre of gravity moves the origin, but is not the rotors' to undo
        swing = cross(s.angular_velocity, s.centre + s.angular_velocity * 0.0)
        error = (
            (
                aim.velocity
                if aim.position is None
                else aim.velocity + gains.position * (aim.position - s.position)
            )
            - s.velocity
            - _turned(s.rotation, swing)
        )
        asked = gains.speed * error + gains.sum * memory.sum
        if inner is not None and joints is not None:
            inner = self._inner(s, joints, inner)
        if known is not None:
            ahead = aim.acceleration
            if inner is not None:
                ahead = ahead + _turned(s.rotation, inner.moved.ahead(self.lean_lead, 0, 3))
            known, asked = known.next(ahead, s.step, self.smoothing), ahead + asked
        if velocity is not None:
            velocity = velocity.next(s.velocity, s.step, self.smoothing)
            asked = asked + gains.rate * (aim.acceleration - velocity.rate)
        kept = memory._replace(velocity=velocity, inner=inner, known=known, joints=joints)
        if not (aim.rates is aim.thrusts is None):
            return self._inside(s, aim, gains, kept)
        force = self._force(s, _shortened(asked, self.acceleration), aim.velocity)
        lean = lean_for(force, aim.yaw, tilt=gains.tilt, least=gains.least * (s.mass * self._g))
        turn_error, spin = attitude_error(s.rotation, lean), s.angular_velocity
        want = -gains.turn * turn_error
        if known is not None:
            axis = lean[:, :, 2]
            net = namespace(axis).maximum(
                self._g - s.buoyancy.force / s.mass, s.buoyancy.force * 0.0 + 0.3 * self._g
            )
            first, second = (
                _unturned(s.rotation, cross(axis, rate) / net)
                for rate in (known.first.rate, known.second.rate)
            )
            fed = first + aim.yaw_rate * _unturned(s.rotation, axis), second
            want, spin = fed[1] + want, spin - fed[0]
        want = want - gains.spin * spin - gains.turn_sum * gains.shape * memory.turn_sum
        lift = xp.sum(force * s.rotation[:, :, 2], axis=1, keepdims=True)
        wrench = xp.concat((lift, self._torque(s, want, inner)), axis=1)
        return Asked(wrench, error, turn_error, gains, kept)

    def _inside(self, s: RobotState, aim: Reference, gains: Gains, kept: CascadeState) -> Asked:
        """Return the demand of a reference that passes by the outer loops; nothing is summed up."""
        xp, none = namespace(s.velocity), kept.sum * 0.0
        if aim.thrusts is not None:
            share = xp.maximum(aim.thrusts, aim.thrusts * 0.0)
            speeds = self._fastest * xp.sqrt(share / s.gain)
            within = xp.minimum(xp.maximum(speeds, s.low), s.limit)
            return Asked(none, none, none, gains, kept, within)
        rates: Any = aim.rates
        want = gains.spin * (rates[:, 1:] - s.angular_velocity)
        torque = self._torque(s, want, kept.inner)
        wrench = xp.concat((self._lift * rates[:, :1], torque), axis=1)
        return Asked(wrench, none, none, gains, kept)

    def ordered(
        self, s: RobotState, wanted: Array, asked: Asked, memory: CascadeState
    ) -> tuple[Array, CascadeState]:
        """Return commands for wanted rotor speeds, and the new memory; pure, as `asked`."""
        xp, gains = namespace(wanted), asked.gains
        drive, order = xp.where(memory.fresh > 0.5, wanted, memory.drive), wanted
        if asked.speeds is None:
            order = self._lag.quickened(wanted, drive, self.quicker, (s.low, s.limit))
        total = summed(memory.sum, asked.error, s.step, gains.sum_limit)
        turn_total = summed(memory.turn_sum, asked.turn_error, s.step, gains.turn_sum_limit)
        # what the rotors cannot do is not summed up
        full = xp.any(wanted >= NEARLY * s.limit, axis=1)[:, None]
        return order, asked.kept._replace(
            sum=xp.where(full, memory.sum, total),
            turn_sum=xp.where(full, memory.turn_sum, turn_total),
            drive=self._lag.followed(drive, order, s.step),
            fresh=memory.fresh * 0.0,
        )

    def _allocated(self, s: RobotState, asked: Asked, drive: Floats) -> tuple[Floats, Floats]:
        """Return commands of the rotors, and angles of the servos that tilt some of them."""
        if asked.speeds is not None:
            return asked.speeds, np.zeros((len(asked.speeds), len(self._tilted)))
        bounds = {"gain": s.gain, "limit": s.limit, "low": s.low}
        count = s.limit.shape[1]
        if self._tilted:
            k, most = list(self._tilted), self._tilts.limit[None]
            # a tilt turns the thrust that its rotor has now
            pull = (s.gain * self._plant.layout.thrust_coefficient * drive * np.abs(drive))[:, k]
            bite = np.maximum(pull / self._tilts.slope, LEAST_PULL)
            more = {"gain": bite, "limit": most, "low": -most}
            bounds = {key: np.concatenate((x, more[key]), axis=1) for key, x in bounds.items()}
        found = self.allocation.commands(asked.wrench, s.centre, **bounds)
        return found[:, :count], found[:, count:]

    def _unaware(self, s: RobotState) -> RobotState:
        """Return the situation of a robot that takes its arms to be stowed."""
        rest = self._at_rest
        return s._replace(
            centre=rest.centre,
            centre_map=0.0 * rest.centre_map,
            momentum_map=0.0 * rest.momentum_map,
        )

    def _inner(self, s: RobotState, targets: Floats, inner: Inner) -> Inner:
        """Return the reaction of the joints' motion, predicted from their targets.

        Their measured motion would close a loop through the servos and shake the arm.
        """
        arm = inner.arm or Reckoned(s.joints, s.joint_velocity)
        if self._way[0] != s.step:
            self._way = s.step, way_of(self._servo_lag, s.step)
        arm = arm.next(targets, self._way[1], self.joint_speed, s.step)
        moved = (_turned(x, arm.rate) for x in (s.centre_map, s.momentum_map))
        both = namespace(arm.rate).concat((*moved, s.inertia.reshape(-1, 9)), axis=1)
        return Inner(arm, inner.moved.next(both, s.step, self.smoothing))

    def _force(self, s: RobotState, asked: Array, velocity: Array) -> Array:
        """Return the force the rotors shall make, drag at a velocity included, world axes [N]."""
        xp, force = namespace(asked), s.mass * asked
        if some(s.submersion > 0.0):
            carried = _unturned(s.rotation, asked) @ self._added.T
            through = _unturned(s.rotation, velocity)
            met = self._drag * xp.abs(through) * through
            force = force + s.submersion * _turned(s.rotation, carried + met)
        up = s.mass * self._g - s.buoyancy.force
        return xp.concat((force[:, :2], force[:, 2:3] + up), axis=1)

    def _torque(self, s: RobotState, want: Array, inner: Inner | None) -> Array:
        """Return the torque about the centre of gravity that the rotors shall make [N m]."""
        spin, torque = s.angular_velocity, _turned(s.inertia, want)
        if some(s.submersion > 0.0):
            torque = torque + s.submersion * (want @ self._added_turn.T)
        swirl = _turned(s.inertia, spin)
        if inner is not None:
            swirl = swirl + _turned(s.momentum_map, s.joint_velocity)
        torque = torque + cross(spin, swirl)
        if inner is not None:
            torque = torque + inner.moved.ahead(self.torque_lead, 3, 6)
            change = inner.moved.first.rate[:, 6:].reshape(-1, 3, 3)
            torque = torque + _turned(change, spin)
        if some(s.buoyancy.force > 0.0):
            up = s.buoyancy.force * s.rotation[:, 2, :]
            torque = torque - cross(s.buoyancy.centre - s.centre, up)
        return torque


class CascadeBatch:
    """A cascade over a batch of robots; see `BatchController`.

    Args:
        law: bound in the library of the batch.
        held: whether the joints are held; nothing is fed forward then.
    """

    def __init__(self, law: Cascade, *, held: bool) -> None:
        self._law, self.start = law, law.zero if held else law.start

    def command(
        self, situation: RobotState, aim: Reference, memory: HeldState | CascadeState
    ) -> tuple[Array, HeldState | CascadeState]:
        """Return speeds of the rotors, shape (B, n), and the new state."""
        s, law = situation, self._law
        if isinstance(memory, CascadeState):
            return law.moving(s, aim, memory)[::2]
        state = CascadeState(*memory)
        asked = law.asked(s, aim, None, state)
        wanted = asked.speeds
        if wanted is None:
            wanted = law.allocation.commands(asked.wrench, gain=s.gain, limit=s.limit, low=s.low)
        order, kept = law.ordered(s, wanted, asked, state)
        return order, HeldState(*kept[: len(memory)])


def _turned(matrix: Array, vector: Array) -> Array:
    """Products of matrices (1 or B, k, m) and vectors, shape (B, k)."""
    return namespace(vector).matmul(matrix, vector[:, :, None])[:, :, 0]


def _unturned(rotation: Array, vector: Array) -> Array:
    return namespace(rotation).matmul(vector[:, None, :], rotation)[:, 0, :]


def _shortened(vector: Array, longest: float) -> Array:
    """Return vectors limited to a length, shape (B, 3)."""
    xp = namespace(vector)
    length = xp.sqrt(xp.sum(vector * vector, axis=1, keepdims=True))
    one = length * 0.0 + 1.0
    return vector * xp.minimum(longest / xp.maximum(length, one * 1e-9), one)


def _refuse_unfit(plant: Plant) -> Fins:
    """Return the servos that tilt rotors; refuse robots without four rotors and servos.

    Raises:
        ConfigError: the robot has fewer, or different ones.
    """
    layout = plant.layout
    share = plant.gravity * float(plant.robot.mass.sum()) / max(layout.drives, 1)
    tilts = tilts_of(plant.robot, layout, share)
    upright = int(np.count_nonzero(layout.axis[:, 2] >= UPWARD))
    rotors = layout.kind.count(ROTOR)
    if upright + len(tilts.joints) < 4 or any(kind != ROTOR for kind in layout.kind):
        raise ConfigError(
            "controller=cascade needs four rotors that push upward (axes within 60 degrees of body "
            f"z), or fewer with servos that tilt them; robot '{plant.robot.name}' has "
            f"{f'{rotors} rotors, {upright} of them upright,' if rotors else 'no rotors'} and "
            f"{layout.drives - rotors or 'no'} thrusters.\n"
            "For thrusters in all directions: controller=station"
        )
    return tilts
