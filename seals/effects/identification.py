"""What an effect says about itself to system identification: its size, its variants, its traits.

Every installed effect is a candidate of a diagnosis. One that has a law and parameters declared
with `seals.schema.param` needs no more: `default_additions` derives the rest. One that knows better
states an `Identification`, or overrides `seals.effects.Effect.additions`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.schema import parameters_of, vector_groups

if TYPE_CHECKING:
    from seals.arrays import Floats
    from seals.effects.effect import Effect, MediumKind
    from seals.environment.settings import EnvironmentSettings
    from seals.hydrostatics import Hull
    from seals.robot.model import RobotModel

AXES = ("x", "y", "z")
_SHARE = 0.1
"""Derived plausible size, in units made of the vehicle's mass, its size and gravity."""
_UNITS: Mapping[str, tuple[float, float, float]] = {
    "1": (0.0, 0.0, 0.0),
    "rad": (0.0, 0.0, 0.0),
    "kg": (1.0, 0.0, 0.0),
    "m": (0.0, 1.0, 0.0),
    "s": (0.0, 0.0, 1.0),
    "Hz": (0.0, 0.0, -1.0),
    "N": (1.0, 1.0, -2.0),
    "Pa": (1.0, -1.0, -2.0),
    "J": (1.0, 2.0, -2.0),
    "W": (1.0, 2.0, -3.0),
}
"""Powers of mass, length and time of each unit."""


class Stage(IntEnum):
    """Part of the vehicle in which an effect acts; candidates are tried stage by stage."""

    body = 0
    actuators = 1
    flow = 2
    water = 3
    joints = 4
    surroundings = 5
    sensors = 6
    installed = 7


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Constant facts about an effect that a diagnosis needs.

    Args:
        scales: plausible change of a parameter, by its name or the stem of ``stem_x ... stem_z``,
            in the parameter's unit: the prior width of a missing effect. Left out, it is derived
            from the unit, see `plausible_scale`. Name here a parameter whose bounds exclude zero
            (a shape rather than a strength) to have it fitted too.
        searched: whether the diagnosis of one log tries the effect. False for laws that every model
            holds anyway and for those that only several runs compared can tell.
        starts: starting values of the fit, one row of parameters each; none for zero alone.
        resists: a drag: a slightly different law of another drag looks like a small one.
        answers: it changes the response to commands, which the feedback against gusts imitates.
        needs_motion: any log with enough motion shows it, and one that does not could not tell: its
            rank among such effects, the first is flown for first; None for all others.
        in_arm: it acts inside an arm; None where the hook ``joint_loads`` decides.
        uncertain_onset: its response about zero says little of it, so a linear look cannot rule it
            out.
        guessed: it is not linear about zero and needs a pose and starting values from the residual
            force, see `seals.effects.Effect.guesses`.
        placed: its force depends on the place in the world.
        approximate: its law, of first order, leaves a share of what it explains.
        adds_only: parameters whose natural spread can only add, such as latencies.
        family: laws that differ only by the power of the speed share a name here; two of them
            together mean that neither is the law.
        measurement: a measurement on the ground that would tell, as a sentence.
    """

    scales: Mapping[str, float] = field(default_factory=dict)
    searched: bool = True
    starts: tuple[tuple[float, ...], ...] = ()
    resists: bool = False
    answers: bool = False
    needs_motion: int | None = None
    in_arm: bool | None = None
    uncertain_onset: bool = False
    guessed: bool = False
    placed: bool = False
    approximate: bool = False
    adds_only: tuple[str, ...] = ()
    family: str = ""
    measurement: str = ""


@dataclass(frozen=True, kw_only=True)
class Freed:
    """One parameter that a fit may move; all values are changes against the nominal model.

    Args:
        tolerance: 1-sigma of the change that the vehicle's data admit; 0 where they are exact.
        scale: size of a plausible missing effect.
        bounds: of the change.
    """

    tolerance: float = 0.0
    scale: float = 1.0
    bounds: tuple[float, float] = (-math.inf, math.inf)


@dataclass(frozen=True, kw_only=True)
class Addition:
    """One way in which an effect may be missing on a vehicle.

    Args:
        instance: name of the effect's instance in the extended model.
        effect: with all changes zero; None where the parameters are those of an instance that the
            nominal model holds.
        parameters: that a fit may move.
        named: those that make up the candidate, in the order of the report; None for all, empty for
            a tolerance of the nominal model that is no candidate.
        reported: their names in the report; None for the same.
        nuisance: parameters that the candidate frees but does not report.
        variant: tells variants apart, for example ``{"rotor": 2}``.
        starts: starting values of the named and nuisance parameters, one row each.
        order: stage, index of the medium or joint, and rank: candidates are tried in this order.
    """

    instance: str
    effect: Effect | None
    parameters: Mapping[str, Freed]
    named: tuple[str, ...] | None = None
    reported: tuple[str, ...] | None = None
    nuisance: tuple[str, ...] = ()
    variant: Mapping[str, float] = field(default_factory=dict)
    starts: Sequence[Sequence[float]] = ()
    order: tuple[int, int, int] = (Stage.installed, 0, 0)


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The vehicle of a diagnosis, as effects see it.

    Args:
        robot: links, masses, hulls.
        effects: of the nominal model by instance.
        environment: air, water, ground.
        tolerance: 1-sigma uncertainty of each nominal property, by name.
        channels: names of the measured channels.
        lag: first-order time constants of the actuators [s], shape (n,).
        rotors: whether the actuators are rotors.
        full_voltage: of the battery [V]; None when not known.
        servo: gains of the joint servos, shape (J,) each; empty without an arm.
        speeds: typical speeds along the body axes [m/s], shape (3,).
        media: in which the vehicle moves, water first.
    """

    robot: RobotModel
    effects: Mapping[str, Effect]
    environment: EnvironmentSettings
    tolerance: Mapping[str, float]
    channels: frozenset[str]
    lag: Floats
    rotors: bool
    full_voltage: float | None
    servo: Mapping[str, Floats]
    speeds: Floats
    media: tuple[MediumKind, ...]

    @property
    def mass(self) -> float:
        """Mass of the whole vehicle [kg]."""
        return float(self.robot.mass.sum())

    @property
    def weight(self) -> float:
        """Weight of the whole vehicle [N]."""
        return self.mass * self.environment.gravity

    @property
    def hull(self) -> Hull | None:
        """Hull of the base."""
        return self.robot.hulls[0]

    @property
    def has_water(self) -> bool:
        """Whether there is water and something that it can lift."""
        return self.environment.water_level is not None and self.hull is not None

    @property
    def length(self) -> float:
        """Size of the vehicle [m]: of its hull, or the radius of gyration of its base."""
        if self.hull is not None:
            return float(self.hull.volume ** (1.0 / 3.0))
        turning = float(np.trace(self.robot.inertia[0])) / 3.0
        return max(math.sqrt(turning / max(float(self.robot.mass[0]), 1e-9)), 0.05)

    def spread(self, name: str) -> float:
        """Return the stated tolerance of a property, 0 where none is stated."""
        return float(self.tolerance.get(name, 0.0))

    def nominal(self, instance: str, stem: str) -> Floats:
        """Return three parameters of a nominal effect, zeros without it, shape (3,)."""
        effect = self.effects.get(instance)
        return np.array([float(getattr(effect, f"{stem}_{a}", 0.0)) for a in AXES])


