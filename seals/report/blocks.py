"""Blocks of a report page: sections, charts, tables, key figures and text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from seals.report.bars import Bars
from seals.report.figures import Chart


@dataclass(frozen=True, kw_only=True)
class Paragraph:
    """Paragraph of text; ``tone``: ``""``, ``"good"``, ``"warn"``, ``"bad"`` or ``"caption"``."""

    text: str
    tone: str = ""
    large: bool = False
    kind: str = field(default="paragraph", init=False)


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Key figures with captions: ``{"first touch of water": "0.42 s"}``."""

    values: Mapping[str, str]
    kind: str = field(default="facts", init=False)


@dataclass(frozen=True, kw_only=True)
class Table:
    """Table with a header; columns listed in ``right`` are right-aligned."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: Sequence[int] = ()
    kind: str = field(default="table", init=False)


@dataclass(frozen=True, kw_only=True)
class Code:
    """Preformatted text."""

    text: str
    kind: str = field(default="code", init=False)


@dataclass(frozen=True, kw_only=True)
class Fold:
    """Collapsible blocks, for details."""

    title: str
    blocks: Sequence[Block]
    kind: str = field(default="fold", init=False)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Groups of blocks, one visible at a time, chosen by name."""

    label: str
    options: Mapping[str, Sequence[Block]]
    kind: str = field(default="choice", init=False)


Block: TypeAlias = "Chart | Bars | Paragraph | Facts | Table | Code | Fold | Choice"


@dataclass(frozen=True, kw_only=True)
class Section:
    """A titled part of a page; ``wide`` gives each chart a row of its own."""

    title: str
    blocks: Sequence[Block]
    lead: str = ""
    wide: bool = False
