"""Report page: one self-contained HTML file of sections, with charts, tables, figures and text."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from seals.drawn_text import readable
from seals.logs.atomic import write_text
from seals.report.bars import Bars, Columns, drawn, drawn_bars
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


def page(
    title: str,
    sections: Sequence[Section],
    *,
    subtitle: str = "",
    badge: str = "",
    light: bool = False,
) -> str:
    """Return a self-contained HTML page.

    Args:
        title: heading and title of the browser's tab.
        sections: parts in order.
        subtitle: one line below the heading.
        badge: a word beside the heading, such as ``done`` or ``failed``.
        light: whether the page stays light where the reader's system is dark.

    Example:
        >>> from seals.report.page import Paragraph
        >>> text = page("Drop", [Section(title="Words", blocks=[Paragraph(text="1 < 2")])])
        >>> "1 &lt; 2" in text, "http" in text.split("<main")[1].split("</main")[0]
        (True, False)
    """
    charts = [chart for section in sections for chart in _charts(section.blocks)]
    # counted as they are laid out: a chart may stand on a page twice
    numbers = itertools.count()
    return readable(
        _template().render(
            title=title,
            subtitle=subtitle,
            badge=badge,
            light=light,
            sections=sections,
            kind=lambda block: getattr(block, "kind", "chart"),
            number=lambda: next(numbers),
            figures=_script_safe(_figures(charts)) if charts else "",
            script=_text_of("charts.js") if charts else "",
        )
    )


def write_page(
    path: str | Path,
    title: str,
    sections: Sequence[Section],
    *,
    subtitle: str = "",
    badge: str = "",
    light: bool = False,
) -> Path:
    """Write a page to a file, atomically; arguments as for :func:`page`."""
    write_text(path, page(title, sections, subtitle=subtitle, badge=badge, light=light))
    return Path(path)


def _charts(blocks: Sequence[Block]) -> Iterator[Chart | Bars]:
    for block in blocks:
        if isinstance(block, Chart | Bars):
            yield block
        elif isinstance(block, Fold):
            yield from _charts(block.blocks)
        elif isinstance(block, Choice):
            for group in block.options.values():
                yield from _charts(group)


def _figures(charts: Sequence[Chart | Bars]) -> dict[str, Any]:
    """All charts of a page, and the columns of numbers that they share."""
    columns = Columns()
    made = [drawn_bars(c) if isinstance(c, Bars) else drawn(c, columns) for c in charts]
    return {"arrays": columns.texts, "charts": made}


def _script_safe(value: Any) -> str:
    """Return JSON in which ``</script>`` in a name cannot end the script element."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@lru_cache(maxsize=1)
def _template() -> Any:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string(_text_of("page.html.jinja"))


def _text_of(name: str) -> str:
    """The text of a file beside this module."""
    return (files("seals.report") / name).read_text(encoding="utf-8")
