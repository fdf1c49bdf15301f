"""Docstrings of plug-ins, taken apart: a summary, then sections under headings of their own."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field

_HEADING = re.compile(r"^([A-Z][A-Za-z ]*):$")
_ARGUMENT = re.compile(r"^(\w+): (.*)$")
_AS_PRINTED = ("Equation", "Example")
"""Sections whose line breaks and signs must stay."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """What a docstring says.

    Args:
        summary: everything before the first heading, as Markdown.
        sections: text of each section by its heading, in order, without its indent.
    """

    summary: str
    sections: dict[str, str] = field(default_factory=dict)

    def section(self, name: str) -> str:
        """Return one section as Markdown under a bold heading."""
        text = self.sections[name]
        if name not in _AS_PRINTED:
            return f"**{name}.** {_plain(text)}"
        language = "pycon" if text.lstrip().startswith(">>>") else "text"
        return f"**{name}**\n\n```{language}\n{text}\n```"

    def arguments(self) -> dict[str, str]:
        """Return what the section ``Args`` says of each field, by its name."""
        found: dict[str, str] = {}
        name = ""
        for line in self.sections.get("Args", "").splitlines():
            start = _ARGUMENT.match(line)
            if start:
                name = start[1]
                found[name] = _plain(start[2])
            elif name:
                found[name] += " " + _plain(line.strip())
        return found


def words_of(text: str) -> Words:
    """Take a docstring apart.

    Args:
        text: the docstring without its outer indent, as `inspect.getdoc` returns it.
    """
    before: list[str] = []
    sections: dict[str, list[str]] = {}
    name = ""
    for line in text.splitlines():
        heading = _HEADING.match(line)
        if heading:
            name = heading[1]
            sections[name] = []
        elif name and (line.startswith("    ") or not line.strip()):
            sections[name].append(line)
        else:
            name = ""
            before.append(line)
    kept = {key: textwrap.dedent("\n".join(lines)).strip() for key, lines in sections.items()}
    return Words(summary=_plain("\n".join(before).strip()), sections=kept)


def _plain(text: str) -> str:
    """Words of a docstring as Markdown: its code in single backquotes, its signs as they are."""
    text = re.sub(r"``([^`]+)``", r"`\1`", text)
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(p if n % 2 else re.sub(r"([*_<\[])", r"\\\1", p) for n, p in enumerate(parts))
