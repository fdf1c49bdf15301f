"""Added mass: inertia of the water that moves with a body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, fixed, namespace
from seals.effects import Addition, Comparison, Identification, Stage, Subject, along_axes
from seals.effects.discrepancy import AddedMassCentre
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.frames import cross
from seals.hydrostatics.entry import course, entry_share
from seals.motion import AddedInertia, Inputs, Medium, Motion, Wrench
from seals.multibody.spatial import momentum
from seals.robot.model import RobotModel
from seals.schema import LATER, param

_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e6),
    "tolerance": 0.15,
    "relative": True,
    "source": "zero unless stated for the vehicle",
}
_EYE = np.eye(6)[None]
INSTANT = 1e-12
"""Growth of an added mass within a step that stands for none [kg]."""
BLEND = 0.1
"""Width of the change from the entering sphere's course to the straight line, as a share of it."""
_CENTRE = 0.03
"""1-sigma of the added mass's centre, as a share of the hull's size."""


class EntryLaw(Enum):
    """Course of an added mass while its hull enters water."""

    waterline = "waterline"
    submerged_share = "submerged_share"


@dataclass(kw_only=True)
class AddedMass(Effect):
    """Added mass of a link, with its Coriolis and Munk terms and the water-entry force.

    Equation:
        (F, T) = -d/dt (M nu_r) - Coriolis and Munk terms of M (Kirchhoff), nu_r = (v_r, w), with
        M(s) = s M_A + e h h^T. The second part lets M along the normal n of the water surface grow
        as that of a sphere that enters, with the wetted waterline and the rise of the water:
        e = m_n y^2 / (y + s / 10), y = max(0, S(s / s_e) / 2 - s), m_n = n^T M_A n, h = (n, r x n),
        r the centroid of the submerged volume; S and s_e by `seals.hydrostatics.entry`: S rises
        from 0 to 1 until the hull is at its widest, at s = s_e. The part M nu_r' joins the inertia
        of the link; the term -(dM/ds) (ds/dt) nu_r is a load and acts only while s rises. That of e
        has n at rest in the world: e h (n . (w x v_r)) in place of its Coriolis and Munk terms.
        With ``floating``, s M_A is replaced by straight lines in s: zero in air, A_inf at
        s = floating_fraction, M_A under water, and the entering course ends at A_inf. With
        ``entry=submerged_share``, e = 0.

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
        entry: course of M while the hull enters: by its ``waterline``, or by the
            ``submerged_share`` alone, which a log means that does not state the course.
        medium: water.

    Assumptions:
        Ideal flow. What an entering body loses of its momentum the water has: M v. Water that a
        leaving body carried stays behind with its momentum: no suction.

    Valid range:
        Deeply submerged bodies at any acceleration; near the surface for slow motion. Entry along
        the normal: a sphere's slam within 15 % to 0.3 radii, its momentum within 10 % to one.

    Limitations:
        No dependence on frequency near the surface (`radiation_memory` has it), none on nearby
        walls. A flat face takes up its momentum over some way instead of at once, a pointed one
        too early. No cavity: beyond half immersion M goes on to M_A, where a fast body leaves air
        behind it and takes up less. The way of r in the link is left out of the velocity terms.
        Beyond the floating share the entry force takes the mean slope M(s) / s.

    References:
        Lamb 1932, Hydrodynamics, ch. 6; Fossen 2011, ch. 6 and 8; von Karman 1929, NACA TN 321;
        Wagner 1932, ZAMM 12; Shiffman and Spencer 1947, Quart. Appl. Math. 5.

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
    entry: EntryLaw = field(default=EntryLaw.waterline, metadata=LATER)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("added mass",)
    zero_when_dry: ClassVar[bool] = True
    log_words: ClassVar[Mapping[str, Enum]] = {"entry": EntryLaw.submerged_share}
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
                "inertia": lambda s: 0.5 * s.mass * s.reach**2,
            },
        ),
    )

    @classmethod
    def options_on(
        cls, robot: RobotModel, effects: Mapping[str, Effect], medium: MediumKind | None
    ) -> dict[str, Any]:
        """Return the course of the model's own added mass; none without one."""
        own = [e for e in effects.values() if isinstance(e, cls) and not e.correction]
        return {"entry": own[0].entry} if own else {}

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: change of the diagonal, and offset of the added-mass centre.

        Where none is stated, all of it is missing: as much as the water displaced (a cube has 0.67
        of it, a flat hull across its face more than all), and half of the body's own inertia.
        """
        hull = subject.hull
        if not subject.has_water or hull is None:
            return []
        mass = subject.nominal(name, "mass", MediumKind.water)
        turn = subject.nominal(name, "inertia", MediumKind.water)
        share, displaced = subject.spread(name), FRESH_WATER * hull.volume
        length = (hull.volume) ** (1.0 / 3.0)
        own = np.diag(subject.robot.inertia[0])
        least = 0.03 * displaced * length**2
        linear = np.where(mass > 0.0, np.maximum(0.5 * mass, 0.3 * displaced), displaced)
        angular = np.where(turn > 0.0, np.maximum(0.5 * turn, least), np.maximum(0.5 * own, least))
        order = (Stage.water, 0, 2)
        parameters = {
            # the least is to drag no fluid along: below it, thrusts may go to nothing, too
            **along_axes("mass", share * mass, linear, low=-mass),
            **along_axes("inertia", share * turn, angular, low=-turn),
        }
        words = {} if subject.simulated_step is not None else cls.log_words
        effect = cls(**{**words, **cls.options_on(subject.robot, subject.effects, None)})
        found = [
            Addition(instance=f"{name}_change", effect=effect, parameters=parameters, order=order)
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
            matrix
            + np.diag(
                [
                    self.mass_x,
                    self.mass_y,
                    self.mass_z,
                    self.inertia_x,
                    self.inertia_y,
                    self.inertia_z,
                ]
            ),
            "added_mass",
            "couplings small enough relative to mass_x ... inertia_z; "
            "reduce them or raise the diagonal.",
        )

    def constants(self) -> dict[str, Floats]:
        """Return the couplings, and the added mass of the floating hull, shape (1, 6, 6) each."""
        matrix = np.asarray(self.coupling, dtype=float) if self.coupling else np.zeros((6, 6))
        floating = {"floating": np.asarray([self.floating], dtype=float)} if self.floating else {}
        entry = {"waterline": np.ones((1, 1))} if self.entry is EntryLaw.waterline else {}
        return {"coupling": matrix[None], **floating, **entry}

    @staticmethod
    def inertia(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[AddedInertia, Array]:
        """Matrix M_A about the link origin [kg, kg m, kg m^2] by the submersion s, and e h h^T."""
        s = medium.medium_fraction
        entry, more = _entry(motion, medium, params), None
        if entry is not None:
            more = entry.mass[:, :, None] * entry.way[:, :, None] * entry.way[:, None, :]
        return AddedInertia(_at(s, params), s, more), memory

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Water-entry force -(dM/ds) (ds/dt) nu_r while the submersion s rises [N, N m]."""
        entry = _entry(motion, medium, params)
        rises = (
            type(medium.submersion_rate) is not np.ndarray or (medium.submersion_rate > 0.0).any()
        )
        if entry is None and not rises:
            nothing = motion.velocity * 0.0
            return Wrench(nothing, nothing), memory
        rising = 0.5 * (medium.submersion_rate + abs(medium.submersion_rate))
        relative, spin = motion.velocity - medium.velocity, motion.angular_velocity
        force, torque = momentum(_at(medium.submersion, params), relative, spin)
        if entry is None:
            return Wrench(-rising * force, -rising * torque), memory
        n, arm = entry.way[:, :3], entry.way[:, 3:]
        speed = _along(relative, n) + _along(spin, arm)
        gain = entry.slope * speed
        force, torque = force + gain * n, torque + gain * arm
        # a face that is wetted within a step stops, and is not thrown back: no step takes up
        # more momentum than the link and its water have
        carried = motion.body.mass + entry.line * medium.submersion + entry.mass
        most = carried / (abs(entry.line + entry.slope) * inputs.step + INSTANT)
        rising = namespace(rising).minimum(rising, most)
        return Wrench(-rising * force, -rising * torque), memory


