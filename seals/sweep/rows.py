"""Run folders as table rows: state, duration, overrides."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, SealsError
from seals.logs.run_folder import MOVING, alive, foreign_log, lockable
from seals.sweep.book import DONE, NOTE, Job, read_jobs
from seals.untrusted_io import plain_yaml, read_bytes, read_json

RUN, STATE, SECONDS = "run", "state", "seconds"
FIXED = (RUN, STATE, SECONDS)
"""Columns that every row has."""
RUNNING, INTERRUPTED = "running", "interrupted"
DAMAGED = "damaged"
"""State of a run whose notes cannot be read."""
_OVERRIDES = ".hydra/overrides.yaml"
_MOST = 1 << 24

Value = float | str | None


@dataclass(frozen=True, kw_only=True)
class Row:
    """Table row of one run.

    Args:
        folder: of the run; that of its sweep for a job that left nothing behind.
        values: of the columns in `FIXED`; None where unknown.
        words: value of every override by its key.
        facts: what the run noted of itself in ``run.json``.
        damage: which of its files cannot be read, and why; empty for none.
    """

    folder: Path
    values: Mapping[str, Value]
    words: Mapping[str, Value]
    facts: Mapping[str, Any] = field(default_factory=dict)
    damage: str = ""

    def get(self, key: str) -> Value:
        """Return a fixed column, an override, or one element of a list override."""
        if key in self.values:
            return self.values[key]
        if key in self.words:
            return self.words[key]
        stem, _, place = key.rpartition(".")
        listed = self.words.get(stem)
        return _place_of(listed, place) if place.isdigit() else None


def find_rows(folder: Path) -> list[Row]:
    """Return a row for every run below a folder, in the order of their names.

    Raises:
        ConfigError: there is no such folder, or no run in it.
    """
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise ConfigError(f"folder={folder} {what}.\nGive a folder with runs: seals runs runs")
    jobs = dict(_jobs(folder))
    places = {path.parent for path in folder.rglob("run.json")}
    places |= {path.parent.parent for path in folder.rglob(_OVERRIDES)}
    places = {place for place in places if place.name != MOVING}
    found = [_row(folder, place, jobs.get(place)) for place in places | set(jobs)]
    if not found:
        raise ConfigError(
            f"folder={folder}: there is no run in it.\n"
            "Run folders contain run.json or .hydra/overrides.yaml; try the parent folder."
        )
    return sorted(found, key=lambda row: _natural(str(row.values[RUN])))


def _jobs(folder: Path) -> Iterator[tuple[Path, Job]]:
    """Yield the jobs of all sweeps at, below or above a folder, with the folders of their runs."""
    for note in (*folder.rglob(NOTE), folder.parent / NOTE):
        for number, job in read_jobs(note.parent).items():
            place = note.parent / str(number)
            if place == folder or folder in place.parents:
                yield place, job


def _row(root: Path, place: Path, job: Job | None) -> Row:
    facts: dict[str, Any] = {}
    words, damage = list(job.words) if job is not None else [], ""
    try:
        path = place / "run.json"
        facts = read_json(path, most=_MOST) if os.path.lexists(path) else {}
        facts = facts if isinstance(facts, dict) else {}
        words = words or _words(place, facts)
        damage = foreign_log(place)
    except SealsError as cause:
        # one run that a kill or a full disk tore does not hide the others
        damage = " ".join(str(cause).split())
    seconds = facts.get(SECONDS) if job is None else job.seconds
    state = _state(place, facts) if job is None else job.state
    name = str(place.relative_to(root)) if place != root else place.name
    values: dict[str, Value] = {RUN: name, STATE: DAMAGED if damage else state}
    values[SECONDS] = float(seconds) if isinstance(seconds, int | float) else None
    pairs: dict[str, Value] = {}
    for word in words:
        key, sign, value = word.partition("=")
        pairs[key.lstrip("+") if sign else word] = read_value(value) if sign else ""
    return Row(folder=place, values=values, words=pairs, facts=facts, damage=damage)


def _state(place: Path, facts: Mapping[str, Any]) -> str:
    """Return the state of a run; "running" without a process counts as interrupted."""
    # diagnose, compare and their like write their answer in the end, and no record of a run
    answered = STATE not in facts and any(place.glob("*.json"))
    state, lives = str(facts.get(STATE, DONE if answered else "begun")), alive(place)
    if state == RUNNING and not lives and lockable():
        return INTERRUPTED
    return INTERRUPTED if state == "begun" and lives is False else state


def _words(place: Path, facts: Mapping[str, Any]) -> list[str]:
    import yaml

    path, found = place / _OVERRIDES, facts.get("overrides")
    # Hydra's note is empty where there was no room for it: that run never began
    if path.is_file() and (facts or path.stat().st_size > 0):
        try:
            found = plain_yaml(read_bytes(path, most=_MOST).decode("utf-8", "replace"))
        except yaml.YAMLError as cause:
            text = " ".join(str(cause).split())
            raise ConfigError(f"{path} is damaged: {text}.\nRestore it, or remove it.") from cause
    return [str(word) for word in found] if isinstance(found, list) else []


def _place_of(value: Value, place: str) -> Value:
    """Return one element of a value that is a list; None for others.

    Example:
        >>> _place_of("[0, 0, 1]", "2"), _place_of("[[1,2],[3,4]]", "1"), _place_of(0.5, "0")
        (1.0, '[3,4]', None)
    """
    if not (isinstance(value, str) and value.startswith("[") and value.endswith("]")):
        return None
    found = parts(value[1:-1])
    return read_value(found[int(place)]) if int(place) < len(found) else None


def column_of(columns: Mapping[str, Sequence[Value]], key: str) -> Sequence[Value] | None:
    """Return a column, or one element of a column of lists; None where there is neither."""
    stem, _, place = key.rpartition(".")
    if key not in columns and stem in columns and place.isdigit():
        return [_place_of(value, place) for value in columns[stem]]
    return columns.get(key)


def read_value(text: str) -> Value:
    """Return a number where the text is one.

    Example:
        >>> read_value("0.5"), read_value("[0,1]"), read_value("ball")
        (0.5, '[0,1]', 'ball')
    """
    text = text.strip().strip("'\"")
    try:
        return float(text)
    except ValueError:
        return text


def differing_keys(rows: Sequence[Row]) -> list[str]:
    """Return the overrides that differ between runs, in the order of first use."""
    keys = dict.fromkeys(key for row in rows for key in row.words)
    return [key for key in keys if len({row.words.get(key) for row in rows}) > 1]


def shared_words(rows: Sequence[Row]) -> list[str]:
    """Return the overrides that all runs share, as they are written."""
    different = set(differing_keys(rows))
    return [
        f"{key}={written(value)}" for key, value in rows[0].words.items() if key not in different
    ]


def written(value: Value) -> str:
    """Return the value of an override with all its digits.

    Example:
        >>> written(12346.0), written(0.1), written("[0,0,1.0]"), written(None)
        ('12346', '0.1', '[0,0,1.0]', '-')
    """
    return repr(value).removesuffix(".0") if isinstance(value, float) else shown(value)


def shown(value: Value) -> str:
    """Format a metric for a table.

    Example:
        >>> shown(3.0), shown(0.123456), shown(None)
        ('3', '0.1235', '-')
    """
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.4g}"


def _natural(name: str) -> list[tuple[int, float, str]]:
    """Return a key that puts 2 before 10."""
    parts = re.split(r"(\d+)", name)
    return [(0, float(part), "") if part.isdigit() else (1, 0.0, part) for part in parts]


def parts(text: str) -> list[str]:
    """Split a text at commas outside brackets and braces.

    Example:
        >>> parts("seed<5, p=[[1,2],[3,4]]"), parts("")
        (['seed<5', ' p=[[1,2],[3,4]]'], [])
    """
    found, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "[{(") - (letter in ")}]")
        if letter == "," and depth == 0:
            found.append(text[start:at])
            start = at + 1
    return [part for part in [*found, text[start:]] if part.strip()]
