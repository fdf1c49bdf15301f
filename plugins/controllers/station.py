"""Station keeping of vehicles with thrusters; roll and pitch may be passive."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.added import model_wrench
from seals.control.allocation import Allocation, Saturation
from seals.control.attitude import attitude_error, lean_for
from seals.control.axes import HEAVE, STATION_ORDER, SURGE, YAW
from seals.control.filters import summed
from seals.control.limbs import joint_targets
from seals.control.plant import Layout
from seals.control.protocols import CommandLaw, Compiler, of_one
from seals.environment.seawater import FRESH_WATER
from seals.field_roles import roles
from seals.frames import rotate, unrotate
from seals.plugins.controllers.compiled_law import CompiledController, PackedState, packed
from seals.plugins.controllers.vehicle import VehicleController
from seals.schema import setting
from seals.state_records import state_record

NEEDED = (SURGE, HEAVE, YAW)
"""Axes without which a vehicle cannot hold its depth, heading and distance ahead; what floats needs
no heave."""


@state_record
class StationState(NamedTuple):
    """State of the station-keeping controller; immutable. One robot is a batch of one.

    Args:
        sum: of the velocity error, world axes [m], shape (B, 3).
        turn_sum: of the attitude error, body axes [rad s], shape (B, 3).
        drive: states of the thrusters as reckoned [N], shape (B, n).
        fresh: 1 before the first call, when the thrusters are taken to be where they are wanted.
        joints: targets of the joints [rad or m], shape (J,); None if they are not its own.
    """

    sum: Array
    turn_sum: Array
    drive: Array
    fresh: Array
    joints: Floats | None = None


class StationDemand(NamedTuple):
    """Demand on the thrusters.

    Args:
        wrench: the commanded rows, torque about the centre of gravity [N, N m], shape (B, rows).
        error: of the velocity, world axes [m/s], shape (B, 3).
        turn_error: of the attitude, body axes [rad], shape (B, 3).
        speeds: None, see `seals.plugins.controllers.compiled_law.Demand`.
    """

    wrench: Array
    error: Array
    turn_error: Array
    speeds: Array | None = None


_AFLOAT = 1.1
"""Displacement of the whole hulls, over the mass, from which a vehicle is a boat."""


@roles(data="sense priority")
@dataclass(kw_only=True)
class Station(VehicleController):
    """Velocity and attitude control with forces in every direction; the vehicle stays level.

    Axes that the thrusters cannot command are passive: a vehicle of four to eight thrusters is
    flown in surge, sway, heave and yaw, and its roll and pitch are left to the buoyancy. Without
    sway it holds depth and heading, and its place along its own nose only. Without heave a boat is
    held in its place on the surface, and heave is left to the buoyancy as well.

    Equation:
        F = M (a + k_p (v_ref - v) + k_i sum) + weight - buoyancy, T = J (-k_R e_R - k_w (w - w_d)
        - k_I sum e_R) + w x J w - buoyancy's torque, M and J with s times the added inertia. Of
        (F, T) the commanded rows are allocated, B f = tau.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        saturation: what gives way when the thrusters cannot do all: ``paper`` or ``priority``.
        priority: ranks of the axes with ``priority``, the first gives way last; ``+`` joins axes of
            one rank.
        position_gain: of the error of a position that the aim gives [1/s].
        speed_gain: k_p of the velocity error [1/s].
        sum_gain: k_i of its sum [1/s^2].
        sum_limit: largest acceleration by that sum [m/s^2].
        turn_gain: k_R [1/s^2].
        spin_gain: k_w [1/s].
        turn_sum_gain: k_I [1/s^3].
        turn_sum_limit: largest angular acceleration by that sum [rad/s^2].
        quicker: how many times faster than by their own lag the thrusters are made to follow [1].

    Assumptions:
        The drives command surge, yaw and, unless it floats, heave; a passive roll or pitch rights
        itself. The model of the robot is known, its load is not.

    Valid range:
        Submerged vehicles and boats, which displace a tenth more than they weigh, at speeds that
        the thrusters hold against the drag.

    Limitations:
        Roll and pitch are held at zero or passive; drag is left to the sum of the error.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 12.
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")
    sense: str = "truth"
    saturation: Saturation = Saturation.priority
    priority: list[str] = field(
        default_factory=lambda: ["roll+pitch", "yaw", "heave", "surge+sway"]
    )
    position_gain: float = setting(
        0.8, "1/s", bounds=(0.0, 100.0), source="chosen: below the speed's"
    )
    speed_gain: float = setting(
        2.5, "1/s", bounds=(0.0, 100.0), source="chosen: thrusters lag 0.1 s"
    )
    sum_gain: float = setting(1.0, "1/s^2", bounds=(0.0, 100.0), source="chosen: 2.5 s to settle")
    sum_limit: float = setting(2.0, "m/s^2", bounds=(0.0, 100.0), source="chosen: drag at 1 m/s")
    turn_gain: float = setting(9.0, "1/s^2", bounds=(0.0, 1e4), source="chosen: 3 rad/s")
    spin_gain: float = setting(5.0, "1/s", bounds=(0.0, 1e3), source="chosen: damping ratio 0.83")
    turn_sum_gain: float = setting(3.0, "1/s^3", bounds=(0.0, 1e3), source="chosen: 3 s to settle")
    turn_sum_limit: float = setting(3.0, "rad/s^2", bounds=(0.0, 1e3), source="chosen")
    quicker: float = setting(2.0, "1", bounds=(1.0, 20.0), source="chosen: noise grows with it")

    def bind(self, plant: Plant) -> None:
        """Find the commanded axes, allocation, added mass and rest pose of the robot.

        Raises:
            ConfigError: the drives do not command surge, yaw and, unless it floats, heave.
        """
        self._bind(plant, np.zeros(1))

    def _bind(self, plant: Plant, like: Array, joints: Floats | None = None) -> None:
        """Prepare the law in the library of an array; for held joints, or for those that move."""
        self._held = joints is not None
        robot = plant.robot
        displaced = FRESH_WATER * sum(h.volume for h in robot.hulls if h is not None)
        # a submerged vehicle may be trimmed a little light: it is no boat
        floats = displaced > _AFLOAT * float(robot.mass.sum())
        needed = [k for k in NEEDED if k != HEAVE or not floats]
        self._allocate(plant, plant.layout, STATION_ORDER, needed, like=like, joints=joints)
        self._like = like
        self._compiled: CompiledController | None = None
        self._up, self._level = as_like([[0.0, 0.0, 1.0]], like), as_like([[0.1]], like)

    def _unfit(self, layout: Layout, missing: str) -> str:
        """Return the refusal of a robot whose drives do not command some axes."""
        return (
            f"controller=station: the {layout.drives} drives of robot '{self._plant.robot.name}' "
            f"do not command {missing}.\n"
            "It needs surge, yaw, usually sway and, unless the vehicle floats, heave; for a "
            "vehicle "
            "that steers: controller=autopilot guide=los; for rotors that push upward: "
            "controller=cascade"
        )

    def batched(self, plant: Plant, joints: Floats | None, like: Array) -> StationBatch:
        """Return this law over a batch, see `ControllerOptions`.

        Raises:
            ConfigError: see `bind`.
        """
        law = copy.copy(self)
        law._bind(plant, like, joints)
        return StationBatch(law)

    def start(self) -> StationState:
        """Return zero integrators; arms stowed, grippers open."""
        return self.zero(1)._replace(joints=self._rest)

    def zero(self, batch: int) -> StationState:
        """Return zero integrators of B robots."""
        zero = as_like(np.zeros((batch, 3)), self._like)
        drive = as_like(np.zeros((batch, self._plant.layout.drives)), self._like)
        return StationState(zero, zero, drive, drive[:, 0:1] + 1.0)

    def command(
        self, situation: RobotState, aim: Reference, memory: StationState | PackedState
    ) -> tuple[ActuatorCommand, StationState | PackedState]:
        """Return forces of the thrusters and targets of the servos."""
        quick = self._compiled
        last = self._rest if memory.joints is None else memory.joints
        joints = joint_targets(aim, last, self._plant.robot)
        if isinstance(memory, PackedState):
            if quick is not None:
                return quick.command(situation, aim, joints, memory)
            memory = memory.unpacked(self.start())
        order, kept = self.moving(*of_one(situation, aim), memory)
        kept = kept._replace(joints=joints)
        return ActuatorCommand(order[0], joints), kept if quick is None else packed(kept)

    def compile(self, compiled: Compiler | None) -> None:
        """Evaluate the law by machine code, where the thrusters command all axes apart."""
        self._compiled = None
        if compiled is not None and self.saturation is Saturation.priority and self.allocation.full:
            self._compiled = CompiledController(self, self.start(), compiled)

    def command_law(self, period: float, memory: Any, aim: Reference) -> CommandLaw | None:
        """Return its law where there is machine code, after the first call."""
        if self._compiled is None or not isinstance(memory, PackedState):
            return None
        return self._compiled.law(period, aim)

    @property
    def allocation(self) -> Allocation:
        """Allocation of the commanded axes."""
        return self._allocation

    def moving(
        self, s: RobotState, aim: Reference, memory: StationState
    ) -> tuple[Array, StationState]:
        """Return forces of the thrusters, (B, n), and memory; pure, on any array library."""
        asked = self.asked(s, aim, memory.joints, memory)
        wanted = self._allocation.commands(
            asked.wrench,
            None if self._held else s.centre,
            gain=s.gain,
            limit=s.limit,
            low=s.low,
        )
        return self.ordered(s, wanted, asked, memory)

    def asked(
        self, s: RobotState, aim: Reference, joints: Array | None, memory: StationState
    ) -> StationDemand:
        """Return the demand on the thrusters; pure, on any array library."""
        error = self._wanted_velocity(s, aim) - s.velocity
        asked = aim.acceleration + self.speed_gain * error + self.sum_gain * memory.sum
        up = self._up + 0.0 * s.velocity
        level = lean_for(up, aim.yaw, tilt=self._level, least=self._up[:, 2:])
        turn_error = self._turned * attitude_error(s.rotation, level)
        spin = aim.yaw_rate * s.rotation[:, 2, :]
        want = -self.turn_gain * turn_error - self.spin_gain * (s.angular_velocity - spin)
        want = want - self.turn_sum_gain * memory.turn_sum
        along = unrotate(s.rotation, asked)
        wrench = model_wrench(s, along, want, added=self._added, gravity=self._g)
        return StationDemand(wrench[:, self._rows], error, turn_error)

    def ordered(
        self, s: RobotState, wanted: Array, asked: StationDemand, memory: StationState
    ) -> tuple[Array, StationState]:
        """Return commands for forces that were allocated, and the new memory; pure, as `asked`."""
        xp, (_, error, turn_error, _) = namespace(wanted), asked
        drive = xp.where(memory.fresh > 0.5, wanted, memory.drive)
        order, after = self._quickened(s, wanted, drive)
        # what a passive axis leaves is not summed up
        within = rotate(s.rotation, self._pushed * unrotate(s.rotation, error))
        total = summed(memory.sum, within, s.step, self.sum_limit / max(self.sum_gain, 1e-9))
        turn_total = self._turn_summed(memory.turn_sum, turn_error, s.step)
        free = xp.all(xp.abs(wanted) < s.limit, axis=1)[:, None]
        return order, memory._replace(
            sum=xp.where(free, total, memory.sum),
            turn_sum=xp.where(free, turn_total, memory.turn_sum),
            drive=after,
            fresh=memory.fresh * 0.0,
        )


class StationBatch:
    """A station-keeping law over a batch of robots; see `BatchController`.

    Args:
        law: bound in the library of the batch.
    """

    def __init__(self, law: Station) -> None:
        self.start, self.command = law.zero, law.moving
