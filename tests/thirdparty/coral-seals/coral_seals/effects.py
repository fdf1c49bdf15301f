"""Effects of currents around coral."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals import (
    Array,
    Effect,
    Inputs,
    Joints,
    Medium,
    MediumKind,
    Motion,
    Parameters,
    Wrench,
    by_joint,
    columns,
    namespace,
    param,
)
from seals.motion import Reading

_SOURCE = "chosen: an example"


@dataclass(kw_only=True)
class VortexShedding(Effect):
    """Mean sideways force of a wake that leaves on one side.

    Equation:
        F = f s, constant in link axes, with s the share of the medium.

    Args:
        force_x: f along body x [N].
        force_y: f along body y [N].
        force_z: f along body z [N].
        medium: water, air or any.
        links: links it acts on, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        The wake never changes sides.

    Valid range:
        None: this law shows how an effect is packaged, not how a wake behaves.

    Limitations:
        It knows neither speed nor frequency.

    References:
        None.

    Example:
        >>> VortexShedding(force_y=0.5).force_y
        0.5
    """

    force_x: float = param(0.0, "N", bounds=(-100.0, 100.0), tolerance=0.01, source=_SOURCE)
    force_y: float = param(0.2, "N", bounds=(-100.0, 100.0), tolerance=0.01, source=_SOURCE)
    force_z: float = param(0.0, "N", bounds=(-100.0, 100.0), tolerance=0.01, source=_SOURCE)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("vortex shedding",)

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Constant force in the medium [N]."""
        return Wrench(params["force"] * medium.medium_fraction, None), memory


@dataclass(kw_only=True)
class JointWaterDrag(Effect):
    """Viscous drag of the medium on the joints, as far as the moved links are immersed.

    Equation:
        tau = -c s q', with s the share of the medium at the link that the joint moves.

    Args:
        viscous: c, the same for all joints [N m s/rad].
        medium: water, air or any.
        links: without meaning here.
        correction: see `seals.effects.Effect`.

    Assumptions:
        The drag of a link on its own joint alone.

    Valid range:
        Slow motion, Reynolds numbers of the links below one.

    Limitations:
        No drag of outer links on inner joints; linear at any speed.

    References:
        Happel and Brenner 1983, Low Reynolds Number Hydrodynamics, ch. 5.

    Example:
        >>> JointWaterDrag(viscous=0.02).viscous
        0.02
    """

    viscous: float = param(0.01, "N m s/rad", bounds=(0.0, 10.0), tolerance=0.01, source=_SOURCE)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("joint drag",)

    @staticmethod
    def joint_loads(
        joints: Joints, medium: Medium, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Generalised force against the joint velocity [N m]."""
        return -params["viscous"] * by_joint(
            medium.medium_fraction, joints
        ) * joints.velocity, memory


@dataclass(kw_only=True)
class SwayByYaw(Effect):
    """Sideways force of a turning hull in water: the cross-coupling derivative of manoeuvring.

    Equation:
        F_y = Y_r r s, link axes, with r the rate of yaw and s the share of the medium.

    Args:
        derivative: Y_r [N s/rad].
        medium: water, air or any.
        links: links it acts on, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        The derivative does not depend on the speed ahead; the force acts at the link origin.

    Valid range:
        Slow turns of a hull whose bow and stern differ.

    Limitations:
        No moment goes with the force.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 6.

    Example:
        >>> SwayByYaw(derivative=2.0).derivative
        2.0
    """

    derivative: float = param(
        0.0, "N s/rad", bounds=(-1e3, 1e3), tolerance=0.1, source="zero unless stated"
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("sway by yaw",)

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Sideways force [N]."""
        zero = motion.angular_velocity[:, 2] * 0.0
        side = columns(zero, motion.angular_velocity[:, 2], zero)
        return Wrench(params["derivative"] * medium.medium_fraction * side, None), memory


@dataclass(kw_only=True)
class PaddlingArm(Effect):
    """Force ahead by which the water answers the swinging links of an arm.

    Equation:
        F_x = k s sum(q'), link axes, with q' the joint velocities and s the share of the medium.

    Args:
        stroke: k, the same for all joints [N s/rad].
        medium: water, air or any.
        links: links it acts on, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        Joints about the body's y axis; the arm is wet as far as the hull that carries it is.

    Valid range:
        Slow strokes.

    Limitations:
        Linear in the speed; no moment and no load on the joints goes with the force.

    References:
        None.

    Example:
        >>> PaddlingArm(stroke=1.5).stroke
        1.5
    """

    stroke: float = param(
        0.0, "N s/rad", bounds=(-1e3, 1e3), tolerance=0.1, source="zero unless stated"
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("paddling arm",)

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, joints: Joints, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force along body x [N]."""
        swing = namespace(joints.velocity).sum(joints.velocity, axis=1, keepdims=True)
        ahead = params["stroke"] * medium.medium_fraction * swing
        return Wrench(columns(ahead[:, 0], ahead[:, 0] * 0.0, ahead[:, 0] * 0.0), None), memory


@dataclass(kw_only=True)
class GyroscopeScale(Effect):
    """Scale error of the gyroscope.

    Equation:
        w' = (1 + s) w, axis by axis.

    Args:
        scale_x: s about the sensor's x [1].
        scale_y: s about the sensor's y [1].
        scale_z: s about the sensor's z [1].
        links: not used; the fault is the sensor's.
        correction: see `seals.effects.Effect`.

    Assumptions:
        Constant over a log.

    Valid range:
        Small errors, rates within the sensor's range.

    Limitations:
        No cross-axis part.

    References:
        Titterton and Weston 2004, Strapdown Inertial Navigation Technology, ch. 4.

    Example:
        >>> GyroscopeScale(scale_z=0.05).scale_z
        0.05
    """

    scale_x: float = param(0.0, "1", bounds=(-0.9, 9.0), tolerance=0.01, source=_SOURCE)
    scale_y: float = param(0.0, "1", bounds=(-0.9, 9.0), tolerance=0.01, source=_SOURCE)
    scale_z: float = param(0.0, "1", bounds=(-0.9, 9.0), tolerance=0.01, source=_SOURCE)
    accounts_for: ClassVar[tuple[str, ...]] = ("gyroscope scale",)

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Reading with the scale error."""
        return reading._replace(angular_velocity=(1.0 + params["scale"]) * reading.angular_velocity)
