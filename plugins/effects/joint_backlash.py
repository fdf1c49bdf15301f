"""Backlash between servo and link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Inputs, Joints
from seals.schema import param

_HALF_BLEND = 1e-3
"""Half of the width over which the corners of the dead zone are rounded [rad]; play narrower than
the whole of it is not resolved."""


@dataclass(kw_only=True)
class JointBacklash(Effect):
    """Backlash: dead zone between a servo, which measures the motor side, and the link.

    Equation:
        tau = kp (dz(e) - e) with e = command - q - (kd/kp) q' and dz(e) = sign(e) max(abs(e) -
        w/2, 0): the change against the torque kp e of a servo without play. The sign of the net
        torque, damping included, decides on which side of the play the motor bears.

    Args:
        width: w, full width of the dead zone [rad].
        kp: stiffness of the servo [N m/rad].
        kd: damping of the servo [N m s/rad].
        joint: 1-based index of one joint, or 0 for all.
        links: not used; backlash acts on joints.

    Assumptions:
        Quasi-static: the motor takes the place at which the servo's spring and the contact balance,
        at once. Corners are rounded over 2e-3 rad so that the law is differentiable.

    Valid range:
        Motion slow against the servo's own, torque below its limit.

    Limitations:
        No impact at the ends of the play, no inertia of the motor in it.

    References:
        Nordin and Gutman 2002, Automatica 38(10).

    Example:
        >>> JointBacklash(joint=2, width=0.06).width
        0.06
    """

    width: float = param(
        0.0, "rad", bounds=(0.0, 1.0), tolerance=0.002, source="zero: no play unless stated"
    )
    kp: float = param(
        10.0, "N m/rad", bounds=(0.0, 1e6), tolerance=0.0, source="as the servo's", fit=False
    )
    kd: float = param(
        0.0, "N m s/rad", bounds=(0.0, 1e6), tolerance=0.0, source="as the servo's", fit=False
    )
    joint: int = 0
    accounts_for: ClassVar[tuple[str, ...]] = ("joint backlash",)
    material: ClassVar[dict[str, float]] = {"kp": 0.2, "kd": 0.004, "width": 0.4}
    noise_widths: ClassVar[float] = 4.0
    """Play in units of the encoder's noise up to which it is taken for that noise [1]."""
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        may_end=True,
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: backlash in each joint that a servo holds in its place."""
        if not subject.servo:
            return []
        kp, kd = subject.servo["kp"], subject.servo["kd"]
        # a smaller play follows the noise of the readings that show it
        least = max(2.0 * _HALF_BLEND, cls.noise_widths * subject.sigma.get("joint_position", 0.0))
        return [
            Addition(
                instance=f"{name}_{k}",
                effect=cls(joint=k, kp=float(kp[k - 1]), kd=float(kd[k - 1])),
                parameters={"width": Freed(scale=0.04, bounds=(0.0, 1.0), least=least)},
                variant={"joint": k},
                starts=[(0.02,), (0.06,)],
                order=(Stage.joints, k, 2),
            )
            for k in range(1, subject.robot.tree.joints + 1)
            if kp[k - 1] > 0.0
        ]

    def constants(self) -> dict[str, Floats]:
        """Return the joint's index."""
        return {"joint": np.full((1, 1), float(self.joint))}

    @staticmethod
    def joint_loads(
        joints: Joints, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Change of the servo's torque by the dead zone [N m]."""
        if inputs.joint_command is None:
            return joints.velocity * 0.0, memory
        lead = params["kd"] / params["kp"] * joints.velocity
        error = inputs.joint_command - joints.position - lead
        xp = namespace(error)
        half = 0.5 * params["width"]
        index = xp.cumulative_sum(xp.ones_like(error[:1, :]), axis=1)
        chosen = xp.astype((index == params["joint"]) | (params["joint"] == 0), error.dtype)
        play = _ramp(error - half) - _ramp(-error - half) - error
        return chosen * params["kp"] * play, memory


def _ramp(x: Array) -> Array:
    """max(x, 0) with a parabola in place of the corner, exact outside it."""
    xp = namespace(x)
    inside = xp.clip(x + _HALF_BLEND, 0.0, 2.0 * _HALF_BLEND)
    return inside * inside / (4.0 * _HALF_BLEND) + xp.clip(x - _HALF_BLEND, 0.0, None)
