"""Model discrepancies: exponent of drag, buoyancy at the surface, moment of waves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.frames import cross, skew_last
from seals.motion import AddedInertia, Inputs, Medium, Motion, Wrench
from seals.schema import param

_SLOWEST = 0.02
"""Share of the typical speed below which the exponent is not felt."""


@dataclass(kw_only=True)
class DragExponent(Effect):
    """Change of a drag law's exponent about a typical speed.

    Equation:
        F_i = -e c_i abs(v_r,i)^p sign(v_r,i) ln(abs(v_r,i) / v_i), the first order of
        c_i v_i^-e abs(v_r,i)^(p + e). Where the drag counts the speed along other axes, too, that
        speed V_i stands for abs(v_r,i) and for v_i, and V_i v_r,i for abs(v_r,i)^2 sign(v_r,i).

    Args:
        exponent: e, change of the exponent [1].
        power: p, 1 or 2.
        coefficients: c of the drag, three numbers.
        speeds: v_i, typical speeds [m/s].
        squares: adds the squared velocities that count along each axis, shape (1, 3, 3); None for
            its own alone.
        medium: of the drag.
    """

    exponent: float = param(
        0.0, "1", bounds=(-0.3, 0.3), tolerance=0.05, source="accuracy of power laws"
    )
    power: int = 2
    coefficients: tuple[float, float, float] = (0.0, 0.0, 0.0)
    speeds: tuple[float, float, float] = (1.0, 1.0, 1.0)
    squares: Floats | None = None
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ()

    def constants(self) -> dict[str, Floats]:
        """Return coefficients, typical speeds, the exponent, and the axes whose speeds count."""
        speeds = np.array([self.speeds])
        shape = {} if self.squares is None else {"squares": self.squares}
        if self.squares is not None:
            speeds = np.sqrt(speeds**2 @ self.squares[0])
        return {
            "coefficients": np.array([self.coefficients]),
            "speeds": speeds,
            "power": np.array([[float(self.power)]]),
            **shape,
        }

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Change of the drag [N]."""
        xp = namespace(motion.velocity)
        relative = motion.velocity - medium.velocity
        size = abs(relative)
        if "squares" in params:
            size = xp.sqrt(xp.matmul(relative * relative, params["squares"][0]))
        ratio = xp.clip(size / params["speeds"], _SLOWEST, None)
        law = relative * xp.where(params["power"] > 1.5, size, 1.0 + 0.0 * size)
        force = -params["exponent"] * params["coefficients"] * law * xp.log(ratio)
        return Wrench(force * medium.medium_fraction, None), memory


@dataclass(kw_only=True)
class SurfaceForce(Effect):
    """Error of the buoyancy force while a hull pierces the surface.

    Equation:
        F = e rho g V 4 s (1 - s) upward at the centre of buoyancy's height, on the origin.

    Args:
        share: e [1].
    """

    share: float = param(
        0.0, "1", bounds=(-0.3, 0.3), tolerance=0.02, source="accuracy of the shape of the hull"
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ()

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Change of the buoyancy force [N]."""
        s = medium.submersion
        weight = medium.density * medium.gravity * motion.body.volume * (4.0 * s * (1.0 - s))
        return Wrench(motion.up * (params["share"] * weight), None), memory


@dataclass(kw_only=True)
class AddedMassCentre(Effect):
    """Offset of the point about which the stated added mass has no coupling.

    Equation:
        M_A about the origin gains the coupling -M S(d) between force and turning (and its
        transpose), to first order in d; M is the linear block of the stated added mass.

    Args:
        offset_x: d [m].
        offset_y: d [m].
        offset_z: d [m].
        mass: diagonal of M [kg], three numbers.
    """

    offset_x: float = param(0.0, "m", bounds=(-1.0, 1.0), tolerance=0.0, source="hull's shape")
    offset_y: float = param(0.0, "m", bounds=(-1.0, 1.0), tolerance=0.0, source="hull's shape")
    offset_z: float = param(0.0, "m", bounds=(-1.0, 1.0), tolerance=0.0, source="hull's shape")
    mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ()

    def constants(self) -> dict[str, Floats]:
        """Return the linear block's diagonal, shape (1, 3)."""
        return {"mass": np.array([self.mass], dtype=float)}

    @staticmethod
    def inertia(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[AddedInertia, Array]:
        """Change of M_A about the link origin [kg m], weighted by the submersion s."""
        xp = namespace(params["offset"])
        d = params["offset"]
        block = -params["mass"][:, :, None] * skew_last(d)
        none = 0.0 * block
        top = xp.concat((none, block), axis=2)
        below = xp.concat((xp.permute_dims(block, (0, 2, 1)), none), axis=2)
        return AddedInertia(xp.concat((top, below), axis=1), medium.medium_fraction), memory


@dataclass(kw_only=True)
class WaveMoment(Effect):
    """Moment that shifts the wave force from the centre of buoyancy to the link origin.

    Equation:
        T = -r_b x (rho V s a_water), with r_b the centroid of the submerged volume.

    Args:
        share: how much of the moment is taken back [1].
    """

    share: float = param(1.0, "1", bounds=(0.0, 1.0), tolerance=0.0, source="the law of waves")
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ()

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Moment that cancels that of the wave force at the centre of buoyancy [N m]."""
        push = medium.acceleration * (
            medium.density * motion.body.volume * medium.submersion * params["share"]
        )
        return Wrench(None, -cross(medium.buoyancy_centre, push)), memory
