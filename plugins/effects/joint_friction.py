"""Joint friction, Coulomb and viscous."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Comparison, Freed, Identification, Stage, Subject
from seals.motion import Inputs, Joints
from seals.schema import param

_GREASE = 0.3
"""Viscous friction that goes with dry friction [s/rad]: a joint that rubs is a greased one."""
_LEAST = 0.05
"""Plausible friction of the joint of a small arm [N m, N m s/rad]."""
_RUBS = 0.0125
"""Plausible friction by the torque of a drive, its limit or that of an error of 1 rad [1]."""
_STILL = 1e-9
"""Rate in thresholds at which the share of a rate of zero is taken [1]."""
_CREEP = 0.015
"""How well the rate is known at which dry friction turns over [rad/s]."""


@dataclass(kw_only=True)
class JointFriction(Effect):
    """Coulomb and viscous friction of revolute and prismatic joints.

    Equation:
        tau = -C tanh(q' / q'_0) - B q'.

    Args:
        coulomb: C [N m].
        viscous: B [N m s/rad].
        threshold: q'_0, speed over which the Coulomb torque changes sign [rad/s].
        joint: 1-based index of one joint, or 0 for all.
        links: not used; friction acts on joints.

    Steps take it implicitly by its share of the rate, C tanh(q' / q'_0) / q' + B: a joint that
    rubs slows down and stops, at any step.

    Assumptions:
        The sign function is smoothed over ``threshold`` so that the law is differentiable.

    Valid range:
        Lubricated bearings and gears in motion.

    Limitations:
        No stiction: a joint under a small load creeps at a share of ``threshold``.

    References:
        Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7).

    Example:
        >>> JointFriction(viscous=0.01).viscous
        0.01
    """

    coulomb: float = param(
        0.0, "N m", bounds=(0.0, 1e3), tolerance=0.01, source="zero unless stated for the vehicle"
    )
    viscous: float = param(
        0.0,
        "N m s/rad",
        bounds=(0.0, 1e3),
        tolerance=0.01,
        source="zero unless stated for the vehicle",
    )
    threshold: float = param(
        0.05, "rad/s", bounds=(1e-4, 10.0), tolerance=0.0, source="chosen", fit=False
    )
    joint: int = 0
    stiff: ClassVar[bool] = True
    accounts_for: ClassVar[tuple[str, ...]] = ("joint friction",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        may_end=True,
        compared=Comparison(
            order=(Stage.joints, 0),
            scales={
                "viscous": lambda s: 0.01 * s.weight * s.reach,
                "coulomb": lambda s: 0.01 * s.weight * s.reach,
            },
            laws={"viscous": "viscous", "coulomb": "coulomb"},
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: friction in each joint; its smoothing rate is not reported."""
        if not subject.servo:
            return []
        dry = subject.spread(name)
        kp = subject.servo["kp"]
        drive = np.minimum(kp, subject.servo.get("torque_limit", kp))
        sizes = np.maximum(_LEAST, _RUBS * drive)

        def parameters(size: float) -> dict[str, Freed]:
            return {
                "coulomb": Freed(tolerance=dry, scale=size, bounds=(0.0, np.inf)),
                "viscous": Freed(tolerance=_GREASE * dry, scale=size, bounds=(0.0, np.inf)),
                "threshold": Freed(tolerance=_CREEP, scale=_CREEP, bounds=(-0.045, np.inf)),
            }

        return [
            Addition(
                instance=f"{name}_{k}",
                effect=cls(joint=k),
                parameters=parameters(float(sizes[k - 1])),
                named=("coulomb", "viscous"),
                variant={"joint": k},
                order=(Stage.joints, k, 1),
            )
            for k in range(1, subject.robot.tree.joints + 1)
        ]

    def as_stated(
        self, values: Mapping[str, float], changes: Mapping[str, float], rates: Floats
    ) -> dict[str, float]:
        """Convert fitted values to the ideal law, Coulomb friction with a jump at rest."""
        if not rates.shape[1]:
            return dict(values)
        turn = self.threshold + float(changes.get("threshold", 0.0))
        dry, viscous = friction_as_catalogued(
            values["coulomb"], values["viscous"], turn, rates[:, self.joint - 1]
        )
        return {**values, "coulomb": dry, "viscous": viscous}

    @staticmethod
    def joint_loads(
        joints: Joints, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Generalised force against the joint velocity [N m or N]."""
        rate = joints.velocity
        dry = params["coulomb"] * namespace(rate).tanh(rate / params["threshold"])
        return _chosen(joints, params) * (-dry - params["viscous"] * rate), memory

    @staticmethod
    def joint_resistance(joints: Joints, inputs: Inputs, params: Parameters) -> Array:
        """Force against the joint velocity, by that velocity [N m s/rad or N s/m]."""
        xp = namespace(joints.velocity)
        turned = xp.abs(joints.velocity) / params["threshold"] + _STILL
        dry = params["coulomb"] / params["threshold"] * xp.tanh(turned) / turned
        return _chosen(joints, params) * (dry + params["viscous"])

    def constants(self) -> dict[str, Floats]:
        """Return the joint's index."""
        return {"joint": np.full((1, 1), float(self.joint))}


def _chosen(joints: Joints, params: Parameters) -> Array:
    """One for the joint that rubs, or for all, else zero, shape (1, J)."""
    rate = joints.velocity
    xp = namespace(rate)
    index = xp.cumulative_sum(xp.ones_like(rate[:1, :]), axis=1)
    return xp.astype((index == params["joint"]) | (params["joint"] == 0), rate.dtype)


def friction_as_catalogued(
    coulomb: float, viscous: float, threshold: float, rates: Floats
) -> tuple[float, float]:
    """Return the coefficients of ideal Coulomb and viscous friction that fit the smoothed law.

    Equation:
        least squares over the log of C sign(q') + B q' against
        coulomb tanh(q' / threshold) + viscous q'.

    Args:
        coulomb: [N m].
        viscous: [N m s/rad].
        threshold: rate at which dry friction turns over [rad/s].
        rates: of the joint, q' [rad/s], shape (T,).

    Example:
        >>> friction_as_catalogued(0.1, 0.02, 1e-6, np.array([-0.3, 0.2, 0.5]))
        (0.1, 0.02)
    """
    torque = coulomb * np.tanh(rates / threshold) + viscous * rates
    laws = np.stack((np.sign(rates), rates), axis=1)
    found = np.linalg.lstsq(laws, torque, rcond=None)[0]
    return float(np.round(found[0], 12)), float(np.round(found[1], 12))
