"""Drag of rotors in their disc plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, columns, namespace
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Comparison, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion, Wrench
from seals.schema import param

_EXPONENT = 0.1
"""Plausible error of the power of the thrust."""
_TOLERANCES = 2.0
"""Tolerances that the change of a stated coefficient must exceed, as `DecisionPolicy` asks."""
_LEAST = 0.02
"""Share of the typical thrust below which the exponent is not felt."""


@dataclass(kw_only=True)
class DragRotor(Effect):
    """Induced and flapping drag of rotors, proportional to thrust and speed.

    Equation:
        F_xy = -c abs(T) (abs(T) / T_0)^(e - 1) v_hub,xy for each hub at r; v_hub = v + w x r - u is
        its velocity relative to the air, body axes; times the share of the medium. The
        force acts at r + (0, 0, l): discs that flap turn a vehicle as a force above the hub would.

    Args:
        coefficient: c [s/m].
        exponent: e, power of the thrust [1].
        typical: T_0, thrust of a rotor at which the exponent changes nothing [N].
        lever: l, height of the force above the hubs [m].
        medium: air.
        links: the link of the rotors, the root by default.

    Assumptions:
        Discs lie in the body's xy plane; the drag of a blade element grows with its thrust, or with
        a power of it between that of the speed, 1/2, and 1.

    Valid range:
        Advance ratios below about 0.1.

    Limitations:
        No drag along the axis, no side force from flapping; the moment of flapping at a hub is that
        of its lever.

    References:
        Faessler, Franchi, Scaramuzza 2018, IEEE Robotics and Automation Letters 3(2); Mahony,
        Kumar, Corke 2012, IEEE Robotics and Automation Magazine 19(3).

    Example:
        >>> DragRotor(coefficient=0.02).coefficient
        0.02
    """

    coefficient: float = param(
        0.0, "s/m", bounds=(-1.0, 1.0), tolerance=0.005, source="zero unless stated for the vehicle"
    )
    exponent: float = param(
        1.0, "1", bounds=(0.2, 2.0), tolerance=0.1, source="Mahony, Kumar, Corke 2012"
    )
    typical: float = param(
        1.0, "N", bounds=(1e-4, 1e5), tolerance=0.0, source="a share of the weight", fit=False
    )
    lever: float = param(
        0.0, "m", bounds=(-1.0, 1.0), tolerance=0.01, source="not on data sheets", later=True
    )
    medium: MediumKind = MediumKind.air
    accounts_for: ClassVar[tuple[str, ...]] = ("rotor drag",)
    identification: ClassVar[Identification] = Identification(
        confounders=("linear_drag",),
        resists=True,
        needs_motion=4,
        compared=Comparison(order=(Stage.joints, 5), scales={"coefficient": lambda _: 0.03}),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a common coefficient of all rotors, or the change of a stated one.

        A change obeys the stated law, and counts from two tolerances of drags on.
        """
        if not len(subject.lag) or not subject.rotors:
            return []
        stated = next((e for e in subject.effects.values() if isinstance(e, cls)), None)
        own = stated or cls(typical=subject.weight / len(subject.lag))
        size = Freed(
            scale=max(0.03, abs(own.coefficient)),
            bounds=(-own.coefficient, math.inf),
            # what the data sheet admits of a stated coefficient is no effect
            least=_TOLERANCES * subject.spread("drag_coefficient") * abs(own.coefficient),
        )
        bend = Freed(scale=_EXPONENT, bounds=(max(-0.6, 0.2 - own.exponent), 0.6))
        return [
            Addition(
                instance=name,
                effect=cls(exponent=own.exponent, typical=own.typical, lever=own.lever),
                parameters={
                    "coefficient": size,
                    "exponent": bend,
                    "lever": Freed(scale=0.02, bounds=(-0.2, 0.2)),
                },
                nuisance=("exponent", "lever"),
                order=(Stage.actuators, 0, 6),
            )
        ]

    @staticmethod
    def drive_loads(  # noqa: PLR0917  the signature of the hook
        drives: Drives,
        motion: Motion,
        medium: Medium,
        inputs: Inputs,
        memory: Array,
        params: Parameters,
    ) -> tuple[Wrench, Array]:
        """Force and torque of all hubs about the link origin [N, N m]."""
        xp = namespace(motion.velocity)
        relative = motion.velocity - medium.velocity
        p, q, r = (motion.angular_velocity[:, k : k + 1] for k in range(3))
        x, y, z = (drives.position[:, k][None, :] for k in range(3))
        # a rotor that turns backwards brakes as well
        slope = xp.abs(drives.thrust) * params["coefficient"] * -medium.medium_fraction
        bend = params["exponent"] - 1.0
        if type(bend) is not np.ndarray or np.any(bend):
            ratio = xp.abs(drives.thrust) / params["typical"]
            slope = slope * xp.clip(ratio, _LEAST, None) ** bend
        ahead = slope * (relative[:, 0:1] + q * z - r * y)
        aside = slope * (relative[:, 1:2] + r * x - p * z)
        force_x, force_y = xp.sum(ahead, axis=1), xp.sum(aside, axis=1)
        arm = z + params["lever"]
        torque = columns(
            xp.sum(-arm * aside, axis=1),
            xp.sum(arm * ahead, axis=1),
            xp.sum(x * aside - y * ahead, axis=1),
        )
        return Wrench(columns(force_x, force_y, force_x * 0.0), torque), memory
