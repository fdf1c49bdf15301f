"""Form of the entries in a diagnosis file: kinds of values that other commands count on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_LARGEST = 1e30
"""Numbers beyond it are no measurement; their squares and cubes still are numbers."""
_MOST_EFFECTS, _MOST_ENTRIES = 32, 1024
"""Effects of an answer, and entries of a mapping: those of the largest vehicle are some hundred."""
_NUMBER, _TOLD, _ANY = "number", "number or null", "anything"
"""Null stands for what the log did not determine."""
_EACH = "each"
"""Key that stands for all keys of a mapping."""
_NULL = type(None)
_MOMENT = {"value!": _NUMBER, "low90!": _NUMBER, "high90!": _NUMBER}
_EFFECT = {
    "name!": str,
    "medium": str,
    "variant": {},
    "confidence": _NUMBER,
    "link": (str, int),  # of a robot's folder by its name
    "parameters": {_EACH: {"value!": (str, _NUMBER), "low90?": _TOLD, "high90?": _TOLD}},
    "nuisance": {_EACH: _NUMBER},
    "active?": [{"log!": str, "start!": (_NULL, _MOMENT), "end!": (_NULL, _MOMENT)}],
}
_MODEL = {
    "effects": {_EACH: {}},
    "changes": {_EACH: {}},
    "wave": {},
    "intervals": {_EACH: {_EACH: [_NUMBER]}},
    "nominal": {_EACH: {}},
    "provenance": {},
}
_LAW = {"name!": str, "medium": str, "parameters!": {_EACH: _NUMBER}}
_ANSWER = {
    "effects": [_EFFECT],
    "log": {"path": str, "logs": [{"path!": str}]},
    "without": [str],
    "nominal": {_EACH: {_EACH: _TOLD}},
    "ambiguous_with": [[_ANY]],
    "covariance": {"parameters!": [str], "matrix!": [[_TOLD]]},
    "models": {_EACH: _MODEL},
    "formula": {"effect!": _LAW},
}


def refuse_damaged(answer: Any) -> None:
    """Refuse the content of a diagnosis file whose entries are of other kinds than it writes.

    Raises:
        ValueError: it says which entry, and what belongs there.

    Example:
        >>> refuse_damaged({"verdict": "named", "effects": [{"name": "wind", "parameters": 3}]})
        Traceback (most recent call last):
        ValueError: effects[0].parameters is a int, a mapping belongs there
    """
    check_form(_kind(answer, Mapping, "the file"), _ANSWER, "")
    effects, covariance = answer.get("effects") or [], answer.get("covariance")
    if len(effects) > _MOST_EFFECTS:
        raise ValueError(f"it holds {len(effects)} effects, at most {_MOST_EFFECTS} are allowed")
    if covariance:
        names, rows = covariance["parameters"], covariance["matrix"]
        if (
            len(rows) != len(names)
            or len(set(names)) != len(names)
            or any(len(row) != len(names) for row in rows)
        ):
            raise ValueError(f"covariance.matrix needs {len(names)} rows of {len(names)} numbers")


def check_form(value: Any, form: Any, where: str) -> None:
    """Refuse a value of another form.

    Args:
        value: what stands there.
        form: a type; `_NUMBER`, `_TOLD` or `_ANY`; ``[form]`` for a list; keys with their forms for
            a mapping; a type and a form for either of both. A key ends in ``!`` where it must be
            there, in ``?`` where all that is there must fit; else what is empty counts as absent.
        where: in the file.

    Raises:
        ValueError: it says where, and what belongs there.
    """
    if isinstance(form, tuple):
        if isinstance(value, form[0]):
            return
        form = form[1]
    if isinstance(form, type):
        _kind(value, form, where)
    elif isinstance(form, list):
        for k, one in enumerate(_kind(value, list, where)):
            check_form(one, form[0], f"{where}[{k}]")
    elif isinstance(form, dict):
        _check_mapping(_kind(value, Mapping, where), form, where)
    elif form == _NUMBER or (form == _TOLD and value is not None):
        whole = isinstance(value, int | float) and not isinstance(value, bool)
        # compared, not converted: a whole number may have hundreds of digits
        if not (whole and -_LARGEST < value < _LARGEST):
            raise ValueError(f"{where} is {value!r:.60}, a finite number belongs there")


def _check_mapping(value: Mapping[str, Any], form: Mapping[str, Any], where: str) -> None:
    if len(value) > _MOST_ENTRIES:
        raise ValueError(f"{where} holds {len(value)} entries, at most {_MOST_ENTRIES} are allowed")
    if form is _MOMENT and set(value) != {"value", "low90", "high90"}:
        raise ValueError(f"{where} needs high90, low90, value")
    if _EACH in form:
        for key, one in value.items():
            check_form(one, form[_EACH], f"{where}.{key}")
        return
    for key, inner in form.items():
        name = key.rstrip("!?")
        # where null is allowed, what is missing is not
        absent = ... if isinstance(inner, tuple) and inner[0] is _NULL else None
        if key.endswith("!") or (key.endswith("?") and name in value) or value.get(name):
            check_form(value.get(name, absent), inner, f"{where}.{name}" if where else name)


def _kind(value: Any, kind: Any, where: str) -> Any:
    if isinstance(value, kind):
        return value
    wanted = "mapping" if kind is Mapping else {str: "text", int: "whole number"}.get(kind, "list")
    raise ValueError(f"{where} is a {type(value).__name__}, a {wanted} belongs there")
