"""Columns of recordings by topic and field, and their merge into one log."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.field_roles import roles
from seals.logs.column_map import ColumnMap
from seals.logs.log import Log
from seals.logs.merge import Stream, merge
from seals.plugins.readers.mapped import ReaderMapped


def by_topic(chosen: ColumnMap) -> dict[str, dict[str, str]]:
    """Return the wanted fields of each topic: topic -> field -> column of the log.

    Raises:
        LogError: a key has no topic, names the time, or a unit belongs to nothing.

    Example:
        >>> by_topic(ColumnMap(columns={"/imu/orientation.x": "orientation_x"}))
        {'/imu': {'orientation.x': 'orientation_x'}}
    """
    found: dict[str, dict[str, str]] = {}
    for key, column in chosen.columns.items():
        topic, _, field = key.rpartition("/")
        if not topic or not field:
            raise LogError(f"columns: '{key}' names no field.\nWrite TOPIC/FIELD: column.")
        if column in ("t", "segment"):
            raise LogError(f"columns: '{key}' cannot be '{column}': it comes from the time stamps.")
        found.setdefault(topic, {})[field] = column
    chosen.refuse_stray()
    return found


def refuse_unknown(wanted: Iterable[str], present: Collection[str], *, where: str) -> None:
    """Refuse topics that the file does not hold.

    Raises:
        LogError: one is absent; a field within a field after a slash is shown with its dot.
    """
    for name in wanted:
        topic, _, field = name.rpartition("/")
        if name not in present and topic in present:
            raise LogError(
                f"'{where}' has no topic '{name}'.\n"
                f"A field within a field is written with a dot: {topic}/{field}.NAME"
            )
        refuse_unlisted(
            name, present, f"'{where}' has no topic '{name}'", label="Topics", error=LogError
        )


def vector(stem: str, values: Floats) -> dict[str, Floats]:
    """Return the columns of a vector channel, from shape (samples, 3)."""
    return {f"{stem}_{axis}": values[:, k] for k, axis in enumerate("xyz")}


def finished(
    streams: Sequence[Stream], path: Path, *, meta: Mapping[str, Any], name: str, licence: str
) -> Log:
    """Return the one log of a recording; columns without a single sample are left out.

    Raises:
        LogError: nothing usable is in it.
    """
    held = [
        Stream(
            name=stream.name,
            stamps=stream.stamps,
            columns={
                key: values
                for key, values in stream.columns.items()
                if bool(np.isfinite(values).any())
            },
        )
        for stream in streams
    ]
    columns, start = merge(held, where=str(path))
    return Log(
        name=name or path.name.split(".")[0],
        columns=columns,
        meta={"recording": {"file": path.name, "start": start * 1e-6}, **meta},
        source=str(path),
        licence=licence,
    )


@roles(data="topics")
@dataclass(kw_only=True)
class ReaderTopics(ReaderMapped):
    """Base of readers of logs by topic: known topics automatically, other fields by the map.

    Args:
        topics: known topics to read; empty for all.
    """

    topics: list[str] = field(default_factory=list)

    def log_of(
        self,
        given: Path,
        present: Collection[str],
        chosen: ColumnMap,
        *,
        field_of: Callable[[str, str], Floats],
        stamps_of: Callable[[str], NDArray[np.int64]],
        known: Mapping[str, Callable[[str], Iterable[Stream]]],
        meta: Mapping[str, Any],
    ) -> Log:
        """Return the log of one file.

        Args:
            given: the file.
            present: its topics.
            chosen: map of the columns, which comes before the known topics.
            field_of: numbers of a field of a topic, shape (samples,).
            stamps_of: stamps of a topic [us], shape (samples,).
            known: streams of each known topic, the preferred one first where two give the same
                channel.
            meta: what the file says; the reader's own rules over it.

        Raises:
            LogError: a topic or field is absent, or nothing usable is in the file.
        """
        wanted = by_topic(chosen)
        refuse_unknown([*self.topics, *wanted], present, where=str(given))
        streams = [
            Stream(
                name=topic,
                stamps=stamps_of(topic),
                columns={
                    ours: chosen.converted(field_of(topic, name), f"{topic}/{name}", ours)
                    for name, ours in fields.items()
                },
            )
            for topic, fields in wanted.items()
        ]
        taken = set(self.columns.values())
        for topic, make in known.items():
            if topic in present and (not self.topics or topic in self.topics):
                for stream in make(topic):
                    left = {k: v for k, v in stream.columns.items() if k not in taken}
                    streams.append(replace(stream, columns=left))
                    taken |= left.keys()
        whole = {**meta, **self.meta}
        return finished(streams, given, meta=whole, name=self.name, licence=self.licence)
