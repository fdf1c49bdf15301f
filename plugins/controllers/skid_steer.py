"""Controller of vehicles on driven wheels, which may swim as well."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import joint_targets, stowed
from seals.control.wheels import wheels_of
from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.plugins.controllers.autopilot import Autopilot, AutopilotState
from seals.schema import setting

_AFLOAT = 0.5
"""Share of the displacement at rest afloat from which the thrusters act [1]."""


@roles(data="sense priority")
@dataclass(kw_only=True)
class SkidSteer(Autopilot):
    """Speed and heading of a vehicle on wheels; afloat by thrusters, as the autopilot.

    Wheels on both sides turn at speeds of their own (differential or skid steering). The vehicle
    moves along its nose only: it turns toward the heading of the reference and drives at the part
    of its velocity that lies along its nose, backwards where that is negative. A vehicle with
    thrusters uses them, by the law of `Autopilot`, while it displaces half of its weight in water;
    its wheels turn on, so that they grip where it comes ashore.

    Equation:
        w_i = (u - r t y_i) / R_i, u = v_ref . x, r = r_ref + clip(k_R / k_w (yaw_ref - yaw),
        -turn_limit, turn_limit), t the track factor; all w_i lowered alike where one is too fast.

    Args:
        speed_limit: largest speed on wheels [m/s].
        track: t, effective over true distance of the wheels from the middle [1]: 1 for two wheels
            and casters, more for skid steering, where wheels slip sideways in turns.
        rate: the other fields are those of `Autopilot`; on wheels they give the heading's gain.

    Assumptions:
        Wheels grip: they roll without slipping ahead.

    Valid range:
        Level ground and slopes below the angle of friction.

    Limitations:
        It does not hold a place to its side. What slips is corrected by the heading alone.

    References:
        Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics: Modelling, Planning and Control,
        ch. 11.2 (unicycle and differential drive); Mandow et al. 2007, IROS,
        doi:10.1109/IROS.2007.4399139 (skid steering).

    Example:
        >>> SkidSteer(speed_limit=0.22).track
        1.0
    """

    speed_limit: float = setting(
        10.0, "m/s", bounds=(1e-3, 50.0), source="chosen: no-load speeds of the wheels limit it"
    )
    track: float = setting(1.0, "1", bounds=(0.1, 10.0), source="chosen: no slip")

    def bind(self, plant: Plant) -> None:
        """Find wheels, and thrusters with the axes that they command.

        Raises:
            ConfigError: no wheels are driven, or thrusters do not command surge and yaw.
        """
        self._wheels = wheels_of(plant)
        if not self._wheels.joints:
            raise ConfigError(
                f"controller=skid_steer: no wheels of robot '{plant.robot.name}' are driven.\n"
                "Give it motors: +actuator@actuators.wheels=wheels actuators.wheels.wheels=[1,2] "
                "(numbers of joints); for a vehicle without wheels: controller=autopilot"
            )
        self._plant, self._rest = plant, stowed(plant.robot)
        self._swims = plant.layout.drives > 0
        self._share = math.inf
        if self._swims:
            super().bind(plant)
            volume = sum(h.volume for h in plant.robot.hulls if h is not None)
            density = plant.environment.water_density or FRESH_WATER
            if volume > 0.0:
                self._share = _AFLOAT * float(plant.robot.mass.sum()) / (density * volume)

    def command(
        self, situation: RobotState, aim: Reference, memory: AutopilotState
    ) -> tuple[ActuatorCommand, AutopilotState]:
        """Return forces of the thrusters, speeds of the wheels and targets of the servos."""
        s, drives = situation, np.zeros(self._plant.layout.drives)
        if self._swims and s.submersion > self._share:
            order, memory = super().command(s, aim, memory)
            drives, joints = order.drive, order.joints.copy()
        else:
            joints = joint_targets(aim, memory.joints, self._plant.robot).copy()
            memory = self.start()
        ahead = float(self._wanted_velocity(s, aim) @ s.rotation[:, 0])
        ahead = min(max(ahead, -self.speed_limit), self.speed_limit)
        off = math.remainder(aim.yaw - s.yaw, 2.0 * math.pi)
        turn = off * self.turn_gain / max(self.spin_gain, 1e-9)
        turn = aim.yaw_rate + min(max(turn, -self.turn_limit), self.turn_limit)
        joints[list(self._wheels.joints)] = self._wheels.speeds(ahead, self.track * turn)
        return ActuatorCommand(drives, joints), memory._replace(joints=joints)
