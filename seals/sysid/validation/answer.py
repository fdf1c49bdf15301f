"""Answer of a diagnosis: its file, and choice of the effects to add."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeVar

from seals.config.overrides import typed
from seals.errors import ConfigError, LogError, refuse_unlisted
from seals.file_names import DIAGNOSIS
from seals.logs.native import TABLES
from seals.schema import Within, plain, read
from seals.sysid.candidates.activity import Moment
from seals.untrusted_io import read_bytes, read_json

KEY = "diagnosis"
"""Key by which a diagnosis is given."""
FORMULA = "formula"
"""Name of the effect of a formula, and the word that accepts it."""
_GIVING = ("named", "ambiguous")
"""Verdicts of an answer that gives something to add."""
_REFUSED = {
    "nothing_missing": "nothing is missing, so there is no effect to add",
    "none_of_these": "no effect of the library explains the log",
    "cannot_tell": "the log does not determine what is missing",
    "bad_data": "the log failed its data check",
}
T = TypeVar("T")
_Number = Annotated[float, Within(-1e30, 1e30)]
"""Numbers beyond are no measurement; the squares and cubes of these still are numbers."""
_Table = Annotated[Mapping[str, T], Within(0, 1024)]
"""Entries of the largest vehicle are some hundred."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Fitted parameter of an effect, or a word such as the form of its law; see docs/formats.md."""

    value: _Number | str
    low90: _Number | None = None
    high90: _Number | None = None


@dataclass(frozen=True, kw_only=True)
class ActiveSpan:
    """Part of a log, by its name, in which an effect acts; None for its first or last row."""

    log: str
    start: Moment | None
    end: Moment | None


@dataclass(frozen=True, kw_only=True)
class FoundEffect:
    """Effect of an answer; a link of a robot's folder has a name, that of a log a number."""

    name: str
    medium: str | None = None
    variant: Mapping[str, Any] = field(default_factory=dict)
    confidence: _Number = 0.0
    link: int | str | None = None
    parameters: _Table[Estimate] = field(default_factory=dict)
    nuisance: _Table[_Number] = field(default_factory=dict)
    active: Sequence[ActiveSpan] = ()


@dataclass(frozen=True, kw_only=True)
class DiagnosedLog:
    """Log of an answer, or several, with the SHA-256 of its table."""

    path: str = ""
    sha256: str | None = None
    logs: Sequence[DiagnosedLog] = ()


@dataclass(frozen=True, kw_only=True)
class AnswerModel:
    """Content of an overlay file, which `read_overlay` checks once it is complete."""

    effects: _Table[Mapping[str, Any]] = field(default_factory=dict)
    changes: _Table[Mapping[str, Any]] = field(default_factory=dict)
    wave: Mapping[str, Any] | None = None
    intervals: _Table[_Table[Sequence[_Number]]] = field(default_factory=dict)
    nominal: _Table[Mapping[str, Any]] = field(default_factory=dict)
    speeds: Sequence[_Number] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Law:
    """Effect of a formula."""

    name: str
    medium: str | None = None
    parameters: _Table[_Number]


@dataclass(frozen=True, kw_only=True)
class FoundFormula:
    """Formula of a force that no effect explains."""

    effect: Law
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class Covariance:
    """Covariance of the named parameters; None for what the log did not determine."""

    parameters: Sequence[str] = ()
    matrix: Sequence[Sequence[_Number | None]] = ()

    def __post_init__(self) -> None:
        """Refuse a matrix of another size than its names."""
        count, known = len(self.parameters), len(set(self.parameters))
        if any(len(rows) != count for rows in (self.matrix, *self.matrix)) or known != count:
            raise ValueError(f"matrix needs {count} rows of {count} numbers, each of its own name")


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What other commands read of ``diagnosis.json``; see docs/formats.md."""

    verdict: str = ""
    effects: Annotated[Sequence[FoundEffect], Within(0, 32)] = ()
    ambiguous_with: Sequence[Sequence[str]] = ()
    reasons: Sequence[str] = ()
    nominal: _Table[_Table[_Number | None]] = field(default_factory=dict)
    covariance: Covariance = field(default_factory=Covariance)
    formula: FoundFormula | None = None
    models: _Table[AnswerModel] | None = None
    log: DiagnosedLog = field(default_factory=DiagnosedLog)
    without: Sequence[str] = ()

    @property
    def tables(self) -> dict[str, str]:
        """Folder of each log with the SHA-256 of its table, see `logs_of`."""
        return logs_of({"log": plain(self.log)})


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Effects of a diagnosis that are to be added to the model.

    Args:
        file: the answer was read from.
        answer: all of it.
        effects: entries of the answer, in its order.
        chosen: whether the user picked one of several.
        formula: of an unnamed effect that the user accepts, or None.
    """

    file: Path
    answer: Answer
    effects: tuple[FoundEffect, ...]
    chosen: bool = False
    formula: FoundFormula | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        own = tuple(effect.name for effect in self.effects)
        return own if self.formula is None else (*own, FORMULA)


