"""One robot in free motion: poses, equations of motion, half-step velocities."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import BodyOptions, Configuration, Dynamics, LinkPoses
from seals.coupling import HalfStep, drive_over
from seals.environment.ground import ground_height
from seals.environment.settings import EnvironmentSettings
from seals.errors import PhysicsError
from seals.frames import exponential, matrix_of, multiply, normalised
from seals.multibody.equations import Assembly
from seals.multibody.linear import solved
from seals.multibody.servo import driven, heavier
from seals.multibody.tree import forward
from seals.robot.model import RobotModel
from seals.state_records import state_record


@state_record
class State(NamedTuple):
    """State of a robot in free motion.

    Args:
        position: base origin, world [m], shape (3,).
        quaternion: q_WB_xyzw, shape (4,).
        joints: [rad or m], shape (J,).
        speed: generalised velocity, shape (n,).
        change: generalised acceleration of the last step, shape (n,); None after a start.
    """

    position: Floats
    quaternion: Floats
    joints: Floats
    speed: HalfStep
    change: Floats | None = None


STRAY = 0.05
"""Way beyond a joint's limit that a servo may overshoot [rad or m]; more needs a stop."""


class FreeBody(BodyOptions):
    """Robot in free motion; joint drives are integrated implicitly.

    Args:
        robot: the robot.
        ground: surroundings whose ground it must not reach; None to let it through.
    """

    implicit: ClassVar[bool] = True

    def __init__(self, robot: RobotModel, *, ground: EnvironmentSettings | None) -> None:
        self.robot, self._ground = robot, ground
        self._lead = 0 if robot.tree.fixed_base else 6
        self._assembly = Assembly(robot.spatial_inertia[None])
        self._untouched = np.zeros((len(robot.links), 6)), np.zeros(len(robot.links))
        for zeros in self._untouched:
            zeros.setflags(write=False)
        upright = np.array([0.0, 0.0, 0.0, 1.0])
        joints = np.zeros(robot.tree.joints)
        self._state = State(np.zeros(3), upright, joints, HalfStep(np.zeros(robot.degrees)))
        self._poses: tuple[Floats, Floats] | None = None
        self._change = np.zeros(robot.degrees)
        self._limits = robot.lower - STRAY, robot.upper + STRAY

    def reset(self, configuration: Configuration) -> None:
        """Set the state of the robot and clear the memory of earlier steps."""
        c = Configuration(*(np.array(x, dtype=float) for x in configuration))
        speed = (
            np.concatenate([c.velocity, c.angular_velocity, c.joint_velocity])
            if self._lead
            else c.joint_velocity
        )
        self._set(State(c.position, c.quaternion, c.joints, HalfStep(speed)))

    def _set(self, state: State) -> None:
        self._state, self._poses = state, None

    def snapshot(self) -> State:
        """Return the state, which is immutable."""
        return self._state

    def restore(self, kept: State) -> None:
        """Restore a state."""
        self._set(kept)

    def read(self) -> Configuration:
        """Return pose, velocity and joint state of the robot."""
        s = self._state
        still = np.zeros(3)
        now = s.speed.now
        linear, spin = (now[:3], now[3:6]) if self._lead else (still, still)
        return Configuration(s.position, s.quaternion, linear, spin, s.joints, now[self._lead :])

    def poses(self) -> LinkPoses:
        """Return the poses of all links and the generalised velocity."""
        s = self._state
        if self._poses is None:
            turn = matrix_of(s.quaternion[None])
            self._poses = forward(self.robot.tree, s.position[None], turn, s.joints[None])
        return LinkPoses(*self._poses, s.speed.now[None])

    def mean_speed(self) -> Floats:
        """Return the generalised velocity with which the pose moved in the last step, (n,)."""
        return self._state.speed.way

    def middle_speed(self) -> Floats | None:
        """Return the generalised velocity at the middle of the last step, shape (1, n), or None."""
        middle = self._state.speed.middle
        return None if middle is None else middle[None]

    def joint_positions(self) -> Floats:
        """Return the joint coordinates [rad or m], shape (J,)."""
        return self._state.joints

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Compute the generalised acceleration of the next step."""
        last = self._state.change
        last = None if last is None else last[self._lead :]
        d, acting = drive_over(dynamics, step, last)
        total = self._assembly.total_inertia(d.found, 1)
        bias = d.kinematics.bias(d.moving)
        terms = self._assembly.velocity_terms(d.motion, d.found)
        load = d.wrench - terms - np.matmul(total, bias[:, :, :, None])[:, :, :, 0]
        matrix, right = self._assembly.system(d.kinematics, total, load, d.joint_force)
        if acting is None:
            self._change = solved(matrix[0], right[0])
        else:
            matrix = heavier(matrix, acting.armature[None])
            self._change = driven(matrix, right, acting.drive, acting.gain)[0][0]

    def advance(self, step: float) -> None:
        """Advance by one step.

        Raises:
            PhysicsError: the motion is not finite, or the robot has reached the ground.
        """
        s, change = self._state, self._change
        speed = s.speed.kicked(step * change)
        middle = speed.middle
        assert middle is not None
        if not np.isfinite(speed.now).all():
            raise PhysicsError(
                f"the motion of robot '{self.robot.name}' is not finite.\n"
                "Take a smaller time.step, or check forces and masses."
            )
        position, quaternion = s.position, s.quaternion
        if self._lead:
            position = position + step * middle[:3]
            turned = multiply(exponential(step * middle[None, 3:6]), quaternion[None])
            quaternion = normalised(turned)[0]
        joints = s.joints + step * middle[self._lead :]
        self._set(State(position, quaternion, joints, speed, change))
        if self._ground is not None:
            x, y, z = self._state.position.tolist()
            height = ground_height(self._ground, x, y)
            if height is not None and z < height:
                raise PhysicsError(
                    f"robot '{self.robot.name}' has reached the ground at {height:g} m, and "
                    "backend=free has no contacts.\n"
                    "Use backend=pybullet or backend=mujoco, or ignore the ground: "
                    "backend.passable=true"
                )
            lower, upper = self._limits
            beyond = np.flatnonzero((joints < lower) | (joints > upper))
            if beyond.size:
                k = int(beyond[0])
                limits = f"{self.robot.lower[k]:g} to {self.robot.upper[k]:g}"
                raise PhysicsError(
                    f"joint '{self.robot.joints[k]}' of robot '{self.robot.name}' has left its "
                    f"range of {limits}, and backend=free has no stops.\n"
                    "Use backend=pybullet or backend=mujoco, or ignore the stops: "
                    "backend.passable=true"
                )

    def contact_wrenches(self) -> Floats:
        """Return zeros: nothing touches, shape (L, 6)."""
        return self._untouched[0]

    def contact_normals(self) -> Floats:
        """Return zeros, shape (L,)."""
        return self._untouched[1]
