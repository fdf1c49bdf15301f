"""Checks of a plug-in's declaration: fields, parameters, docstring."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.contract import class_of, require
from seals.effects.effect import Effect
from seals.effects.hooks import HOOKS
from seals.schema import check_fields, parameters_of, vars_of

HEADINGS = (
    "Equation",
    "Args",
    "Assumptions",
    "Valid range",
    "Limitations",
    "References",
    "Example",
)
"""Headings of the docstring of a physical element, in order."""


def build_declared(
    kind: str, subject: str | type, values: Mapping[str, Any] | None, *, headings: bool = True
) -> tuple[str, Any]:
    """Check the declaration of a plug-in, and build it.

    Args:
        kind: of the plug-in, such as ``guide``.
        subject: name of an installed plug-in, or its class.
        values: fields; None for its defaults.
        headings: as for `check_declaration`.

    Returns:
        Its name and the plug-in.

    Raises:
        ContractError: the declaration breaks a rule.
        UnknownPlugin: nothing of that name is installed.
    """
    name, cls = class_of(kind, subject)
    check_declaration(name, cls, headings=headings)
    return name, cls(**(values or {}))


def check_declaration(name: str, cls: type, *, headings: bool = True) -> None:
    """Check the dataclass of a plug-in: fields, parameters, docstring.

    Args:
        name: named in refusals.
        cls: the class.
        headings: whether the docstring must hold all headings of a physical element.

    Raises:
        ContractError: a promise does not hold.
    """
    require(
        dataclasses.is_dataclass(cls),
        name,
        "is not a dataclass",
        "Write @dataclass(kw_only=True) above it.",
    )
    fields = [f for f in dataclasses.fields(typing.cast(Any, cls)) if f.init]
    loose = [f.name for f in fields if not f.kw_only]
    require(
        not loose,
        name,
        f"{', '.join(loose)} may be given by position",
        "Write @dataclass(kw_only=True).",
    )
    hints, declared = typing.get_type_hints(cls), parameters_of(cls)
    bare = [
        f.name for f in fields if hints[f.name] in (float, float | None) and f.name not in declared
    ]
    require(
        not bare,
        name,
        f"{', '.join(bare)} have no unit and bounds",
        "Declare them with seals.schema.param().",
    )
    check_fields(cls, vars_of(cls()), where=name)
    if headings:
        _check_docstring(name, cls)


def check_effect_declaration(name: str, cls: type) -> tuple[str, ...]:
    """Check the class of an effect and return the hooks it defines.

    Raises:
        ContractError: a promise does not hold.
    """
    require(issubclass(cls, Effect), name, "is not an effect", "Derive it from seals.Effect.")
    check_declaration(name, cls)
    hooks: tuple[str, ...] = tuple(hook for hook in HOOKS if hasattr(cls, hook))
    require(bool(hooks), name, "has no hook", f"Define one or more of: {', '.join(HOOKS)}.")
    bound = [h for h in hooks if not isinstance(inspect.getattr_static(cls, h), staticmethod)]
    require(
        not bound,
        name,
        f"{', '.join(bound)} can access the object",
        "Make hooks static methods, because they must be pure.",
    )
    if "drives" in hooks:
        # check that an actuator declares its columns, lags and limits
        actuator = cls()
        stated = ("first", "count", "lag", "limit")
        missing = [key for key in stated if not hasattr(actuator, key)]
        require(
            not missing,
            name,
            f"turns drives into thrust and does not define {', '.join(missing)}",
            "Give the properties first, count (columns of its drives), lag [s], limit, shape "
            "(count,).",
        )
        shapes = {key: np.shape(getattr(actuator, key)) for key in ("lag", "limit")}
        require(
            set(shapes.values()) == {(actuator.count,)},
            name,
            f"lag and limit have the shapes {list(shapes.values())} for {actuator.count} drives",
            f"Allowed: ({actuator.count},).",
        )
    owned = getattr(cls, "accounts_for", None)
    require(
        isinstance(owned, tuple) and all(isinstance(phenomenon, str) for phenomenon in owned),
        name,
        f"accounts_for={owned!r} is not a tuple of phenomena",
        "Name the phenomena of the effect, for instance ('quadratic drag',).",
    )
    return hooks


def _check_docstring(name: str, cls: type) -> None:
    """Check headings, and that every parameter is described with its unit."""
    text = inspect.getdoc(cls) or ""
    given = tuple(h for h in re.findall(r"^([A-Z][a-z ]+):", text, re.MULTILINE) if h in HEADINGS)
    require(
        given == HEADINGS,
        name,
        f"its docstring has the headings {', '.join(given) or '(none)'}",
        f"Allowed, in this order: {', '.join(HEADINGS)}.",
    )
    told_by = [text, *(inspect.getdoc(base) or "" for base in cls.__mro__[1:-1])]
    parts = [t.partition("Args:")[2].partition("Assumptions:")[0] for t in told_by]
    body = " ".join(" ".join(parts).split())
    for parameter, meta in parameters_of(cls).items():
        entry = re.search(rf"\b{parameter}: (.*?)(?= \w+: |$)", body)
        stated = entry is not None and (
            meta.unit == "1" or f"[{meta.unit}" in entry[1] or f"{meta.unit}]" in entry[1]
        )
        require(
            stated,
            name,
            f"its docstring does not describe {parameter}, in [{meta.unit}]",
            f"Add the line '{parameter}: what it is [{meta.unit}].' under Args.",
        )