@dataclass(frozen=True, kw_only=True)
class Residual:
    """The force that a model leaves over along the course of a log, K points.

    Args:
        position: of the base, world axes [m], shape (K, 3).
        force: that is left over, world axes [N], shape (K, 3).
        time: of each point [s], shape (K,).
        subject: the vehicle.
    """

    position: Floats
    force: Floats
    time: Floats
    subject: Subject


def along_axes(
    stem: str, tolerance: Any, scale: Any, *, low: Floats | None = None
) -> dict[str, Freed]:
    """Return the three parameters ``stem_x``, ``stem_y`` and ``stem_z``.

    Args:
        stem: of their names.
        tolerance: one number or three.
        scale: one number or three.
        low: lower bounds of the changes, shape (3,).

    Example:
        >>> along_axes("bias", 0.0, 0.3)["bias_y"].scale
        0.3
    """
    sizes = np.broadcast_to(np.asarray(scale, dtype=float), 3)
    spread = np.broadcast_to(np.asarray(tolerance, dtype=float), 3)
    least = np.full(3, -math.inf) if low is None else low
    return {
        f"{stem}_{a}": Freed(
            tolerance=float(spread[i]), scale=float(sizes[i]), bounds=(float(least[i]), math.inf)
        )
        for i, a in enumerate(AXES)
    }


def default_additions(law: type[Effect], name: str, subject: Subject) -> list[Addition]:
    """Derive the candidates of an effect from its fields, hooks and `Identification`.

    A field ``medium`` gives one variant for the class's own medium where the vehicle moves in it,
    ``rotor`` one for each actuator, ``joint`` one for each joint. Parameters whose bounds hold zero
    are strengths: zero switches them off, and they are fitted. Others are shapes and keep their
    default unless ``identification.scales`` names them. An effect whose class cannot be built
    without options, or that has no strength, is no candidate.

    Args:
        law: class of the effect.
        name: under which it is installed.
        subject: the vehicle.
    """
    known = law.identification
    if not known.searched or not _can_act(law, subject):
        return []
    fields = {f.name: f for f in dataclasses.fields(law)}
    metas = {p: m for p, m in parameters_of(law).items() if m.fit}
    strengths = [p for p, m in metas.items() if m.bounds[0] <= 0.0 <= m.bounds[1]]
    chosen = [p for p in metas if p in strengths or _stated(law, p) is not None]
    missing = (dataclasses.MISSING, dataclasses.MISSING)
    if not strengths or any((f.default, f.default_factory) == missing for f in fields.values()):
        return []
    off: dict[str, Any] = dict.fromkeys(strengths, 0.0)
    found = []
    for options, variant in _variants(fields, subject):
        effect = law(**off, **options)
        held = _held(law, effect, subject)
        parameters = {p: _freed(law, p, subject, effect, held) for p in chosen}
        suffix = "".join(f"_{v:g}" for v in variant.values())
        found.append(
            Addition(
                instance=f"{name}_change{suffix}",
                effect=effect,
                parameters=parameters,
                variant=variant,
                starts=known.starts,
            )
        )
    return found


