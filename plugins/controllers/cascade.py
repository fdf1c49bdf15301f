"""Velocity control over attitude control for vehicles that push along one axis and lean."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.config.fields import vector
from seals.control import Aim, Order, Plant, Situation
from seals.control.added import added_inertia
from seals.control.allocation import LIFT_ROWS, Allocation, Saturation
from seals.control.attitude import attitude_error, cross3, lean_for
from seals.control.filters import Rate, Trend, followed, quickened
from seals.control.gauge import MassGauge
from seals.control.limbs import Reckoned, joint_targets, servo_lag, stowed
from seals.control.plant import ROTOR
from seals.errors import ConfigError
from seals.schema import param

_RANGE = (0.0, 1e4)
WEIGHTS = np.array([0.05, 1.0, 1.0, 0.002])
"""Importance of lift, roll, pitch and yaw where the rotors cannot do it all."""


class Memory(NamedTuple):
    """What the cascade remembers; nothing in it is ever written to.

    Args:
        sum: of the velocity error, world axes [m], shape (3,).
        turn_sum: of the attitude error, body axes [rad s], shape (3,).
        velocity: with its rate, world axes.
        drift: of the centre of gravity by the joints, with its rates, body axes.
        momentum: of the joints, with its rates, body axes.
        known: acceleration that is fed forward, with its rate, world axes.
        drive: states of the drives as reckoned [rad/s or N], shape (n,).
        joints: targets of the joints [rad or m], shape (J,).
        arm: motion of the joints, as reckoned from their targets.
    """

    sum: Floats
    turn_sum: Floats
    velocity: Rate
    drift: Trend
    momentum: Trend
    known: Rate
    drive: Floats | None
    joints: Floats
    arm: Reckoned | None


class _Medium(NamedTuple):
    """Gains between those of air and of water, by submersion."""

    speed: float
    sum: float
    rate: float
    turn: Floats
    spin: Floats
    turn_sum: float
    least: float


@dataclass(kw_only=True)
class Cascade:
    """Velocity PID with gravity and acceleration fed forward, over geometric attitude control.

    Equation:
        F = M (a + k_p (v_ref - v) + k_i sum (v_ref - v) + k_d (a - v')) + m (g + c'') - buoyancy,
        M = m + s M_A; the robot leans so that its z axis lies along F.
        T = J (-k_R e_R - k_w (w - w_d) - k_I sum e_R) + w x (J w + h) + h' - buoyancy's torque,
        J with s times the added inertia, h and c'' the joints' momentum and the acceleration of
        the centre of gravity in the body by their motion. The rotors' speeds follow by the
        allocation about the live centre of gravity.

    Gains are divided by mass and inertia; two numbers are for air and for water, with submersion
    between them.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        cog_compensation: whether allocation and feed-forward follow the live centre of gravity;
            otherwise it is taken where it lies with the arms stowed.
        saturation: what gives way when the rotors cannot do all: ``paper`` or ``priority``.
        position_gain: of the error of a position that the aim gives [1/s].
        speed_gain: k_p of the velocity error [1/s].
        sum_gain: k_i of its sum [1/s^2].
        rate_gain: k_d of the acceleration's error [1].
        sum_limit: largest acceleration by that sum [m/s^2].
        turn_gain: k_R of roll and pitch [1/s^2].
        spin_gain: k_w of roll and pitch [1/s].
        yaw_gain: k_R of yaw [1/s^2].
        yaw_spin_gain: k_w of yaw [1/s].
        turn_sum_gain: k_I of the sum of the attitude's error [1/s^3].
        turn_sum_limit: largest angular acceleration by that sum [rad/s^2].
        tilt: largest lean [rad].
        acceleration: largest that is asked for [m/s^2].
        least: smallest upward force that counts for the lean, share of the weight [1].
        quicker: how many times faster than by their own lag the rotors are made to follow [1].
        smoothing: time constant of the rates that are fed forward [s].
        joint_speed: largest rate of a joint that is reckoned with [rad/s or m/s].
        lean_lead: how far ahead the acceleration of the centre of gravity is taken [s].
        torque_lead: how far ahead the rate of the joints' momentum is taken [s].

    Assumptions:
        All drives push along body z; the model of the robot is known, its load is not.

    Valid range:
        Leans below a right angle; under water, thrusts above those that point nowhere.

    Limitations:
        Drag is left to the sum of the error. A robot as heavy as its water cannot move sideways
        without rising.

    References:
        Mellinger and Kumar 2011 (doi 10.1109/ICRA.2011.5980409); Lee, Leok, McClamroch 2010, CDC.
    """

    rate: float = param(
        250.0, "Hz", bounds=(1.0, 1e4), tolerance=0.0, source="chosen: every step", fit=False
    )
    sense: str = "truth"
    cog_compensation: bool = True
    saturation: Saturation = Saturation.priority
    position_gain: list[float] = vector(
        (1.5, 0.8), "1/s", bounds=_RANGE, source="chosen: a third of the speed gain"
    )
    speed_gain: list[float] = vector(
        (4.5, 2.5), "1/s", bounds=_RANGE, source="chosen: a third of the lean's bandwidth"
    )
    sum_gain: list[float] = vector(
        (3.0, 1.5), "1/s^2", bounds=_RANGE, source="chosen: seven tenths of a second to settle"
    )
    rate_gain: list[float] = vector(
        (0.0, 0.0), "1", bounds=_RANGE, source="zero: the rate of a measured velocity is noise"
    )
    sum_limit: list[float] = vector(
        (3.0, 3.0), "m/s^2", bounds=_RANGE, source="chosen: a load of a third of the weight"
    )
    turn_gain: list[float] = vector(
        (140.0, 60.0), "1/s^2", bounds=_RANGE, source="chosen: 12 rad/s, above it rotors lag"
    )
    spin_gain: list[float] = vector(
        (20.0, 14.0), "1/s", bounds=_RANGE, source="chosen: damping ratio 0.85 and 0.9"
    )
    yaw_gain: list[float] = vector(
        (12.0, 6.0), "1/s^2", bounds=_RANGE, source="chosen: rotors have little torque in yaw"
    )
    yaw_spin_gain: list[float] = vector(
        (6.0, 4.0), "1/s", bounds=_RANGE, source="chosen: damping ratio 0.85"
    )
    turn_sum_gain: list[float] = vector(
        (80.0, 20.0), "1/s^3", bounds=_RANGE, source="chosen: slower than the lean by 20"
    )
    turn_sum_limit: list[float] = vector(
        (10.0, 10.0), "rad/s^2", bounds=_RANGE, source="chosen: arm of 3 cm in the dark"
    )
    tilt: float = param(
        0.6, "rad", bounds=(0.01, 1.5), tolerance=0.0, source="chosen: 35 degrees", fit=False
    )
    acceleration: float = param(
        6.0, "m/s^2", bounds=(0.1, 100.0), tolerance=0.0, source="chosen: half of g", fit=False
    )
    least: list[float] = vector(
        (0.3, 0.04), "1", bounds=_RANGE, source="chosen: below it the lean would flutter"
    )
    quicker: float = param(
        3.0, "1", bounds=(1.0, 20.0), tolerance=0.0, source="chosen: noise grows with it", fit=False
    )
    smoothing: float = param(
        0.015, "s", bounds=(0.0, 1.0), tolerance=0.0, source="chosen: four steps", fit=False
    )
    joint_speed: float = param(
        6.0, "rad/s", bounds=(0.0, 100.0), tolerance=0.0, source="hobby servos", fit=False
    )
    lean_lead: float = param(
        0.06,
        "s",
        bounds=(0.0, 0.5),
        tolerance=0.0,
        source="chosen: lag of the lean",
        fit=False,
    )
    torque_lead: float = param(
        0.0, "s", bounds=(0.0, 0.5), tolerance=0.0, source="zero: more excites the arm", fit=False
    )

    def bind(self, plant: Plant) -> None:
        """Find allocation, added mass and rest pose of the robot.

        Raises:
            ConfigError: the robot has fewer than four rotors, or one that does not push upward.
        """
        layout = plant.layout
        _refuse_unfit(plant)
        self._plant = plant
        self._allocation = Allocation(
            layout, rows=LIFT_ROWS, saturation=self.saturation, weights=WEIGHTS
        )
        self._added = added_inertia(plant)
        self._rest = stowed(plant.robot)
        self._at_rest = MassGauge(plant.robot).at(self._rest)
        self._servo_lag = servo_lag(plant, 0.05)

    def start(self) -> Memory:
        """Return zero sums; arms stowed, grippers open."""
        zero = np.zeros(3)
        none, flat = Rate(None, zero), Trend.flat(3)
        return Memory(zero, zero, none, flat, flat, none, None, self._rest, None)

    def command(self, situation: Situation, aim: Aim, memory: Memory) -> tuple[Order, Memory]:
        """Return speeds of the rotors and targets of the servos."""
        s = situation
        if not self.cog_compensation:
            fixed = self._at_rest
            s = s._replace(
                centre=fixed.centre,
                centre_map=0.0 * fixed.centre_map,
                momentum_map=0.0 * fixed.momentum_map,
            )
        gains = self._gains(s.submersion)
        smooth = self.smoothing
        velocity = memory.velocity.next(s.velocity, s.step, smooth)
        joints = joint_targets(aim, memory.joints, self._plant.robot)
        arm = memory.arm or Reckoned(s.joints, s.rates)
        arm = arm.next(joints, self._servo_lag, self.joint_speed, s.step)
        drift = memory.drift.next(s.centre_map @ arm.rate, s.step, smooth)
        momentum = memory.momentum.next(s.momentum_map @ arm.rate, s.step, smooth)
        inner = drift.ahead(self.lean_lead) + 2.0 * cross3(s.spin, s.centre_map @ s.rates)
        known = memory.known.next(aim.acceleration + s.rotation @ inner, s.step, smooth)
        error = self._wanted_velocity(s, aim) - s.velocity
        asked = known.value + gains.speed * error + gains.sum * memory.sum
        asked += gains.rate * (aim.acceleration - velocity.rate)
        force = self._force(s, _shortened(asked, self.acceleration))
        lean = lean_for(force, aim.yaw, tilt=self.tilt, least=gains.least * s.mass * self._g)
        turn_error = attitude_error(s.rotation, lean)
        spin = self._spin(s, lean, known.rate, aim.yaw_rate)
        torque = self._torque(s, gains, gains.turn_sum * memory.turn_sum, (turn_error, spin))
        torque = torque + momentum.ahead(self.torque_lead)
        wanted, free = self._allocated(s, float(force @ s.rotation[:, 2]), torque)
        drive = wanted if memory.drive is None else memory.drive
        layout = self._plant.layout
        bounds = (layout.low * (s.limit / layout.limit), s.limit)
        order = quickened(wanted, drive, layout.lag, self.quicker, bounds)
        kept = Memory(
            sum=self._summed(memory.sum, error, s, "sum") if free else memory.sum,
            turn_sum=self._summed(memory.turn_sum, turn_error, s, "turn_sum")
            if free
            else memory.turn_sum,
            velocity=velocity,
            drift=drift,
            momentum=momentum,
            known=known,
            drive=followed(drive, order, layout.lag, s.step),
            joints=joints,
            arm=arm,
        )
        return Order(order, joints), kept

    @property
    def _g(self) -> float:
        return self._plant.gravity

    def _wanted_velocity(self, s: Situation, aim: Aim) -> Floats:
        if aim.position is None:
            return aim.velocity
        air, water = self.position_gain
        gain = air + s.submersion * (water - air)
        wanted: Floats = aim.velocity + gain * (aim.position - s.position)
        return wanted

    def _force(self, s: Situation, asked: Floats) -> Floats:
        """Return the force the rotors shall make, world axes [N]."""
        force = s.mass * asked
        if s.submersion > 0.0:
            carried = self._added[:3, :3] @ (asked @ s.rotation)
            force = force + s.submersion * (s.rotation @ carried)
        force[2] += s.mass * self._g - s.buoyancy.force
        return force

    def _spin(self, s: Situation, lean: Floats, jerk: Floats, yaw_rate: float) -> Floats:
        """Return the angular velocity of the wanted attitude, body axes [rad/s].

        Only what is fed forward counts: the rate of a measured error is noise.
        """
        axis = lean[:, 2]
        net = max(self._g - s.buoyancy.force / s.mass, 0.3 * self._g)
        spin: Floats = (cross3(axis, jerk) / net + yaw_rate * axis) @ s.rotation
        return spin

    def _torque(
        self, s: Situation, gains: _Medium, summed: Floats, lean: tuple[Floats, Floats]
    ) -> Floats:
        """Return the torque about the centre of gravity that the rotors shall make [N m]."""
        error, spin = lean
        inertia = s.inertia + s.submersion * self._added[3:, 3:]
        want = -gains.turn * error - gains.spin * (s.spin - spin) - summed
        torque: Floats = inertia @ want + cross3(
            s.spin, s.inertia @ s.spin + s.momentum_map @ s.rates
        )
        if s.buoyancy.force > 0.0:
            up = s.buoyancy.force * s.rotation[2]
            torque = torque - cross3(s.buoyancy.centre - s.centre, up)
        return torque

    def _allocated(self, s: Situation, lift: float, torque: Floats) -> tuple[Floats, bool]:
        """Return the wanted states of the drives, and whether none of them is at its end."""
        low = self._plant.layout.low * (s.limit / self._plant.layout.limit)
        wrench = np.concatenate(((lift,), torque))
        wanted = self._allocation.commands(wrench, s.centre, gain=s.gain, limit=s.limit, low=low)
        return wanted, bool((wanted < s.limit).all())

    def _summed(self, total: Floats, error: Floats, s: Situation, name: str) -> Floats:
        """Return a sum after one more period, its effect held within its limit."""
        sign = 1.0
        gain = self._between(getattr(self, f"{name}_gain"), s.submersion)
        most = self._between(getattr(self, f"{name}_limit"), s.submersion)
        if gain <= 0.0:
            return total
        summed: Floats = np.clip(total + sign * s.step * error, -most / gain, most / gain)
        return summed

    def _gains(self, wet: float) -> _Medium:
        mid = {
            name: self._between(getattr(self, name), wet)
            for name in (
                "speed_gain",
                "sum_gain",
                "rate_gain",
                "turn_gain",
                "spin_gain",
                "yaw_gain",
                "yaw_spin_gain",
                "turn_sum_gain",
                "least",
            )
        }
        return _Medium(
            speed=mid["speed_gain"],
            sum=mid["sum_gain"],
            rate=mid["rate_gain"],
            turn=np.array([mid["turn_gain"], mid["turn_gain"], mid["yaw_gain"]]),
            spin=np.array([mid["spin_gain"], mid["spin_gain"], mid["yaw_spin_gain"]]),
            turn_sum=mid["turn_sum_gain"],
            least=mid["least"],
        )

    @staticmethod
    def _between(pair: list[float], wet: float) -> float:
        return pair[0] + wet * (pair[1] - pair[0])


def _shortened(vector: Floats, longest: float) -> Floats:
    length = math.sqrt(vector @ vector)
    return vector if length <= longest else vector * (longest / length)


def _refuse_unfit(plant: Plant) -> None:
    layout = plant.layout
    if layout.drives < 4 or any(kind != ROTOR for kind in layout.kind):
        raise ConfigError(
            f"controller=cascade needs four rotors or more; robot '{plant.robot.name}' has "
            f"{layout.kind.count(ROTOR)} and {layout.drives - layout.kind.count(ROTOR)} thrusters."
            "\nFor thrusters in all directions: controller=station"
        )
    if float(layout.axis[:, 2].min()) < 0.5:
        raise ConfigError(
            f"controller=cascade: a rotor of robot '{plant.robot.name}' does not push upward.\n"
            "Allowed: axes within 60 degrees of body z."
        )
