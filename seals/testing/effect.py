"""Contract tests of effect plug-ins."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.contract import class_of, require
from seals.effects.effect import Effect
from seals.schema import Parameter, parameters_of
from seals.testing.agreement import Agreement, SceneReport
from seals.testing.declaration import check_effect_declaration
from seals.testing.hooks import HookCheck
from seals.testing.scenes import ARM_SIZE, LIMITS, Case, cases_of

MEMORY_ORDER = 0.8
"""Order asked of an effect with memory: it is advanced once a step, which is of first order."""


@dataclass(frozen=True, kw_only=True)
class EffectReport:
    """Result of `check_effect`.

    Args:
        name: of the effect.
        hooks: it defines.
        libraries: array libraries under which its laws agree.
        scenes: agreement of simulator and twin.
    """

    name: str
    hooks: tuple[str, ...]
    libraries: tuple[str, ...]
    scenes: tuple[SceneReport, ...]

    def table(self) -> str:
        """Return the results as text, one line per scene and step."""
        lines = [
            f"{self.name}: hooks {', '.join(self.hooks)}; equal under {', '.join(self.libraries)}",
            f"{'scene':<12}{'body':<6}{'step':>6}{'position':>11}{'attitude':>11}{'joints':>11}{'order':>7}{'moved':>9}",
        ][: 2 if self.scenes else 1]
        for scene in self.scenes:
            orders = ("", *(f"{order:.2f}" for order in scene.orders))
            for step, error, order in zip(scene.steps, scene.errors, orders, strict=True):
                figures = "".join(f"{e:>11.1e}" for e in error)
                body = "arm" if scene.arm else "one"
                lines.append(
                    f"{scene.scene:<12}{body:<6}{step * 1e3:>4g}ms{figures}"
                    f"{order:>7}{scene.moved:>9.2g}"
                )
        return "\n".join(lines)


def check_effect(
    effect: str | type[Effect],
    *,
    values: Mapping[str, Any] | None = None,
    steps: Sequence[float] = (0.004, 0.002, 0.001),
    duration: float = 2.0,
    backend: str = "",
    cases: Sequence[Case] | None = None,
    in_twin: type[Effect] | None = None,
) -> EffectReport:
    """Check the contract of an effect.

    It must declare its parameters with their physics and its law in words; every hook must be pure,
    give each row what it gives the batch, hand back memory of the declared shape, agree to 1e-12
    under NumPy, array-api-strict and, where installed, PyTorch; a drag must never drive a body; a
    change of size zero must change nothing; simulator and twin must agree over contact-free motion;
    and the effect must move the simulation. Errors and delays of sensors and commands move nothing:
    they have no scenes.

    Args:
        effect: name of an installed effect, or its class.
        values: parameter values that matter to a body of 1 kg and 0.1 m; otherwise those of the
            class attribute ``material``, then chosen from units and bounds. Drives are rotors
            unless the class attribute ``actuator`` says thrusters.
        steps: of the simulator [s], falling, each dividing 4 ms; limits exist for 4 and 1 ms.
        duration: compared time [s].
        backend: name of the rigid-body backend.
        cases: robots and scenes; chosen from the effect's medium and hooks otherwise.
        in_twin: another class for the twin, to see that a difference is found.

    Returns:
        The figures; ``print(report.table())`` shows them.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_effect("gravity", duration=0.02).name
        'gravity'
    """
    name, cls = class_of("effect", effect)
    hooks = check_effect_declaration(name, cls)
    one = material_effect(cls, values)
    libraries = HookCheck(name, one, hooks).run()
    agreement = Agreement(name, duration=duration, steps=steps, backend=backend)
    scenes: list[SceneReport] = []
    for case in cases_of(one, hooks) if cases is None else cases:
        size = {"size": ARM_SIZE, "links": ["*"]} if case.arm else {"links": ["*"]}
        twin = None if in_twin is None else material_effect(in_twin, values, **size)
        for report in agreement.measure(material_effect(cls, values, **size), case, in_twin=twin):
            agreement.judge(report, least=MEMORY_ORDER if one.memory_size else 1.0)
            scenes.append(report)
    most = max((scene.moved for scene in scenes), default=0.0)
    least = 2.0 * max(LIMITS[False].values())
    require(
        most > least or not scenes,
        name,
        f"changes the motion by {most:.1e} of its path at most, so the comparison is not "
        "meaningful",
        "Give values= that have an effect on a body of 1 kg and 0.1 m.",
    )
    return EffectReport(name=name, hooks=hooks, libraries=libraries, scenes=tuple(scenes))


# powers of (mass, length, time) of the units that laws of rigid bodies in fluids are written in
_UNITS: dict[str, tuple[int, int, int]] = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
    "Hz": (0, 0, -1),
    "J": (1, 2, -2),
    "W": (1, 2, -3),
    "Pa": (1, -1, -2),
}
MASS, LENGTH, TIME = 1.0, 0.1, 1.0
"""Size of the bodies in the checks [kg, m, s]."""
_STATED = {"m/s": 1.0, "m^3": 1e-4}
"""Speed of a flow, and change of a volume of a litre, that matter without ruling the motion."""

LARGE = 50.0
"""Tolerances of a number without unit that are more than enough to matter."""

_SPREAD = (1.0, 1.3, 0.8)


def material_effect(
    cls: type[Effect], values: Mapping[str, Any] | None = None, *, size: float = 1.0, **options: Any
) -> Effect:
    """Build an effect whose parameters are large enough to matter.

    A default that is not zero stays: its author chose it. A zero becomes the natural scale of its
    unit, for instance 1 N s/m, slightly different from axis to axis. A law for which these are no
    good states others in the class attribute ``material``.

    Args:
        cls: class of the effect.
        values: fields given by the caller, which rule.
        size: mass of the body against a kilogramme [1]; forces, masses and volumes shrink with it.
        **options: further fields, such as ``links``.
    """
    chosen = {**cls.material, **(values or {})}
    chosen.update({name: value for name, value in options.items() if name not in chosen})
    for number, (name, meta) in enumerate(parameters_of(cls).items()):
        default = next(f.default for f in dataclasses.fields(cls) if f.name == name)
        if name not in chosen and meta.fit and default == 0.0:
            value = _natural_scale(meta, size=size) * _SPREAD[number % 3]
            low, high = meta.bounds
            if not low <= value <= high:
                # the middle of the bounds, or some tolerances
                middle = 0.5 * (low + high)
                value = middle if middle != 0.0 else min(LARGE * meta.tolerance or high, high)
            chosen[name] = value
    return cls(**chosen)


def _natural_scale(meta: Parameter, *, size: float = 1.0) -> float:
    """Return a typical value of a unit for a small body; three tolerances for unknown units.

    Args:
        meta: of the parameter.
        size: mass of the body against a kilogramme [1].

    Example:
        >>> from seals.schema import parameters_of
        >>> meta = Parameter(
        ...     unit="N s^2/m^2",
        ...     bounds=(0.0, 9.0),
        ...     tolerance=0.0,
        ...     relative=False,
        ...     source="",
        ...     fit=True,
        ... )
        >>> round(_natural_scale(meta), 12)
        10.0
    """
    powers = [0.0, 0.0, 0.0]
    sign = 1
    for token in re.findall(r"/|[A-Za-z0-9]+(?:\^-?\d+)?", meta.unit):
        if token == "/":
            sign = -1
            continue
        symbol, _, power = token.partition("^")
        if symbol not in _UNITS:
            low, high = meta.bounds
            return min(3.0 * meta.tolerance or 0.1 * (high - low), 0.5 * (high - low))
        powers = [
            p + sign * int(power or 1) * u for p, u in zip(powers, _UNITS[symbol], strict=True)
        ]
    if powers == [0.0, 0.0, 0.0] and meta.tolerance > 0.0 and not meta.relative:
        return min(1.0, LARGE * meta.tolerance)
    share = size if powers[0] or powers[1] >= 2 else 1.0
    natural: float = math.prod(
        scale**p for scale, p in zip((MASS, LENGTH, TIME), powers, strict=True)
    )
    return share * _STATED.get(meta.unit, natural)