def plausible_scale(law: type[Effect], parameter: str, subject: Subject) -> float:
    """Return the plausible size of a parameter's change, in its unit.

    Equation:
        a tenth of m^a l^b (l/g)^(c/2) for a unit kg^a m^b s^c, with mass m, size l and gravity g;
        ten tolerances where the unit is none of these; never more than the bounds allow.

    Args:
        law: class of the effect, whose ``identification`` is asked first.
        parameter: its name.
        subject: the vehicle.
    """
    stated = _stated(law, parameter)
    if stated is not None:
        return stated
    meta = parameters_of(law)[parameter]
    most = max(abs(b) for b in meta.bounds)
    powers = dimension(meta.unit)
    if powers is None:
        return min(10.0 * meta.tolerance or 1.0, most)
    mass, length, duration = powers
    clock = math.sqrt(subject.length / subject.environment.gravity)
    return min(_SHARE * subject.mass**mass * subject.length**length * clock**duration, most)


def dimension(unit: str) -> tuple[float, float, float] | None:
    """Return the powers of mass, length and time of a unit, None for one that is not known.

    Example:
        >>> dimension("N s^2/m^2")
        (1.0, -1.0, 0.0)
        >>> dimension("V") is None
        True
    """
    total = np.zeros(3)
    for k, part in enumerate(unit.split("/")):
        for word in part.replace("(", " ").replace(")", " ").split():
            stem, _, power = word.partition("^")
            if stem not in _UNITS:
                return None
            total += (-1.0 if k else 1.0) * float(power or 1) * np.array(_UNITS[stem])
    return float(total[0]), float(total[1]), float(total[2])


def _stated(law: type[Effect], parameter: str) -> float | None:
    scales = law.identification.scales
    if parameter in scales:
        return float(scales[parameter])
    stems = vector_groups(parameters_of(law))
    return next(
        (float(scales[s]) for s, p in stems.items() if parameter in p and s in scales), None
    )


def _can_act(law: type[Effect], subject: Subject) -> bool:
    """Whether the vehicle has what the effect's hooks act on."""
    hooks = {n for n in _HOOKS if callable(getattr(law, n, None))}
    if not hooks or callable(getattr(law, "drives", None)):
        return False
    return all(
        (h not in ("actuation", "drive_loads") or len(subject.lag) > 0)
        and (h not in ("joint_loads", "joint_drive") or bool(subject.servo))
        for h in hooks
    )


_HOOKS = (
    *("loads", "inertia", "flow", "joint_loads", "joint_drive", "actuation"),
    *("drive_loads", "nominal", "measure", "timing"),
)


def _variants(
    fields: Mapping[str, Any], subject: Subject
) -> list[tuple[dict[str, Any], dict[str, float]]]:
    """Options and the variant they stand for."""
    if "medium" in fields:
        medium = fields["medium"].default
        kinds = [medium] if medium in subject.media or medium.value == "any" else []
        return [({"medium": m}, {}) for m in kinds]
    if "rotor" in fields:
        count = len(subject.lag)
        return [({"rotor": k}, {"rotor": float(k)}) for k in range(1, count + 1)]
    if "joint" in fields:
        count = subject.robot.tree.joints
        return [({"joint": k}, {"joint": float(k)}) for k in range(1, count + 1)]
    return [({}, {})]


def _held(law: type[Effect], effect: Effect, subject: Subject) -> Effect | None:
    """The nominal model's own instance of the effect in the same variant."""
    same = ("medium", "rotor", "joint")
    for own in subject.effects.values():
        if type(own) is law and all(
            getattr(own, f, None) == getattr(effect, f, None) for f in same
        ):
            return own
    return None


def _freed(
    law: type[Effect], parameter: str, subject: Subject, effect: Effect, held: Effect | None
) -> Freed:
    meta = parameters_of(law)[parameter]
    start = float(getattr(effect, parameter))
    at = start if held is None else start + float(getattr(held, parameter))
    spread = 0.0
    if held is not None:
        spread = meta.tolerance * (abs(at) if meta.relative else 1.0)
    return Freed(
        tolerance=spread,
        scale=plausible_scale(law, parameter, subject),
        bounds=(meta.bounds[0] - at, meta.bounds[1] - at),
    )
