"""Autopilot of vehicles that steer: speed, heading and climb by thrusters and fins."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.added import model_wrench, water_drag
from seals.control.allocation import Saturation
from seals.control.attitude import attitude_error
from seals.control.axes import (
    HEAVE,
    PITCH,
    ROLL,
    SURGE,
    YAW,
    commanded_axes,
    mean_arm,
    wrench_matrix,
)
from seals.control.fins import fins_of, with_fins
from seals.control.limbs import joint_targets, stowed
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import Layout
from seals.control.protocols import of_one
from seals.field_roles import roles
from seals.frames import cross3
from seals.plugins.controllers.vehicle import VehicleController
from seals.schema import setting
from seals.state_records import state_record

STEERED = (SURGE, YAW, PITCH, ROLL)
"""Axes of a vehicle that steers, in the order in which they claim drives and fins."""
LIFTED = (SURGE, YAW, HEAVE)
"""Axes of thrusters alone: with heave among them the vehicle climbs level."""
NEEDED = (SURGE, YAW)


@state_record
class AutopilotState(NamedTuple):
    """State of the autopilot between calls; immutable.

    Args:
        speed_sum: of the speed error [m].
        climb_sum: of the error of the vertical velocity [m].
        turn_sum: of the attitude error, body axes [rad s], shape (3,).
        drive: states of the thrusters as reckoned, shape (n,); None before the first.
        joints: targets of the joints [rad or m], shape (J,).
    """

    speed_sum: float
    climb_sum: float
    turn_sum: Floats
    drive: Floats | None
    joints: Floats


@roles(data="sense priority")
@dataclass(kw_only=True)
class Autopilot(VehicleController):
    """Autopilots of speed, heading and depth for a vehicle that moves in the direction of its nose.

    The heading is that of the reference, the speed the size of its velocity, the climb that of its
    vertical part. Torques are made by thrusters and by fins: links under the effect ``lift`` that a
    servo turns. A vehicle whose thrusters command heave climbs level by them, also at rest, another
    by its pitch; without either, as on a boat, the climb is left out.

    Equation:
        F_x = m_x (k_p (U - u) + k_i sum) + D U abs(U), by thrusters F_z = m_z (k_v (w_ref - w) +
        k_s sum (w_ref - w)) + weight - buoyancy, or by its pitch angle theta = gamma + (k_c (w_ref
        - w) + k_z sum (w_ref - w)) / U within its limit, T = J (-k_R e_R - k_w (w - w_d) - k_I sum
        e_R) + w x J w - buoyancy's torque, but for what rights it in roll, + v x M_A v; fins by
        their lift at the speed, L = rho A_L u^2 d / 2.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        saturation: what gives way when the drives cannot do all: ``paper`` or ``priority``.
        priority: ranks of the axes with ``priority``; see `Station`.
        position_gain: of the error of a position that the aim gives [1/s].
        speed_gain: k_p of the speed [1/s].
        speed_sum_gain: k_i [1/s^2].
        speed_sum_limit: largest acceleration by that sum, and by that of the vertical velocity
            [m/s^2].
        heave_gain: k_v of the vertical velocity by thrusters [1/s].
        heave_sum_gain: k_s [1/s^2].
        climb_gain: k_c [1].
        climb_sum_gain: k_z [1/s].
        pitch_limit: largest pitch angle [rad].
        turn_gain: k_R [1/s^2].
        spin_gain: k_w [1/s].
        turn_sum_gain: k_I [1/s^3].
        turn_sum_limit: largest angular acceleration by that sum [rad/s^2].
        turn_limit: largest rate of turn that an attitude error asks for [rad/s].
        least_speed: below which fins are taken to meet this speed [m/s].
        quicker: how many times faster than by their own lag the thrusters are made to follow [1].

    Assumptions:
        The speed over ground is about that through the water; fins lie in the undisturbed flow.

    Valid range:
        Forward speeds above ``least_speed``; pitch angles below stall and 60 degrees.

    Limitations:
        It does not hold a place. Sway is passive, and heave without thrusters for it; sideslip in
        turns is left to the guide.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 15.
    """

    rate: float = setting(50.0, "Hz", bounds=(0.1, 1e4), source="chosen: every step")
    sense: str = "truth"
    saturation: Saturation = Saturation.priority
    priority: list[str] = field(default_factory=lambda: ["surge+heave+pitch+yaw", "roll"])
    position_gain: float = setting(
        0.2, "1/s", bounds=(0.0, 100.0), source="chosen: slower than pitch"
    )
    speed_gain: float = setting(1.0, "1/s", bounds=(0.0, 100.0), source="chosen: 1 s")
    speed_sum_gain: float = setting(0.2, "1/s^2", bounds=(0.0, 100.0), source="chosen: 5 s")
    speed_sum_limit: float = setting(1.0, "m/s^2", bounds=(0.0, 100.0), source="chosen: drag")
    heave_gain: float = setting(2.5, "1/s", bounds=(0.0, 100.0), source="chosen: as the station")
    heave_sum_gain: float = setting(
        1.0, "1/s^2", bounds=(0.0, 100.0), source="chosen: as the station"
    )
    climb_gain: float = setting(0.5, "1", bounds=(0.0, 10.0), source="chosen: mostly fed forward")
    climb_sum_gain: float = setting(0.3, "1/s", bounds=(0.0, 10.0), source="chosen: trim in 5 s")
    pitch_limit: float = setting(0.5, "rad", bounds=(0.0, 1.2), source="chosen: 29 degrees")
    turn_gain: float = setting(2.0, "1/s^2", bounds=(0.0, 1e4), source="chosen: 1.4 rad/s")
    spin_gain: float = setting(2.2, "1/s", bounds=(0.0, 1e3), source="chosen: damping ratio 0.8")
    turn_sum_gain: float = setting(0.05, "1/s^3", bounds=(0.0, 1e3), source="chosen: slow trim")
    turn_sum_limit: float = setting(
        0.3, "rad/s^2", bounds=(0.0, 1e3), source="chosen: half of fins"
    )
    turn_limit: float = setting(0.25, "rad/s", bounds=(1e-3, 100.0), source="chosen: fins stop it")
    least_speed: float = setting(0.3, "m/s", bounds=(1e-3, 50.0), source="chosen: no steerage way")
    quicker: float = setting(1.0, "1", bounds=(1.0, 20.0), source="chosen: as they are")

    def bind(self, plant: Plant) -> None:
        """Find fins, commanded axes and allocation of the robot.

        Raises:
            ConfigError: drives and fins do not command surge and yaw.
        """
        self._fins = fins_of(plant)
        layout = with_fins(plant.layout, self._fins)
        # the axes by rank; heave where the thrusters alone command it
        centre = MassPropertyEstimator(plant.robot).at(stowed(plant.robot)).centre
        matrix, arm = wrench_matrix(plant.layout, centre), mean_arm(plant.layout, centre)
        lifted = HEAVE in commanded_axes(matrix, arm, LIFTED)
        axes = self._allocate(plant, layout, (*STEERED, HEAVE) if lifted else STEERED, NEEDED)
        self._lifts = HEAVE in axes
        self._climbs = PITCH in axes and not self._lifts
        # where the error turns it at the largest rate
        self._most_error = self.turn_limit * self.spin_gain / max(self.turn_gain, 1e-9)
        self._drag = float(water_drag(plant)[0])

    def _unfit(self, layout: Layout, missing: str) -> str:
        """Return the refusal of a robot whose drives and fins do not command some axes."""
        return (
            f"controller=autopilot: {layout.drives} drives and fins of robot "
            f"'{self._plant.robot.name}' do not command {missing}.\n"
            "It needs a thruster along the vehicle, and a rudder (an upright link with the effect "
            "lift that a servo turns about its y axis) or a second thruster beside the first"
        )

    def start(self) -> AutopilotState:
        """Return zero integrators; fins straight, arms stowed."""
        return AutopilotState(0.0, 0.0, np.zeros(3), None, self._rest)

    def command(
        self, situation: RobotState, aim: Reference, memory: AutopilotState
    ) -> tuple[ActuatorCommand, AutopilotState]:
        """Return forces of the thrusters and targets of the servos, fins among them."""
        s = situation
        velocity = self._wanted_velocity(s, aim)
        flat = velocity[:2] if self._lifts else velocity
        speed = math.sqrt(flat @ flat)
        ahead = float(s.velocity @ s.rotation[:, 0])
        climbing = float(velocity[2] - s.velocity[2])
        pitch, climb_sum = self._pitch(velocity, climbing, speed, memory.climb_sum, s.step)
        error = self._turned * attitude_error(s.rotation, _nose(aim.yaw, pitch))
        near = np.abs(error) <= self._most_error
        error = np.minimum(np.maximum(error, -self._most_error), self._most_error)
        want = -self.turn_gain * error - self.turn_sum_gain * memory.turn_sum
        want = want - self.spin_gain * (s.angular_velocity - aim.yaw_rate * s.rotation[2])
        push = self.speed_gain * (speed - ahead) + self.speed_sum_gain * memory.speed_sum
        along = np.array([push, 0.0, 0.0])
        if self._lifts:
            rise = self.heave_gain * climbing + self.heave_sum_gain * memory.climb_sum
            along = along + rise * s.rotation[2]
        one, _ = of_one(s, aim)
        found = model_wrench(one, along[None], want[None], added=self._added, gravity=self._g)
        wrench: Floats = found[0]
        wrench[SURGE] += s.submersion * self._drag * speed * abs(speed)
        # what rights it in roll is left to act: nothing else holds it where fins saturate
        lever = max(float(s.buoyancy.centre[2] - s.centre[2]), 0.0)
        wrench[ROLL] -= lever * s.buoyancy.force * float(s.rotation[2, 1])
        # the Munk moment of added mass turns a slender body broadside
        through = s.velocity @ s.rotation
        wrench[3:] += s.submersion * cross3(through, self._added[:3, :3] @ through)
        # thrusters, then fins, with their lower and upper limits
        bite = np.full(len(self._fins.joints), max(ahead, self.least_speed) ** 2)
        low = np.concatenate((s.low, -self._fins.limit))
        limit = np.concatenate((s.limit, self._fins.limit))
        wanted = self._allocation.commands(
            wrench[self._rows],
            s.centre,
            gain=np.concatenate((s.gain, bite)),
            limit=limit,
            low=low,
        )
        count = self._plant.layout.drives
        order, after = self._quickened(s, wanted[:count], memory.drive)
        joints = joint_targets(aim, memory.joints, self._plant.robot).copy()
        joints[list(self._fins.joints)] = wanted[count:]
        speed_sum, turn_sum = memory.speed_sum, memory.turn_sum
        if bool(((wanted > low) & (wanted < limit)).all()):
            # what the drives cannot do is not summed up
            most = self.speed_sum_limit / max(self.speed_sum_gain, 1e-9)
            speed_sum = min(max(speed_sum + s.step * (speed - ahead), -most), most)
            turn_sum = self._turn_summed(turn_sum, np.where(near, error, 0.0), s.step)
            if self._lifts:
                most = self.speed_sum_limit / max(self.heave_sum_gain, 1e-9)
                climb_sum = min(max(climb_sum + s.step * climbing, -most), most)
        return ActuatorCommand(order, joints), AutopilotState(
            speed_sum, climb_sum, turn_sum, after, joints
        )

    def _pitch(
        self, velocity: Floats, climbing: float, speed: float, sum_: float, step: float
    ) -> tuple[float, float]:
        """Return the wanted pitch angle, nose up [rad], and the new integral of the climb error."""
        if not self._climbs:
            return 0.0, sum_
        climb = math.atan2(float(velocity[2]), math.hypot(float(velocity[0]), float(velocity[1])))
        per = 1.0 / max(speed, self.least_speed)
        pitch = climb + per * (self.climb_gain * climbing + self.climb_sum_gain * sum_)
        if abs(pitch) >= self.pitch_limit:
            return math.copysign(self.pitch_limit, pitch), sum_
        return pitch, sum_ + step * climbing


def _nose(yaw: float, pitch: float) -> Floats:
    """Attitude with the nose at a heading and an angle above the horizon, shape (3, 3)."""
    c, s, u, w = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    return np.array([[c * u, -s, -c * w], [s * u, c, -s * w], [w, 0.0, u]])
