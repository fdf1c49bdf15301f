"""Readable names of effects, parameters, channels and units."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.report.style import unit_text
from seals.schema import parameters_of
from seals.sysid.candidates.catalogue import installed, wave_laws
from seals.sysid.candidates.parameters import Candidate, CandidateSet

UNKNOWN = "not determined"
"""Text in place of a figure that is not finite."""
_AXIS = re.compile(r"_([xyz]{1,2})$")
_PARTS = {
    "mass.mass": "mass of the body",
    "rotors.torque_change": "reaction torque of the rotors",
    "surface.share": "buoyancy while piercing the surface",
    "servos.kp": "stiffness of the joint servos",
    "servos.kd": "damping of the joint servos",
}
"""Adjustable values that belong to the vehicle and to no effect."""


def log_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the names of logs: the last part of each path, the whole path where two are alike.

    Example:
        >>> log_names(["flights/a", "flights/b"]), log_names(["one/log", "two/log"])
        (('a', 'b'), ('one/log', 'two/log'))
    """
    short = tuple(Path(path).name for path in paths)
    return short if len(set(short)) == len(short) else tuple(paths)


def effect_words(name: str) -> str:
    """Return the first line of an effect's description; empty when it has none.

    Example:
        >>> effect_words("waves")
        'Airy wave on deep water: elevation, velocity and acceleration of the water.'
    """
    laws = {**installed(), **{law.candidate: law for law in wave_laws()}}
    return (inspect.getdoc(laws.get(name)) or "").partition("\n")[0] if name in laws else ""


def parameter_words(key: str) -> str:
    """Return the description of a model parameter in words.

    Example:
        >>> parameter_words("inertia.delta_xx"), parameter_words("weak_rotor_2.relative_loss")
        ('moment of inertia, xx', 'thrust loss of actuator 2')
        >>> parameter_words("quadratic_drag_water_change.coefficient_z")
        'quadratic drag in water, z'
    """
    found = _AXIS.search(key)
    stem, axis = (key[: found.start()], f", {found.group(1)}") if found else (key, "")
    instance, _, parameter = stem.partition(".")
    if stem in _PARTS:
        return _PARTS[stem] + axis
    declared = _declared(instance, parameter)
    if declared:
        return declared + axis
    if instance.startswith("mass_"):
        return f"mass of {instance[5:].replace('_', ' ')}"
    drag = re.fullmatch(r"(\w+_drag)_(air|water)_(change|shape)", instance)
    if drag:
        words = f"{drag[1].replace('_', ' ')} in {drag[2]}"
        if parameter == "exponent":
            return f"exponent of {words}"
        return words + (", quadratic part" if parameter == "quadratic" else "") + axis
    return f"{instance} {parameter}".replace("_", " ") + axis


def _declared(instance: str, parameter: str) -> str:
    """Return the words that an effect declares for a parameter of an instance, or none."""
    for name, law in installed().items():
        variant = instance[len(name) + 1 :]
        if instance != name and not instance.startswith(f"{name}_"):
            continue
        words = law.identification.words.get(parameter, "")
        if words and ("{}" in words or variant in ("", "change")):
            return words.format(variant)
    return ""


def unit_of(candidate_set: CandidateSet, key: str, usual: str = "1") -> str:
    """Return the unit that the effect of a parameter states, or the usual one where it does not."""
    parameter = candidate_set.parameters[key]
    effect = candidate_set.effects.get(parameter.instance)
    meta = {} if effect is None else parameters_of(effect)
    return meta[parameter.parameter].unit if parameter.parameter in meta else usual


def candidate_words(candidate: Candidate) -> str:
    """Return the name of an effect with its variant."""
    variant = dict(candidate.variant)
    parts = [candidate.law] if candidate.law else []
    if "medium" in variant:
        parts.append("water" if variant.pop("medium") else "air")
    if variant.get("link") == 0:
        variant.pop("link")
    parts += [f"{k} {v:g}" for k, v in variant.items()]
    parts += ["for a time"] if candidate.activity is not None else []
    return candidate.name + (f" ({', '.join(parts)})" if parts else "")


def percent(share: float) -> str:
    """Format a share in per cent; 'more than 99 %' from there on.

    Example:
        >>> percent(0.999), percent(0.5), percent(1.0), percent(float("nan"))
        ('more than 99 %', '50 %', 'more than 99 %', 'not determined')
    """
    if not math.isfinite(share):
        return UNKNOWN
    return "more than 99 %" if share > 0.99 else f"{100.0 * share:.0f} %"


def interval(low: float, high: float, unit: str = "") -> str:
    """Format an interval as text.

    Example:
        >>> interval(0.1, 0.25, "m"), interval(0.1, float("nan"), "m")
        ('0.1 to 0.25 m', 'not determined')
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return UNKNOWN
    return f"{figure(low)} to {figure(high, unit)}"


def points(score: float) -> str:
    """Format a score: three digits, thousands separated.

    Example:
        >>> points(24512.3), points(8.352), points(-0.004)
        ('24,512', '8.35', '-0.004')
    """
    return f"{score:,.0f}" if 100.0 <= abs(score) < math.inf else figure(score, digits=3)


def figure(value: float, unit: str = "", digits: int = 4) -> str:
    """Format a number with its unit; "not determined" where it is not finite.

    Example:
        >>> figure(0.01234, "m/s"), figure(1234567.0), figure(2.345, digits=2)
        ('0.01234 m/s', '1.235e+06', '2.3')
        >>> figure(float("nan"), "m/s")
        'not determined'
    """
    if not math.isfinite(value):
        return UNKNOWN
    # adding zero turns a negative zero into a plain one
    return f"{value + 0.0:.{digits}g} {unit_text(unit)}".strip()


def parameter_text(name: str, p: Mapping[str, Any]) -> str:
    """Return a parameter of an answer with its unit and interval, in words."""
    unit = "" if p["unit"] == "1" else f" {p['unit']}"
    return f"{name} = {figure(p['value'])}{unit}  (90 %: {interval(p['low90'], p['high90'])})"
