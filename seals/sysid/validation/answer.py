"""Reading of a diagnosis file, and choice of the effects to add."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.config.overrides import typed
from seals.errors import ConfigError, LogError, suggestion
from seals.logs.native import TABLES
from seals.sysid.validation.answer_form import refuse_damaged
from seals.untrusted_io import read_bytes, read_json

ANSWER = "diagnosis.json"
KEY = "diagnosis"
"""Key by which a diagnosis is given."""
FORMULA = "formula"
"""Name of the effect of a formula, and the word that accepts it."""
_GIVING = ("named", "ambiguous")
"""Verdicts of an answer that gives something to add."""
_REFUSED = {
    "nothing_missing": "nothing is missing, so there is nothing to add",
    "none_of_these": "no effect of the library explains the log",
    "cannot_tell": "the log could not show what is missing",
    "bad_data": "the log failed its data check",
}


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Effects of a diagnosis that are to be added to the model.

    Args:
        file: the answer was read from.
        effects: entries of the answer, in its order.
        verdict: of the answer.
        chosen: whether the user picked one of several.
        logs: folder of each log as the answer names it, with the SHA-256 of its table, empty where
            it is not known; none when it does not name them.
        without: effects that were left out of the nominal model.
        nominal: fitted nominal values by parameter key, when the answer holds them.
        covariance: ``parameters`` and ``matrix`` of all of them, when the answer holds them.
        formula: entry of an unnamed effect that the user accepts, or None.
        models: contents of overlay files by the names of their effects, see `models_of`; none in an
            answer of an earlier version.
    """

    file: Path
    effects: tuple[Mapping[str, Any], ...]
    verdict: str
    chosen: bool
    logs: Mapping[str, str]
    nominal: Mapping[str, Mapping[str, float]]
    covariance: Mapping[str, Any] = field(default_factory=dict)
    formula: Mapping[str, Any] | None = None
    without: tuple[str, ...] = ()
    models: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        own = tuple(str(e["name"]) for e in self.effects)
        return own if self.formula is None else (*own, FORMULA)


def read_answer(
    where: str | Path,
    *,
    choose: str | None = None,
    accept: str | None = None,
    key: str = KEY,
    robot: str = "",
) -> Finding:
    """Read a diagnosis and choose the effects to add.

    Args:
        where: folder of the diagnosis, or its file.
        choose: which one of an ambiguous set.
        accept: ``formula`` for the formula found in place of a named effect.
        key: that named it, for messages.
        robot: words that give the robot, for the command of a message.

    Raises:
        ConfigError: there is no diagnosis, or its verdict gives nothing to add.
    """
    path = Path(where)
    path = path / ANSWER if path.is_dir() else path
    if not path.is_file():
        raise ConfigError(
            f"{key}={where}: there is no {ANSWER}.\n"
            "Give the folder that seals diagnose wrote: seals diagnose log=FOLDER out=FOLDER"
        )
    try:
        raw = read_json(path)
        refuse_damaged(raw)
        verdict, effects = str(raw["verdict"]), list(raw["effects"])
        names = [str(effect["name"]) for effect in effects]
        if verdict not in (*_GIVING, *_REFUSED) or (verdict in _GIVING and not names):
            raise ValueError(f"verdict {verdict!r:.40} with {len(names)} effects")
        why = "; ".join(str(reason) for reason in raw.get("reasons") or ())
        nominal = {
            key: {name: value for name, value in fitted.items() if value is not None}
            for key, fitted in (raw.get("nominal") or {}).items()
        }
        text = str((raw.get("formula") or {}).get("text", ""))
    except LogError as cause:
        fault = str(cause).partition("\n")[0].rstrip(".")
        raise ConfigError(f"{fault}.\nDiagnose the log again.") from cause
    except (OSError, AttributeError, ValueError, KeyError, TypeError) as cause:
        raise ConfigError(f"{path} is damaged: {cause}.\nDiagnose the log again.") from cause
    law = _formula(path, raw, verdict, accept)
    if verdict in _REFUSED and law is None:
        advice = "Only the effects of a named or ambiguous answer can be added."
        if text:
            advice = f"Take the formula found for it with accept={FORMULA}: {text}"
        raise ConfigError(
            f"{path}: the verdict is {verdict}: {_REFUSED[verdict]}{f' ({why})' if why else ''}.\n"
            f"{advice}"
        )
    plan = f"seals plan {typed('diagnosis', str(where))}{robot}"
    return Finding(
        file=path,
        effects=() if law is not None else _chosen(effects, verdict, choose, key, plan),
        verdict=verdict,
        chosen=choose is not None,
        logs=logs_of(raw),
        # the nominal values of an answer are those beside its first effect
        nominal=nominal if choose in (None, *names[:1]) else {},
        # so does the covariance: entries of another choice have other numbers
        covariance=dict(raw.get("covariance") or {}) if choose is None else {},
        formula=law,
        without=tuple(raw.get("without") or ()),
        models=raw.get("models") or {},
    )


