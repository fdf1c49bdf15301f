"""Effect given by a formula that the diagnosis fitted to a residual force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Identification
from seals.motion import Drives, Inputs, Medium, Motion, Wrench
from seals.schema import param
from seals.sysid.residual_force.laws import FORCES, TORQUES, Scene

_SOURCE = "zero: only stated terms act"
_SIZE: dict[str, Any] = {"bounds": (-1e5, 1e5), "tolerance": 0.1, "source": _SOURCE}
_PLACE: dict[str, Any] = {
    "bounds": (-1e5, 1e5),
    "tolerance": 0.1,
    "source": "chosen: the world's origin",
}
_SHARE: dict[str, Any] = {"bounds": (-10.0, 10.0), "tolerance": 0.01, "source": _SOURCE}
_UNIT: dict[str, Any] = {"bounds": (-1.0, 1.0), "tolerance": 0.0, "source": "chosen: world x"}
_POWER: dict[str, Any] = {"bounds": (-4.0, 6.0), "tolerance": 0.1}


@dataclass(kw_only=True)
class EffectFormula(Effect):
    """Formula fitted to a residual force: a sum of terms found in a log.

    Equation:
        Force: c + R^T h - d_i v_i abs(v)^(p-1) + l (w x v) + R^T (a - p) k r^(-1-q)
        + R^T s exp(-r^2 / 2 e^2) + R^T up n z^-m + R^T b (1 + tanh((p . n - E) / W)) / 2
        + C cos(W t) + S sin(W t); torque: c' - d' w + h' x w + C' cos(W t) + S' sin(W t); and a
        share of the actuators' wrench. Only terms whose coefficients are not zero count.

    Args:
        push_x: constant force in the body [N].
        push_y: likewise [N].
        push_z: likewise [N].
        hold_x: constant force in the world [N].
        hold_y: likewise [N].
        hold_z: likewise [N].
        twist_x: constant torque in the body [N m].
        twist_y: likewise [N m].
        twist_z: likewise [N m].
        drag_x: drag along body x at a speed of 1 m/s [N].
        drag_y: along body y [N].
        drag_z: along body z [N].
        drag_power: power of the whole speed in the drag [1].
        lift_x: force across rotation and motion [kg].
        lift_y: likewise [kg].
        lift_z: likewise [kg].
        spin_x: torque against the rotation [N m s/rad].
        spin_y: likewise [N m s/rad].
        spin_z: likewise [N m s/rad].
        wheel_x: momentum of a wheel in the body [N m s/rad].
        wheel_y: likewise [N m s/rad].
        wheel_z: likewise [N m s/rad].
        pull: force toward the place at a distance of 1 m [N].
        pull_power: the pull goes as distance to minus this power [1].
        core: distance within which it no longer grows [m].
        spot_x: force at the place, constant direction in the world [N].
        spot_y: likewise [N].
        spot_z: likewise [N].
        spread: distance over which it fades [m].
        place_x: of pull and spot, world [m].
        place_y: likewise [m].
        place_z: likewise [m].
        near: upward force at 1 m above the level [N].
        near_power: it goes as height to minus this power [1].
        level: from which the height counts, world z [m].
        beyond_x: force in the world beyond a plane [N].
        beyond_y: likewise [N].
        beyond_z: likewise [N].
        normal_x: of the plane [1].
        normal_y: likewise [1].
        normal_z: likewise [1].
        edge: distance of the plane from the world's origin along its normal [m].
        width: of its border [m].
        swing_cos_x: force that swings with cos(rate t), body [N].
        swing_cos_y: likewise [N].
        swing_cos_z: likewise [N].
        swing_sin_x: force that swings with sin(rate t), body [N].
        swing_sin_y: likewise [N].
        swing_sin_z: likewise [N].
        shake_cos_x: torque that swings with cos(rate t), body [N m].
        shake_cos_y: likewise [N m].
        shake_cos_z: likewise [N m].
        shake_sin_x: torque that swings with sin(rate t), body [N m].
        shake_sin_y: likewise [N m].
        shake_sin_z: likewise [N m].
        rate: of all that swings [rad/s].
        thrust: share of the actuators' force and torque that is added [1].
        medium: in which all terms act: any, air or water.

    Assumptions:
        The law holds where the log went; the clock of the simulation is that of the log.

    Valid range:
        Speeds, places and heights that the log covers.

    Limitations:
        It describes and does not explain: outside the log's range it may be far off. One term of
        each kind; pull and spot share their place.

    References:
        Brunton, Proctor and Kutz 2016, PNAS 113(15) (sparse terms); fitted, no law of its own.

    Example:
        >>> EffectFormula(hold_x=0.3, drag_z=1.2, drag_power=2.0).terms
        ('hold', 'drag')
    """

    push_x: float = param(0.0, "N", **_SIZE)
    push_y: float = param(0.0, "N", **_SIZE)
    push_z: float = param(0.0, "N", **_SIZE)
    hold_x: float = param(0.0, "N", **_SIZE)
    hold_y: float = param(0.0, "N", **_SIZE)
    hold_z: float = param(0.0, "N", **_SIZE)
    twist_x: float = param(0.0, "N m", **_SIZE)
    twist_y: float = param(0.0, "N m", **_SIZE)
    twist_z: float = param(0.0, "N m", **_SIZE)
    drag_x: float = param(0.0, "N", **_SIZE)
    drag_y: float = param(0.0, "N", **_SIZE)
    drag_z: float = param(0.0, "N", **_SIZE)
    drag_power: float = param(1.0, "1", **_POWER, source="chosen: linear")
    lift_x: float = param(0.0, "kg", **_SIZE)
    lift_y: float = param(0.0, "kg", **_SIZE)
    lift_z: float = param(0.0, "kg", **_SIZE)
    spin_x: float = param(0.0, "N m s/rad", **_SIZE)
    spin_y: float = param(0.0, "N m s/rad", **_SIZE)
    spin_z: float = param(0.0, "N m s/rad", **_SIZE)
    wheel_x: float = param(0.0, "N m s/rad", **_SIZE)
    wheel_y: float = param(0.0, "N m s/rad", **_SIZE)
    wheel_z: float = param(0.0, "N m s/rad", **_SIZE)
    pull: float = param(0.0, "N", **_SIZE)
    pull_power: float = param(2.0, "1", **_POWER, source="chosen: inverse square")
    core: float = param(
        0.3, "m", bounds=(0.0, 1e3), tolerance=0.1, source="chosen: size of a vehicle"
    )
    spot_x: float = param(0.0, "N", **_SIZE)
    spot_y: float = param(0.0, "N", **_SIZE)
    spot_z: float = param(0.0, "N", **_SIZE)
    spread: float = param(
        0.3, "m", bounds=(1e-3, 1e3), tolerance=0.1, source="chosen: size of a vehicle"
    )
    place_x: float = param(0.0, "m", **_PLACE)
    place_y: float = param(0.0, "m", **_PLACE)
    place_z: float = param(0.0, "m", **_PLACE)
    near: float = param(0.0, "N", **_SIZE)
    near_power: float = param(2.0, "1", **_POWER, source="chosen: as near the ground")
    level: float = param(0.0, "m", **_PLACE)
    beyond_x: float = param(0.0, "N", **_SIZE)
    beyond_y: float = param(0.0, "N", **_SIZE)
    beyond_z: float = param(0.0, "N", **_SIZE)
    normal_x: float = param(1.0, "1", **_UNIT)
    normal_y: float = param(0.0, "1", **_UNIT, fit=False)
    normal_z: float = param(0.0, "1", **_UNIT, fit=False)
    edge: float = param(0.0, "m", **_PLACE)
    width: float = param(
        0.05, "m", bounds=(0.0, 1e3), tolerance=0.05, source="chosen: soft for the integrator"
    )
    swing_cos_x: float = param(0.0, "N", **_SIZE)
    swing_cos_y: float = param(0.0, "N", **_SIZE)
    swing_cos_z: float = param(0.0, "N", **_SIZE)
    swing_sin_x: float = param(0.0, "N", **_SIZE)
    swing_sin_y: float = param(0.0, "N", **_SIZE)
    swing_sin_z: float = param(0.0, "N", **_SIZE)
    shake_cos_x: float = param(0.0, "N m", **_SIZE)
    shake_cos_y: float = param(0.0, "N m", **_SIZE)
    shake_cos_z: float = param(0.0, "N m", **_SIZE)
    shake_sin_x: float = param(0.0, "N m", **_SIZE)
    shake_sin_y: float = param(0.0, "N m", **_SIZE)
    shake_sin_z: float = param(0.0, "N m", **_SIZE)
    rate: float = param(
        6.0, "rad/s", bounds=(0.0, 1e4), tolerance=0.1, source="chosen: about one hertz"
    )
    thrust: float = param(0.0, "1", **_SHARE)
    medium: MediumKind = MediumKind.any
    accounts_for: ClassVar[tuple[str, ...]] = ()
    material: ClassVar[dict[str, float]] = {
        "thrust": 0.1,
        "lift_x": 0.1,
        "lift_y": 0.1,
        "lift_z": 0.1,
        "wheel_x": 1e-3,
        "wheel_y": 1e-3,
        "wheel_z": 1e-3,
        "near": 1.0,
        "near_power": 1.0,
        "level": -50.0,
    }
    # a law that was found already
    identification: ClassVar[Identification] = Identification(
        searched=False,
        formula=True,
        placed=True,
        compared=None,
    )

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms that are not zero."""
        out = []
        for stem in (*FORCES, *TORQUES, "thrust"):
            names = [stem] if hasattr(self, stem) else [f"{stem}_{a}" for a in "xyz"]
            if any(getattr(self, name) for name in names):
                out.append(stem)
        return tuple(out)

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Sum of all terms but the actuator term [N, N m]."""
        scene = Scene(
            time=motion.time,
            position=motion.position,
            rotation=motion.rotation,
            up=motion.up,
            velocity=motion.velocity - medium.velocity,
            spin=motion.angular_velocity,
            share=medium.medium_fraction,
        )
        force = motion.velocity * 0.0
        torque = force
        for stem, law in FORCES.items():
            force = force + law(scene, params[stem], params)
        for stem, law in TORQUES.items():
            torque = torque + law(scene, params[stem], params)
        return Wrench(force * medium.medium_fraction, torque * medium.medium_fraction), memory

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts and reaction torques, scaled by the actuator term."""
        factor = 1.0 + params["thrust"] * medium.medium_fraction
        return drives._replace(thrust=drives.thrust * factor, torque=drives.torque * factor)
