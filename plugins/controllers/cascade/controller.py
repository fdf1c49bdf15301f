"""Cascaded velocity and attitude control for vehicles that tilt to direct their thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.added import added_inertia, water_drag
from seals.control.allocation import LIFT_ROWS, Allocation
from seals.control.attitude import attitude_error, lean_for
from seals.control.filters import Lag, Rate, Trend, summed
from seals.control.fins import Fins, with_fins
from seals.control.limbs import Reckoned, joint_targets, servo_lag, stowed, way_of
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import ROTOR, UPWARD, lifting
from seals.control.protocols import Compiler
from seals.control.tilts import tilted_drives, tilts_of
from seals.errors import ConfigError
from seals.frames import cross3
from seals.plugins.controllers.cascade.batched import CascadeBatch, short
from seals.plugins.controllers.cascade.compiled import CompiledCascade, PackedState, packed
from seals.plugins.controllers.cascade.gains import CascadeSettings, Gains
from seals.state_records import state_record

UP = np.array([0.0, 0.0, 1.0])
WEIGHTS = np.array([0.02, 1.0, 1.0, 0.002])
"""Importance of lift, roll, pitch and yaw where the rotors cannot do it all."""
NEARLY = 1.0 - 1e-9
"""Share of a limit from which a drive counts as being at it: roots of squares round."""
SERVO_LAG = 0.05
"""Lag of joints that no servo drives [s]."""


LEAST_PULL = 0.2
"""Thrust of a tilted rotor, by its share of the weight, that a tilt counts on [1]."""


@state_record
class CascadeState(NamedTuple):
    """State of the cascade controller between calls; immutable.

    Args:
        sum: of the velocity error, world axes [m], shape (3,).
        turn_sum: of the attitude error, body axes [rad s], shape (3,).
        velocity: with its rate, world axes.
        inner: what the motion of the joints does.
        known: acceleration that is fed forward, with its rates, world axes.
        drive: states of the drives as reckoned [rad/s or N], shape (n,); None before the first.
        joints: targets of the joints [rad or m], shape (J,).
    """

    sum: Floats
    turn_sum: Floats
    velocity: Rate
    inner: Inner
    known: Trend
    drive: Floats | None
    joints: Floats


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
        wrench: lift, and torque about the centre of gravity [N, N m], shape (4,).
        error: of the velocity, world axes [m/s], shape (3,).
        turn_error: of the attitude, body axes [rad], shape (3,).
        gains: at this submersion.
        kept: the memory with what is known already.
    """

    wrench: Array
    error: Array
    turn_error: Array
    gains: Gains
    kept: CascadeState


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

    def bind(self, plant: Plant) -> None:
        """Find allocation, added mass and rest pose of the robot.

        Raises:
            ConfigError: the robot has fewer than four rotors that push upward.
        """
        plant = plant._replace(layout=lifting(plant.layout))
        layout = plant.layout
        self._tilts = refuse_unfit(plant)
        self._tilted = tilted_drives(plant.robot, layout, self._tilts)
        self._plant = plant
        self._g = plant.gravity
        self.allocation = Allocation(
            with_fins(layout, self._tilts) if self._tilted else layout,
            rows=LIFT_ROWS,
            saturation=self.saturation,
            weights=WEIGHTS,
        )
        if not self.allocation.full:
            raise ConfigError(
                f"controller=cascade: the drives of robot '{plant.robot.name}' do not command "
                "lift, roll, pitch and yaw independently.\n"
                "Look at position, axis, direction and coefficients of its rotors: "
                f"seals check robot={plant.robot.name}"
            )
        self._lag = Lag(layout.lag, layout.fall)
        self._added, self._drag = added_inertia(plant), water_drag(plant)
        self._rest = stowed(plant.robot)
        self._at_rest = MassPropertyEstimator(plant.robot).at(self._rest)
        self._servo_lag = servo_lag(plant, SERVO_LAG)
        self._way = 0.0, self._servo_lag
        self._media = self.gains(0), self.gains(1)
        self._rated = max(self.rate_gain) > 0.0
        self._compiled: CompiledCascade | None = None

    def batched(self, plant: Plant, joints: Floats, like: Array) -> CascadeBatch:
        """Return this law over a batch, see `ControllerOptions`.

        Raises:
            ConfigError: see `bind`; or the cascade has a gain on the rate of the velocity.
        """
        plant = plant._replace(layout=lifting(plant.layout))
        if refuse_unfit(plant).joints:
            raise ConfigError(
                f"a batch holds the joints of robot '{plant.robot.name}', and one tilts a rotor.\n"
                "Run it in a world: backend=pybullet"
            )
        return CascadeBatch(self, plant, joints, like, WEIGHTS)

    def start(self) -> CascadeState:
        """Return zero integrators; arms stowed, grippers open."""
        zero, flat = np.zeros(3), Trend.flat(3)
        inner = Inner(None, Trend.flat(15))
        return CascadeState(zero, zero, Rate(None, zero), inner, flat, None, self._rest)

    def command(
        self, situation: RobotState, aim: Reference, memory: CascadeState | PackedState
    ) -> tuple[ActuatorCommand, CascadeState | PackedState]:
        """Return speeds of the rotors and targets of the servos."""
        s = situation if self.cog_compensation else self._unaware(situation)
        joints, quick = joint_targets(aim, memory.joints, self._plant.robot), self._compiled
        if isinstance(memory, PackedState):
            if quick is not None:
                return quick.command(s, aim, joints, memory)
            memory = memory.unpacked(self._form())
        asked = self.asked(s, aim, joints, memory)
        wanted, tilts = self._allocated(s, asked.wrench, memory.drive)
        # tilts are no motion to feed forward: what they do is in the allocation
        targets = joints.copy()
        targets[list(self._tilts.joints)] = tilts
        order, kept = self.ordered(s, wanted, asked, memory)
        return ActuatorCommand(order, targets), kept if quick is None else packed(kept)

    def compile(self, compiled: Compiler | None) -> None:
        """Evaluate the law by machine code, for rotors that no servo tilts, or without."""
        fit = not self._tilted and not self._rated and self.allocation.plain
        if compiled is None or not fit:
            self._compiled = None
        else:
            self._compiled = CompiledCascade(self, self._form(), compiled)

    def _form(self) -> CascadeState:
        """Return a state after two calls, of any numbers."""
        rest, zero, moved = self._rest, np.zeros(3), self.start().inner
        still, both = np.zeros(self._plant.layout.drives), Rate(zero, zero)
        if rest.size:
            wide = Rate(np.zeros(15), np.zeros(15))
            moved = Inner(Reckoned(rest, rest), Trend(wide, wide))
        known = Trend(both, both)
        return CascadeState(zero, zero, Rate(None, zero), moved, known, still, rest)

    def asked(self, s: RobotState, aim: Reference, joints: Floats, memory: CascadeState) -> Asked:
        """Return the demand on the rotors; pure, on any array library."""
        gains = Gains.between(*self._media, s.submersion)
        inner = self._inner(s, joints, memory.inner)
        velocity = memory.velocity
        if self._rated:
            velocity = velocity.next(s.velocity, s.step, self.smoothing)
        ahead = aim.acceleration + s.rotation @ inner.moved.ahead(self.lean_lead, 0, 3)
        known = memory.known.next(ahead, s.step, self.smoothing)
        # turning about the centre of gravity moves the origin, but is not the rotors' to undo
        error = (
            self._wanted(s, aim, gains)
            - s.velocity
            - s.rotation @ cross3(s.angular_velocity, s.centre)
        )
        asked = ahead + gains.speed * error + gains.sum * memory.sum
        if self._rated:
            asked = asked + gains.rate * (aim.acceleration - velocity.rate)
        force = self._force(s, shortened(asked, self.acceleration), aim.velocity)
        lean = lean_for(force, aim.yaw, tilt=gains.tilt, least=gains.least * s.mass * self._g)
        turn_error = attitude_error(s.rotation, lean)
        turning = self._turning(s, lean[:, 2], known, aim.yaw_rate)
        want = turning[1] - gains.turn * turn_error - gains.spin * (s.angular_velocity - turning[0])
        torque = self._torque(s, want - gains.turn_sum * gains.shape * memory.turn_sum, inner)
        wrench = np.concatenate(((force @ s.rotation[:, 2]).reshape(1), torque))
        kept = memory._replace(velocity=velocity, inner=inner, known=known, joints=joints)
        return Asked(wrench, error, turn_error, gains, kept)

    def ordered(
        self, s: RobotState, wanted: Array, asked: Asked, memory: CascadeState
    ) -> tuple[Array, CascadeState]:
        """Return commands for wanted rotor speeds, and the new memory; pure."""
        drive = wanted if memory.drive is None else memory.drive
        order = self._lag.quickened(wanted, drive, self.quicker, (s.low, s.limit))
        both = (memory.sum, asked.error), (memory.turn_sum, asked.turn_error)
        limits = asked.gains.sum_limit, asked.gains.turn_sum_limit
        sums = [summed(*x, s.step, most) for x, most in zip(both, limits, strict=True)]
        # what the rotors cannot do is not summed up
        full = wanted >= NEARLY * s.limit
        if type(wanted) is not np.ndarray:
            xp = namespace(wanted)
            sums = [xp.where(xp.any(full), x[0], y) for x, y in zip(both, sums, strict=True)]
        elif np.count_nonzero(full):
            sums = [x[0] for x in both]
        after = self._lag.followed(drive, order, s.step)
        return order, asked.kept._replace(sum=sums[0], turn_sum=sums[1], drive=after)

    def _allocated(
        self, s: RobotState, asked: Floats, drive: Floats | None
    ) -> tuple[Floats, Floats]:
        """Return commands of the rotors, and angles of the servos that tilt some of them."""
        bounds = {"gain": s.gain, "limit": s.limit, "low": s.low}
        count = len(s.limit)
        if self._tilted:
            k, most = list(self._tilted), self._tilts.limit
            # a tilt turns the thrust that its rotor has now
            now = np.zeros(count) if drive is None else drive
            pull = (s.gain * self._plant.layout.thrust_coefficient * now * np.abs(now))[k]
            bite = np.maximum(pull / self._tilts.slope, LEAST_PULL)
            more = {"gain": bite, "limit": most, "low": -most}
            bounds = {key: np.concatenate((row, more[key])) for key, row in bounds.items()}
        found = self.allocation.commands(asked, s.centre, **bounds)
        return found[:count], found[count:]

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
        if not targets.size:
            return inner
        arm = inner.arm or Reckoned(s.joints, s.joint_velocity)
        if self._way[0] != s.step:
            self._way = s.step, way_of(self._servo_lag, s.step)
        arm = arm.next(targets, self._way[1], self.joint_speed, s.step)
        both = (s.centre_map @ arm.rate, s.momentum_map @ arm.rate, s.inertia.reshape(9))
        return Inner(arm, inner.moved.next(np.concatenate(both), s.step, self.smoothing))

    def _wanted(self, s: RobotState, aim: Reference, gains: Gains) -> Floats:
        if aim.position is None:
            return aim.velocity
        velocity: Floats = aim.velocity + gains.position * (aim.position - s.position)
        return velocity

    def _force(self, s: RobotState, asked: Floats, velocity: Floats) -> Floats:
        """Return the force the rotors shall make, drag at a velocity included, world axes [N]."""
        force = s.mass * asked
        if _some(s.submersion):
            carried = self._added[:3, :3] @ (asked @ s.rotation)
            through = velocity @ s.rotation
            met = self._drag * np.abs(through) * through
            force = force + s.submersion * (s.rotation @ (carried + met))
        found: Floats = force + UP * (s.mass * self._g - s.buoyancy.force)
        return found

    def _turning(
        self, s: RobotState, axis: Floats, known: Trend, yaw_rate: float
    ) -> tuple[Floats, Floats]:
        """Return spin and its rate that go with the lean, body axes [rad/s, rad/s^2].

        Only what is fed forward counts: the rate of a measured error is noise.
        """
        net = np.maximum(self._g - s.buoyancy.force / s.mass, 0.3 * self._g)
        first, second = (
            (cross3(axis, rate) / net) @ s.rotation
            for rate in (known.first.rate, known.second.rate)
        )
        return first + yaw_rate * (axis @ s.rotation), second

    def _torque(self, s: RobotState, want: Floats, inner: Inner) -> Floats:
        """Return the torque about the centre of gravity that the rotors shall make [N m]."""
        inertia = s.inertia
        if _some(s.submersion):
            inertia = inertia + s.submersion * self._added[3:, 3:]
        swirl = s.inertia @ s.angular_velocity
        if s.joints.size:
            swirl = swirl + s.momentum_map @ s.joint_velocity
        torque: Floats = inertia @ want + cross3(s.angular_velocity, swirl)
        if s.joints.size:
            torque = torque + inner.moved.ahead(self.torque_lead, 3, 6)
            torque = torque + inner.moved.first.rate[6:].reshape(3, 3) @ s.angular_velocity
        if _some(s.buoyancy.force):
            up = s.buoyancy.force * s.rotation[2]
            torque = torque - cross3(s.buoyancy.centre - s.centre, up)
        return torque


def _some(amount: Any) -> bool:
    """Return whether there is any of something; True for traced arrays."""
    return type(amount) is not float or amount > 0.0


def shortened(vector: Array, longest: float) -> Array:
    """Return a vector limited to the length ``longest``."""
    if type(vector) is not np.ndarray:
        return short(vector[None], longest)[0]
    length = math.sqrt(vector @ vector)
    return vector if length <= longest else vector * (longest / length)


def refuse_unfit(plant: Plant) -> Fins:
    """Return the servos that tilt rotors; refuse robots without four rotors and servos.

    Raises:
        ConfigError: the robot has fewer, or others.
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
