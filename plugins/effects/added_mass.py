"""Added mass: inertia of the water that moves with a body."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, fixed, namespace
from seals.effects import Addition, Comparison, Identification, Stage, Subject, along_axes
from seals.effects.discrepancy import AddedMassCentre
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.motion import AddedInertia, Inputs, Medium, Motion, Wrench
from seals.multibody.spatial import momentum
from seals.schema import LATER, param

_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e6),
    "tolerance": 0.15,
    "relative": True,
    "source": "zero unless the vehicle states it",
}
_EYE = np.eye(6)[None]
_CENTRE = 0.03
"""1-sigma of the added mass's centre, as a share of the hull's size."""


@dataclass(kw_only=True)
class AddedMass(Effect):
    """Added mass of a link, with its Coriolis and Munk terms and the water-entry force.

    Equation:
        (F, T) = -d/dt (s M_A nu_r) - Coriolis and Munk terms of s M_A (Kirchhoff), nu_r = (v_r,
        w). The part s M_A nu_r' joins the inertia of the link; the term -(ds/dt) M_A nu_r is a load
        and acts only while s rises. With ``floating``, s M_A is replaced by straight lines in s:
        zero in air, A_inf at s = floating_fraction, M_A under water.

    Args:
        mass_x: along body x [kg].
        mass_y: along body y [kg].
        mass_z: along body z [kg].
        inertia_x: about body x [kg m^2].
        inertia_y: about body y [kg m^2].
        inertia_z: about body z [kg m^2].
        coupling: symmetric 6x6 matrix with a zero diagonal, order [linear, angular], for bodies
            without three planes of symmetry [kg, kg m, kg m^2]; empty for none.
        floating: A_inf, symmetric 6x6 matrix of the floating hull at infinite frequency, same order
            [kg, kg m, kg m^2]; empty where s M_A stands for it.
        floating_fraction: submerged share of the hull at which A_inf holds [1].
        medium: water.

    Assumptions:
        Ideal flow; the matrix grows in proportion to the submerged share, or along the lines above.

    Valid range:
        Deeply submerged bodies at any acceleration; near the surface for slow motion.

    Limitations:
        No dependence on frequency near the surface (`radiation_memory` has it), none on nearby
        walls. Beyond the floating share the entry force takes the mean slope M(s) / s.

    References:
        Lamb 1932, Hydrodynamics, ch. 6; Fossen 2011, ch. 6 and 8.

    Example:
        >>> AddedMass(mass_z=0.8).mass_z
        0.8
    """

    mass_x: float = param(0.0, "kg", **_LIMITS)
    mass_y: float = param(0.0, "kg", **_LIMITS)
    mass_z: float = param(0.0, "kg", **_LIMITS)
    inertia_x: float = param(0.0, "kg m^2", **_LIMITS)
    inertia_y: float = param(0.0, "kg m^2", **_LIMITS)
    inertia_z: float = param(0.0, "kg m^2", **_LIMITS)
    coupling: list[list[float]] = field(default_factory=list)
    floating: list[list[float]] = field(default_factory=list, metadata=LATER)
    floating_fraction: float = param(
        0.5,
        "1",
        bounds=(0.001, 0.999),
        tolerance=0.0,
        source="half submerged",
        fit=False,
        later=True,
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("added mass",)
    zero_when_dry: ClassVar[bool] = True
    identification: ClassVar[Identification] = Identification(
        confounders=("accelerometer_scale", "buoyancy"),
        answers=True,
        needs_motion=3,
        words={
            "mass": "added mass of the water",
            "inertia": "added moment of inertia of the water",
        },
        compared=Comparison(
            order=(Stage.water, 2),
            media=("water",),
            scales={
                "mass": lambda s: 0.5 * max(s.mass, FRESH_WATER * s.volume),
                "inertia": lambda s: 0.5 * s.mass * s.length**2,
            },
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: change of the diagonal, and offset of the added-mass centre."""
        hull = subject.hull
        if not subject.has_water or hull is None:
            return []
        mass = subject.nominal(name, "mass", MediumKind.water)
        turn = subject.nominal(name, "inertia", MediumKind.water)
        share, displaced = subject.spread(name), FRESH_WATER * hull.volume
        length = (hull.volume) ** (1.0 / 3.0)
        linear = np.maximum(0.5 * mass, 0.3 * displaced)
        angular = np.maximum(0.5 * turn, 0.03 * displaced * length**2)
        order = (Stage.water, 0, 2)
        parameters = {
            **along_axes("mass", share * mass, linear),
            **along_axes("inertia", share * turn, angular),
        }
        found = [
            Addition(instance=f"{name}_change", effect=cls(), parameters=parameters, order=order)
        ]
        if mass.any():
            found.append(
                Addition(
                    instance=f"{name}_centre",
                    effect=AddedMassCentre(mass=tuple(mass)),
                    parameters=along_axes("offset", _CENTRE * length, 0.1 * length),
                    named=(),
                    order=order,
                )
            )
        return found

    def __post_init__(self) -> None:
        """Refuse matrices that are not symmetric or make the whole indefinite."""
        if self.floating:
            matrix = np.asarray(self.floating, dtype=float)
            if matrix.shape != (6, 6) or not np.allclose(matrix, matrix.T):
                raise ConfigError(
                    f"added_mass.floating of shape {matrix.shape} is not allowed.\n"
                    "Allowed: a symmetric 6x6 matrix."
                )
            _refuse_indefinite(
                matrix, "added_mass.floating", "the numbers that seals new hydrodynamics writes."
            )
        if not self.coupling:
            return
        matrix = np.asarray(self.coupling, dtype=float)
        if matrix.shape != (6, 6) or not np.allclose(matrix, matrix.T) or np.any(np.diag(matrix)):
            raise ConfigError(
                f"added_mass.coupling of shape {matrix.shape} is not allowed.\n"
                "Allowed: a symmetric 6x6 matrix with a zero diagonal; "
                "the diagonal is mass_x ... inertia_z."
            )
        _refuse_indefinite(
            matrix + np.diag(self._diagonal()),
            "added_mass",
            "couplings small enough against mass_x ... inertia_z; "
            "reduce them or raise the diagonal.",
        )

    def _diagonal(self) -> list[float]:
        return [
            self.mass_x,
            self.mass_y,
            self.mass_z,
            self.inertia_x,
            self.inertia_y,
            self.inertia_z,
        ]

    def constants(self) -> dict[str, Floats]:
        """Return the couplings, and the added mass of the floating hull, shape (1, 6, 6) each."""
        matrix = np.asarray(self.coupling, dtype=float) if self.coupling else np.zeros((6, 6))
        floating = {"floating": np.asarray([self.floating], dtype=float)} if self.floating else {}
        return {"coupling": matrix[None], **floating}

    @staticmethod
    def inertia(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[AddedInertia, Array]:
        """Matrix M_A about the link origin [kg, kg m, kg m^2], weighted by the submersion s."""
        return AddedInertia(_at(medium.medium_fraction, params), medium.medium_fraction), memory

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Water-entry force -(ds/dt) M_A nu_r while the submersion s rises [N, N m]."""
        if type(medium.submersion_rate) is np.ndarray and not (medium.submersion_rate > 0.0).any():
            nothing = motion.velocity * 0.0
            return Wrench(nothing, nothing), memory
        rising = 0.5 * (medium.submersion_rate + abs(medium.submersion_rate))
        relative = motion.velocity - medium.velocity
        force, torque = momentum(_at(medium.submersion, params), relative, motion.angular_velocity)
        return Wrench(-rising * force, -rising * torque), memory


def _refuse_indefinite(matrix: Floats, name: str, allowed: str) -> None:
    """Refuse a matrix with a negative eigenvalue beyond the rounding of written numbers."""
    values = np.linalg.eigvalsh(matrix)
    if values[0] < -1e-12 - 1e-7 * abs(values[-1]):
        raise ConfigError(
            f"{name} is not positive semi-definite: "
            f"its smallest eigenvalue is {values[0]:.3g}.\nAllowed: {allowed}"
        )


def _at(submersion: Array, params: Parameters) -> Array:
    """M_A(s) / s; M_A(s) is linear in s, or piecewise linear through the floating hull's matrix."""
    whole = _matrix(params)
    if "floating" not in params:
        return whole
    xp = namespace(submersion)
    share = params["floating_fraction"]
    above = xp.clip(submersion - share, 0.0, None)
    part = (above / (1.0 - share))[:, :, None]
    floating = params["floating"]
    return (floating + part * (whole - floating)) / (share + above)[:, :, None]


def _matrix(params: Parameters) -> Array:
    """Diagonal and coupling joined, shape (1 or N, 6, 6)."""
    mass, inertia = params["mass"], params["inertia"]
    if type(mass) is np.ndarray and mass.shape == inertia.shape == (1, 3):
        out = np.array(params["coupling"])
        diagonal = out.reshape(-1)[::7]
        diagonal[:3] += mass[0]
        diagonal[3:] += inertia[0]
        return out
    xp = namespace(mass)
    if mass.shape[0] != inertia.shape[0]:
        # one of them is batched, the other stands for all
        mass, inertia = mass + 0.0 * inertia, inertia + 0.0 * mass
    diagonal = xp.concat((mass, inertia), axis=1)
    return diagonal[:, :, None] * fixed(_EYE, diagonal) + params["coupling"]