def load_answer(where: str | Path, *, key: str = KEY) -> tuple[Path, Answer]:
    """Return the file of a diagnosis, and its content.

    Args:
        where: folder of the diagnosis, or its file.
        key: that named it, for messages.

    Raises:
        ConfigError: there is no diagnosis, or it is damaged.
        LogError: its file may not be read.
    """
    path = Path(where)
    path = path / DIAGNOSIS if path.is_dir() else path
    if not path.is_file():
        raise ConfigError(
            f"{key}={where}: there is no {DIAGNOSIS}.\n"
            "Give the folder written by seals diagnose: seals diagnose log=FOLDER out=FOLDER"
        )
    try:
        raw = read_json(path)
        answer = read(Answer, raw, where=f"{path} is damaged:", extra=True)
    except LogError as cause:
        if isinstance(cause.__cause__, OSError):
            raise
        fault = str(cause).partition("\n")[0].rstrip(".")
        raise ConfigError(f"{fault}.\nDiagnose the log again.") from cause
    except ConfigError as cause:
        raise ConfigError(f"{str(cause).rstrip('.')}. Diagnose the log again.") from cause
    count = len(answer.effects)
    if answer.verdict not in (*_GIVING, *_REFUSED) or (answer.verdict in _GIVING and not count):
        raise ConfigError(
            f"{path} is damaged: verdict {answer.verdict!r:.40} with {count} effects.\n"
            "Diagnose the log again."
        )
    return path, answer


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
    path, answer = load_answer(where, key=key)
    verdict, law = answer.verdict, _formula(path, answer, accept)
    if verdict in _REFUSED and law is None:
        why = "; ".join(answer.reasons)
        advice = "Only the effects of a named or ambiguous answer can be added."
        if answer.formula is not None and answer.formula.text:
            found = answer.formula.text
            advice = f"Add the fitted formula with accept={FORMULA}: {found}"
        raise ConfigError(
            f"{path}: the verdict is {verdict}: {_REFUSED[verdict]}{f' ({why})' if why else ''}.\n"
            f"{advice}"
        )
    plan = f"seals plan {typed('diagnosis', str(where))}{robot}"
    return Finding(
        file=path,
        answer=answer,
        effects=() if law is not None else _chosen(answer, choose, key, plan),
        chosen=choose is not None,
        formula=law,
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
                f"the diagnosis names the log {place} without its checksum.\n"
                "Name its log: log=FOLDER"
            )
        if Path(place).exists() and log_digest(place) != digest:
            raise ConfigError(
                f"log={place} is not the log that was diagnosed: its content differs.\n"
                "Give the diagnosed log, or diagnose this one."
            )
    return list(logs)


def _formula(path: Path, answer: Answer, accept: str | None) -> FoundFormula | None:
    """The formula that the user accepts."""
    if accept is None:
        return None
    if accept != FORMULA:
        raise ConfigError(f"accept={accept} is not allowed.\nAllowed: accept={FORMULA}")
    if answer.verdict != "none_of_these" or answer.formula is None:
        raise ConfigError(
            f"accept={FORMULA}: {path} holds no formula, its verdict is {answer.verdict}.\n"
            "Leave accept= out; a formula is fitted only if no effect explains the log."
        )
    return answer.formula


def _chosen(answer: Answer, choose: str | None, key: str, plan: str) -> tuple[FoundEffect, ...]:
    names = [effect.name for effect in answer.effects]
    if choose is None:
        if answer.verdict == "ambiguous":
            own = f", or choose one yourself: choose={names[0]}" if key == KEY else ""
            raise ConfigError(
                f"the diagnosis is ambiguous: {' or '.join(names)}.\n"
                f"Plan a flight that distinguishes them ({plan}){own}"
            )
        return tuple(answer.effects)
    refuse_unlisted(choose, names, f"choose={choose}: the diagnosis does not contain it")
    return (answer.effects[names.index(choose)],)


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