def logs_of(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the paths of the logs of an answer, with the SHA-256 of each; empty if unknown.

    Example:
        >>> logs_of({"log": {"logs": [{"path": "/a", "sha256": "0f"}, {"path": "/b"}]}})
        {'/a': '0f', '/b': ''}
    """
    log = answer.get("log") or {}
    every = log.get("logs") or [log]
    return {str(one["path"]): str(one.get("sha256") or "") for one in every if one.get("path")}


def noted_logs(logs: Mapping[str, str]) -> list[str]:
    """Return the paths that an answer notes, where each has the content that it notes, too.

    By a path alone, a stranger's answer would choose what is read.

    Args:
        logs: paths with the SHA-256 of each table, as `logs_of` returns them.

    Raises:
        ConfigError: no checksum is noted, or the content is another one.
    """
    for place, digest in logs.items():
        if not digest:
            raise ConfigError(
                f"the diagnosis notes the log {place} without its checksum.\n"
                "Say yourself which log it is of: log=FOLDER"
            )
        if Path(place).exists() and log_digest(place) != digest:
            raise ConfigError(
                f"log={place} is not the log that was diagnosed: its content differs.\n"
                "Give the very log, or diagnose this one."
            )
    return list(logs)


def _formula(
    path: Path, raw: Mapping[str, Any], verdict: str, accept: str | None
) -> Mapping[str, Any] | None:
    """The formula that the user accepts."""
    if accept is None:
        return None
    if accept != FORMULA:
        raise ConfigError(f"accept={accept} is not allowed.\nAllowed: accept={FORMULA}")
    if verdict != "none_of_these" or not raw.get("formula"):
        raise ConfigError(
            f"accept={FORMULA}: {path} holds no formula, its verdict is {verdict}.\n"
            "Leave accept= out; a formula is found only when no effect explains the log."
        )
    law: Mapping[str, Any] = raw["formula"]
    return law


def _chosen(
    effects: Sequence[Mapping[str, Any]], verdict: str, choose: str | None, key: str, plan: str
) -> tuple[Mapping[str, Any], ...]:
    names = [str(e["name"]) for e in effects]
    if choose is None:
        if verdict == "ambiguous":
            own = f", or take one on your own judgement: choose={names[0]}" if key == KEY else ""
            raise ConfigError(
                f"the diagnosis is ambiguous: {' or '.join(names)}.\n"
                f"Plan a flight that tells them apart ({plan}){own}"
            )
        return tuple(effects)
    if choose not in names:
        raise ConfigError(
            f"choose={choose}: the diagnosis does not hold it.\n{suggestion(choose, names)}"
        )
    return (effects[names.index(choose)],)


def log_digest(folder: str | Path) -> str:
    """Return the SHA-256 of a log's table.

    Raises:
        LogError: there is no table.
    """
    place = Path(folder)
    if place.name in TABLES and place.is_file():
        place = place.parent
    table = next((place / n for n in TABLES if (place / n).is_file()), None)
    if table is None:
        raise LogError(f"'{place}' holds neither {TABLES[0]} nor {TABLES[1]}.")
    return hashlib.sha256(read_bytes(table)).hexdigest()
