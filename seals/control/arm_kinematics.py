"""Resolved-rate inverse kinematics of an arm: from the tool's velocity to the joints' rates."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.control.attitude import cross3
from seals.errors import PhysicsError
from seals.robot.limbs import Arm
from seals.robot.model import RobotModel

DAMPING = 0.02
"""Lever below which a direction counts as out of reach: rates stay bounded there [m]."""


class ArmKinematics:
    """Poses and rates of one arm's tool.

    Equation:
        q' = J^T (J J^T + d^2 I)^-1 x'; a joint that would leave its range stops there, and the
        others share what it leaves.

    Args:
        robot: the robot.
        arm: one of its arms.
        point: of the tool that is led, in the tool's link axes [m].
        damping: d [m].
        speed: largest rate of a joint [rad/s or m/s].
    """

    def __init__(
        self,
        robot: RobotModel,
        arm: Arm,
        *,
        point: tuple[float, float, float] = (0.0, 0.0, 0.0),
        damping: float = DAMPING,
        speed: float = 3.0,
    ) -> None:
        """Find the chain from the base to the tool."""
        self._tree, self.arm = robot.tree, arm
        self._point, self._damping, self._speed = np.asarray(point), damping, speed
        index = list(arm.joints)
        self.lower, self.upper = robot.lower[index], robot.upper[index]
        chain = [arm.tool]
        while robot.tree.parent[chain[-1]] >= 0:
            chain.append(robot.tree.parent[chain[-1]])
        self._chain = chain[-2::-1]
        self._column = {joint: k for k, joint in enumerate(arm.joints)}

    def tool(self, joints: Floats) -> tuple[Floats, Floats]:
        """Return position [m] and Jacobian [m/rad] of the tool's point, body axes.

        Args:
            joints: of the whole robot [rad or m], shape (J,).

        Returns:
            Position, shape (3,), and Jacobian by the arm's joints, shape (3, k).
        """
        tree, place, turn = self._tree, np.zeros(3), np.eye(3)
        axes: list[tuple[int, bool, Floats, Floats]] = []
        for link in self._chain:
            place = place + turn @ tree.origin[link]
            turn = turn @ tree.rotation[link]
            j = tree.joint[link]
            if j < 0:
                continue
            axis = turn @ tree.axis[j]
            if j in self._column:
                axes.append((self._column[j], tree.prismatic[j], axis, place))
            if tree.prismatic[j]:
                place = place + axis * joints[j]
            else:
                turn = turn @ _turn(tree.axis[j], float(joints[j]))
        end = place + turn @ self._point
        jacobian = np.zeros((3, len(self._column)))
        for column, slides, axis, anchor in axes:
            jacobian[:, column] = axis if slides else cross3(axis, end - anchor)
        return end, jacobian

    def rates(self, joints: Floats, velocity: Floats, step: float) -> Floats:
        """Return the rates of the arm's joints for a velocity of the tool.

        Args:
            joints: of the whole robot [rad or m], shape (J,).
            velocity: wanted, body axes [m/s], shape (3,).
            step: for which the rates will be held [s]: no joint leaves its range by then.

        Returns:
            Rates [rad/s or m/s], shape (k,).
        """
        _, jacobian = self.tool(joints)
        now = joints[list(self.arm.joints)]
        least = np.maximum((self.lower - now) / step, -self._speed)
        most = np.minimum((self.upper - now) / step, self._speed)
        # a joint already outside comes back, it does not jump
        least, most = np.minimum(least, 0.0), np.maximum(most, 0.0)
        rates, free = np.zeros(len(now)), np.ones(len(now), dtype=bool)
        while free.any():
            j = jacobian[:, free]
            left = velocity - jacobian[:, ~free] @ rates[~free]
            rates[free] = j.T @ np.linalg.solve(j @ j.T + self._damping**2 * np.eye(3), left)
            beyond = free & ((rates < least) | (rates > most))
            if not beyond.any():
                break
            rates = np.where(beyond, np.clip(rates, least, most), rates)
            free &= ~beyond
        return rates

    def solve(
        self, joints: Floats, target: Floats, *, tolerance: float = 1e-3, rounds: int = 200
    ) -> Floats:
        """Return joint values of the arm that bring the tool's point to a place.

        Args:
            joints: of the whole robot to begin with [rad or m], shape (J,).
            target: body axes [m], shape (3,).
            tolerance: largest distance left [m].
            rounds: most iterations.

        Returns:
            Values of the arm's joints [rad or m], shape (k,).

        Raises:
            PhysicsError: the place is out of reach from there.
        """
        q, index = joints.copy(), list(self.arm.joints)
        for _ in range(rounds):
            place, _ = self.tool(q)
            away = target - place
            if math.sqrt(away @ away) < tolerance:
                found: Floats = q[index]
                return found
            q[index] += self.rates(q, 5.0 * away, 0.1) * 0.1
        place, _ = self.tool(q)
        raise PhysicsError(
            f"arm '{self.arm.name}' does not reach {np.round(target, 3).tolist()} m (body axes): "
            f"{np.linalg.norm(target - place) * 1e3:.0f} mm are left.\n"
            "Allowed: places within its joint limits; start nearer, or move the body."
        )


def _turn(axis: Floats, angle: float) -> Floats:
    """Rotation about a unit axis (Rodrigues)."""
    x, y, z = axis.tolist()
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Floats = np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k)
    return turn
