"""Candidates of drag laws that are a power of the speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.effects.discrepancy import DragExponent
from seals.effects.drag_form import DragForm
from seals.effects.drag_spread import fitted_spread
from seals.effects.effect import Effect, MediumKind
from seals.effects.identification import Addition, Freed, Stage, Subject, along_axes

_EXPONENT = 0.05
"""1-sigma of the exponents of drag laws."""


def power_law_additions(
    law: type[Effect],
    name: str,
    subject: Subject,
    *,
    power: int,
    share: Mapping[MediumKind, float],
    forms: Sequence[DragForm] = (),
) -> list[Addition]:
    """Return the candidates: drag in each medium; its exponent has a tolerance.

    Where nothing is known of the body's shape, the drag may act spread along the vehicle, or have
    another form.

    Args:
        law: class with ``coefficient_x``, ``coefficient_y``, ``coefficient_z`` and ``medium``.
        name: under which it is installed.
        subject: the vehicle.
        power: of the speed, 1 or 2.
        share: of the weight that the drag has at 1 m/s, by medium, at most.
        forms: tried besides where neither a stated drag nor the hull says how it acts.
    """
    found: list[Addition] = []
    made: Any = law
    for index, medium in enumerate(subject.media):
        water = medium is MediumKind.water
        size = share[medium] * (subject.mass * subject.environment.gravity)
        nominal = subject.nominal(name, "coefficient", medium)
        least = 0.25 * size if power == 1 and water else 0.3 * size
        scale = np.maximum(0.5 * nominal, least)
        drawn = subject.spread("drag_coefficient") * nominal
        coefficients = along_axes("coefficient", drawn, scale, low=-nominal)
        order = (Stage.flow, index, power - 1)
        options = law.options_on(subject.robot, subject.effects, medium)
        effect = made(medium=medium, **options)
        squares = effect.constants().get("squares")
        beside = fitted_spread(subject) if squares is None else {}
        found.append(
            Addition(
                instance=f"{name}_{medium.value}_change",
                effect=effect,
                parameters={**coefficients, **beside},
                nuisance=tuple(beside),
                variant={"medium": int(water)},
                order=order,
            )
        )
        if squares is None and not nominal.any():
            usual = replace(found[-1], parameters=coefficients, nuisance=())
            found += [_in_form(usual, f, made(medium=medium, form=f)) for f in forms]
        if nominal.any():
            shape = DragExponent(
                power=power,
                coefficients=tuple(nominal),
                speeds=tuple(subject.speeds),
                medium=medium,
                squares=squares,
            )
            # tolerance of the exponent of a stated drag; no candidate
            found.append(
                Addition(
                    instance=f"{name}_{medium.value}_shape",
                    effect=shape,
                    parameters={"exponent": Freed(tolerance=_EXPONENT, scale=0.1)},
                    named=(),
                    order=order,
                )
            )
    return found


def _in_form(usual: Addition, form: DragForm, effect: Effect) -> Addition:
    """Return a candidate in another form of its law."""
    instance = usual.instance.removesuffix("change") + form.value
    return replace(usual, instance=instance, effect=effect, law=form.value)
