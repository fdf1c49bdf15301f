"""Form of the entries in a diagnosis file: kinds of values that other commands count on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_LARGEST = 1e30
"""Numbers beyond it are no measurement; their squares and cubes still are numbers."""
_MOST_EFFECTS = 32
"""Effects of an answer: each may have a variant for every rotor, and all are tried together."""
_MOST_ENTRIES = 1024
"""Entries of a section of a model: nominal values of the largest vehicle are some hundred."""
_MOMENT = {"value", "low90", "high90"}


def refuse_damaged(answer: Any) -> None:
    """Refuse the content of a diagnosis file whose entries are of other kinds than it writes.

    Raises:
        ValueError: it says which entry, and what belongs there.

    Example:
        >>> refuse_damaged({"verdict": "named", "effects": [{"name": "wind", "parameters": 3}]})
        Traceback (most recent call last):
        ValueError: effects[0].parameters is a int, a mapping belongs there
    """
    _kind(answer, Mapping, "the file")
    effects = _kind(answer.get("effects") or [], list, "effects")
    if len(effects) > _MOST_EFFECTS:
        raise ValueError(f"it holds {len(effects)} effects, at most {_MOST_EFFECTS} are allowed")
    for k, effect in enumerate(effects):
        _effect(_kind(effect, Mapping, f"effects[{k}]"), f"effects[{k}]")
    for key in ("log", "nominal", "formula"):
        _kind(answer.get(key) or {}, Mapping, key)
    log = answer.get("log") or {}
    _kind(log.get("path") or "", str, "log.path")
    for k, part in enumerate(_kind(log.get("logs") or [], list, "log.logs")):
        _kind(_kind(part, Mapping, f"log.logs[{k}]").get("path"), str, f"log.logs[{k}].path")
    for k, name in enumerate(_kind(answer.get("without") or [], list, "without")):
        _kind(name, str, f"without[{k}]")
    for key, entry in (answer.get("nominal") or {}).items():
        for name, value in _kind(entry, Mapping, f"nominal.{key}").items():
            # null stands for what the log did not determine
            _number(0.0 if value is None else value, f"nominal.{key}.{name}")
    for k, names in enumerate(_kind(answer.get("ambiguous_with") or [], list, "ambiguous_with")):
        _kind(names, list, f"ambiguous_with[{k}]")
    if answer.get("covariance"):
        _covariance(_kind(answer["covariance"], Mapping, "covariance"))
    for name, model in _kind(answer.get("models") or {}, Mapping, "models").items():
        _model(_kind(model, Mapping, f"models.{name}"), f"models.{name}")
    if answer.get("formula"):
        _law(answer["formula"], "formula")


def _model(model: Mapping[str, Any], where: str) -> None:
    """Sections of an overlay; what their entries say is checked where they are read as one."""
    for section in ("effects", "changes", "intervals", "nominal"):
        entries = _kind(model.get(section) or {}, Mapping, f"{where}.{section}")
        if len(entries) > _MOST_ENTRIES:
            raise ValueError(f"{where}.{section} holds {len(entries)} entries")
        for name, entry in entries.items():
            place = f"{where}.{section}.{name}"
            for key, ends in _kind(entry, Mapping, place).items():
                if section == "intervals":
                    for end in _kind(ends, list, f"{place}.{key}"):
                        _number(end, f"{place}.{key}")
    for section in ("wave", "provenance"):
        _kind(model.get(section) or {}, Mapping, f"{where}.{section}")


def _effect(effect: Mapping[str, Any], where: str) -> None:
    _kind(effect.get("name"), str, f"{where}.name")
    _kind(effect.get("medium") or "", str, f"{where}.medium")
    _kind(effect.get("variant") or {}, Mapping, f"{where}.variant")
    _number(effect.get("confidence") or 0.0, f"{where}.confidence")
    if not isinstance(effect.get("link"), str):  # of a robot's folder by its name
        _kind(effect.get("link") or 0, int, f"{where}.link")
    for key, entry in _kind(effect.get("parameters") or {}, Mapping, f"{where}.parameters").items():
        place = f"{where}.parameters.{key}"
        value = _kind(entry, Mapping, place).get("value")
        if not isinstance(value, str):
            _number(value, f"{place}.value")
        for end in _MOMENT & set(entry) - {"value"}:
            if entry[end] is not None:
                _number(entry[end], f"{place}.{end}")
    for key, value in _kind(effect.get("nuisance") or {}, Mapping, f"{where}.nuisance").items():
        _number(value, f"{where}.nuisance.{key}")
    for k, span in enumerate(_kind(effect.get("active", []), list, f"{where}.active")):
        _span(_kind(span, Mapping, f"{where}.active[{k}]"), f"{where}.active[{k}]")


def _span(span: Mapping[str, Any], where: str) -> None:
    """Part of a log in which an effect acts."""
    _kind(span.get("log"), str, f"{where}.log")
    for end in ("start", "end"):
        moment = span.get(end, ...)
        if moment is None:
            continue
        if set(_kind(moment, Mapping, f"{where}.{end}")) != _MOMENT:
            raise ValueError(f"{where}.{end} needs {', '.join(sorted(_MOMENT))}")
        for key, value in moment.items():
            _number(value, f"{where}.{end}.{key}")


def _covariance(given: Mapping[str, Any]) -> None:
    """Joint covariance of the parameters."""
    names = _kind(given.get("parameters"), list, "covariance.parameters")
    for k, name in enumerate(names):
        _kind(name, str, f"covariance.parameters[{k}]")
    rows = _kind(given.get("matrix"), list, "covariance.matrix")
    sizes = {len(_kind(row, list, f"covariance.matrix[{k}]")) for k, row in enumerate(rows)}
    if len(rows) != len(names) or len(set(names)) != len(names) or sizes - {len(names)}:
        raise ValueError(f"covariance.matrix needs {len(names)} rows of {len(names)} numbers")
    for k, row in enumerate(rows):
        for i, value in enumerate(row):
            # null stands for what the log did not determine
            _number(0.0 if value is None else value, f"covariance.matrix[{k}][{i}]")


def _law(formula: Mapping[str, Any], where: str) -> None:
    """Formula of an unnamed effect, which the user may accept."""
    law = _kind(formula.get("effect"), Mapping, f"{where}.effect")
    _kind(law.get("name"), str, f"{where}.effect.name")
    _kind(law.get("medium") or "", str, f"{where}.effect.medium")
    table = _kind(law.get("parameters"), Mapping, f"{where}.effect.parameters")
    for key, value in table.items():
        _number(value, f"{where}.effect.parameters.{key}")


def _kind(value: Any, kind: Any, where: str) -> Any:
    if isinstance(value, kind):
        return value
    wanted = "mapping" if kind is Mapping else {str: "text", int: "whole number"}.get(kind, "list")
    raise ValueError(f"{where} is a {type(value).__name__}, a {wanted} belongs there")


def _number(value: Any, where: str) -> None:
    whole = isinstance(value, int | float) and not isinstance(value, bool)
    # compared, not converted: a whole number may have hundreds of digits
    if not (whole and -_LARGEST < value < _LARGEST):
        raise ValueError(f"{where} is {value!r:.60}, a finite number belongs there")
