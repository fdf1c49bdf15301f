"""Default candidates of an effect, derived from its fields, hooks and units."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.effects.hooks import ARGUMENTS, HOOKS, arguments_of_class
from seals.effects.identification import Addition, Freed, Subject
from seals.schema import Parameter, parameters_of, vector_groups

if TYPE_CHECKING:
    from seals.effects.effect import Effect

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


def default_additions(law: type[Effect], name: str, subject: Subject) -> list[Addition]:
    """Derive the candidates of an effect from its fields, hooks and `Identification`.

    A field ``rotor`` gives one variant for each actuator, ``joint`` one for each joint; with a
    field ``medium`` they act in the class's own medium, where the vehicle moves in it.

    Parameters whose bounds hold zero are strengths: zero switches them off, and they are fitted.
    Others are shapes and keep their default unless ``identification.scales`` names them. An effect
    whose class cannot be built without options, or that has no strength, is not a candidate.

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
    strengths = strengths_of(law)
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
    return unit_scale(
        meta, mass=subject.mass, length=subject.length, gravity=subject.environment.gravity
    )


def unit_scale(meta: Parameter, *, mass: float, length: float, gravity: float) -> float:
    """Return the plausible size of a parameter from its unit alone, see `plausible_scale`.

    Args:
        meta: unit, bounds and tolerance of the parameter.
        mass: of the vehicle [kg].
        length: its size [m].
        gravity: [m/s^2].
    """
    most = float(max(abs(b) for b in meta.bounds))
    powers = dimension(meta.unit)
    if powers is None:
        return min(10.0 * meta.tolerance or 1.0, most)
    clock = math.sqrt(length / gravity)
    size: float = _SHARE * mass ** powers[0] * length ** powers[1] * clock ** powers[2]
    return min(size, most)


def strengths_of(law: type[Effect]) -> tuple[str, ...]:
    """Return the fitted parameters whose bounds include zero, which switches the effect off."""
    return tuple(
        p for p, m in parameters_of(law).items() if m.fit and m.bounds[0] <= 0.0 <= m.bounds[1]
    )


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
    """Return true if the vehicle has all that the effect's hooks act on."""
    hooks = {n for n in HOOKS if n not in _UNSEEN and callable(getattr(law, n, None))}
    if not hooks or callable(getattr(law, "drives", None)):
        return False
    # true if a hook on links reads the joints
    return all(
        (h not in ("actuation", "command", "drive_loads") or len(subject.lag) > 0)
        and (h not in ("joint_loads", "joint_drive", "joint_resistance") or bool(subject.servo))
        and (
            subject.robot.tree.joints > 0
            or not (h in ARGUMENTS and "joints" in arguments_of_class(law, h))
        )
        for h in hooks
    )


_UNSEEN = ("drives", "battery_update", "axis_misalignment")
"""Hooks that alone change nothing that a fit compares."""


def _variants(
    fields: Mapping[str, Any], subject: Subject
) -> list[tuple[dict[str, Any], dict[str, float]]]:
    """Options and label of each variant: one variant for each pair of a rotor and a joint."""
    shared: dict[str, Any] = {}
    if "medium" in fields:
        medium = fields["medium"].default
        if medium not in subject.media and medium.value != "any":
            return []
        shared["medium"] = medium
    counts = {"rotor": len(subject.lag), "joint": subject.robot.tree.joints}
    places = {name: range(1, count + 1) for name, count in counts.items() if name in fields}
    chosen = [dict(zip(places, given, strict=True)) for given in product(*places.values())]
    return [({**shared, **one}, {name: float(k) for name, k in one.items()}) for one in chosen]


def _held(law: type[Effect], effect: Effect, subject: Subject) -> Effect | None:
    """The stated model's own instance of the effect in the same variant."""
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
