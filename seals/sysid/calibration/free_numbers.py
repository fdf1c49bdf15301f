"""Model with wide priors on the parameters to calibrate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from seals.effects.effect import Effect
from seals.sysid.calibration.stated import StatedNumber
from seals.sysid.candidates.parameters import CandidateSet, Parameter
from seals.sysid.predictors.windows_fit import WIDE


def with_free_numbers(
    candidate_set: CandidateSet,
    numbers: Sequence[StatedNumber],
    *,
    others: Iterable[StatedNumber] = (),
    base: str,
    share: float,
) -> CandidateSet:
    """Return the extended model with a wide prior on some numbers in place of their tolerances.

    All other parameters keep the tolerance that the log states.

    Args:
        candidate_set: stated model with its tolerances.
        numbers: that are asked for.
        others: of the vehicle: each keeps its tolerance, as that of the number alone.
        base: name of the base link.
        share: 1-sigma of the prior as a share of the stated number.
    """
    parameters = dict(candidate_set.parameters)
    for number in others:
        _hand_over(parameters, number, same_number(candidate_set, number, base))
    for number in numbers:
        for key in {*same_number(candidate_set, number, base), number.key} & set(parameters):
            # tolerance and number are one: the log cannot tell them apart
            parameters[key] = replace(parameters[key], tolerance=0.0)
    for number in numbers:
        known = parameters.get(number.key)
        sigma = prior_sigma(number, known, share=share) / abs(number.slope)
        parameters[number.key] = replace(
            Parameter(key=number.key) if known is None else known,
            tolerance=0.0,
            scale=sigma / WIDE,
            bounds=number.reach,
            adds=False,
        )
    return replace(candidate_set, parameters=parameters)


def _hand_over(parameters: dict[str, Parameter], number: StatedNumber, keys: Sequence[str]) -> None:
    """Transfer a tolerance to the parameter that changes this number alone, in place."""
    stated = parameters[keys[0]].changes if keys and number.key not in keys else None
    if stated is None:
        return
    given = parameters[keys[0]]
    tolerance = given.tolerance * abs(stated.slope / number.slope)
    parameters[number.key] = replace(
        given, key=number.key, tolerance=tolerance, bounds=number.reach, changes=None
    )
    for key in keys:
        parameters[key] = replace(parameters[key], tolerance=0.0)


def prior_sigma(number: StatedNumber, known: Parameter | None, *, share: float) -> float:
    """Return the 1-sigma of the prior of a number, in its unit.

    A number stated as zero has the width of a plausible missing effect.
    """
    if number.value:
        return share * abs(number.value)
    return WIDE * abs(number.slope) * (known.scale if known is not None else 1.0)


def same_number(candidate_set: CandidateSet, number: StatedNumber, base: str) -> list[str]:
    """Return the keys of the tolerances that describe the same quantity as a number.

    They name it, or change the same field of an effect of the same law, medium and links.

    Args:
        candidate_set: stated model with its tolerances.
        number: of the stated model.
        base: name of the base link.
    """
    return [
        key
        for key, parameter in candidate_set.parameters.items()
        if parameter.tolerance != 0.0 and _describes(candidate_set, key, number, base)
    ]


def _describes(candidate_set: CandidateSet, key: str, number: StatedNumber, base: str) -> bool:
    """Return true if a parameter names a number, or changes the same field of the same law."""
    parameter = candidate_set.parameters[key]
    instance, _, field = number.key.partition(".")
    changes, name = parameter.changes, number.name.rpartition(".")[2]
    if key == number.key:
        return True
    if changes is not None and changes.name == name and changes.value == number.value:
        return True
    effects = candidate_set.effects
    own, other = effects.get(instance), effects.get(parameter.instance)
    return parameter.parameter == field and _same_law(own, other, base)


def number_behind(
    candidate_set: CandidateSet, known: Iterable[StatedNumber], key: str, base: str
) -> StatedNumber | None:
    """Return the stated number that a parameter changes; None where none does.

    Args:
        candidate_set: extended model.
        known: numbers of the vehicle.
        key: of the parameter.
        base: name of the base link.
    """
    return next((n for n in known if _describes(candidate_set, key, n, base)), None)


_OPTIONS = ("medium", "rotor", "joint")
"""Options that tell variants of one law apart."""


def _same_law(one: Effect | None, other: Effect | None, base: str) -> bool:
    """Return true if two effects are of one law at one place."""
    if one is None or other is None or type(one) is not type(other):
        return False
    links = [{base if link == "root" else link for link in e.links} for e in (one, other)]
    return links[0] == links[1] and all(
        getattr(one, name, None) == getattr(other, name, None) for name in _OPTIONS
    )