def _along(values: Array, way: Array) -> Array:
    """Return the component of each row along another, shape (N, 1)."""
    each = values * way
    return each[:, 0:1] + each[:, 1:2] + each[:, 2:3]


class _Entry(NamedTuple):
    """Added mass of the entering hull beyond M_A's growth with the submerged share.

    Args:
        mass: e [kg], shape (N, 1).
        slope: de/ds [kg], shape (N, 1).
        line: growth of the rest of M along the normal with s [kg], shape (N, 1).
        way: h, its direction [1, m], shape (N, 6).
    """

    mass: Array
    slope: Array
    line: Array
    way: Array


def _entry(motion: Motion, medium: Medium, params: Parameters) -> _Entry | None:
    """Return the entry's part of M(s); None where NumPy's rows have none."""
    s, floating = medium.submersion, "floating" in params
    if "waterline" not in params:
        return None
    end = params["floating_fraction"] if floating else 0.5
    if type(s) is np.ndarray and not ((s > 0.0) & (s < end)).any():
        return None
    xp, n = namespace(s), medium.normal
    share = entry_share(motion.body.entry_shares, n)
    held = xp.clip(0.5 * course(end / share)[0], end, None) if floating else 0.5
    taken, slope = course(s / share)
    # up to A_inf, or half of M_A; a straight line to there grows with s already
    part = xp.clip(0.5 * taken / held, None, 1.0)
    over = xp.clip(part - s / end, 0.0, None)
    rise = xp.astype(part < 1.0, s.dtype) * (0.5 * slope / (share * held)) - 1.0 / end
    # e = y^2 / (y + d): the force would jump where the straight line takes over at an angle
    blend = BLEND * s / end + 1e-12
    ratio = over / (over + blend)
    rise = ratio * ((2.0 - ratio) * rise - ratio * BLEND / end)
    whole = params["floating"] if floating else 0.5 * _matrix(params)
    along = _along(momentum(whole, n, 0.0 * n)[0], n)
    way = xp.concat((n, cross(medium.buoyancy_centre + 0.0 * n, n)), axis=1)
    return _Entry(along * over * ratio, along * rise, along / end, way)


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
