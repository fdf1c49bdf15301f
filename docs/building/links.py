"""Links of the repository's pages, turned into links between the pages of the site."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from pathlib import Path

_LINK = re.compile(r"(!?)\[([^\]\[]*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^( {0,3}```.*?^ {0,3}```[^\n]*$|`[^`\n]+`)", re.MULTILINE | re.DOTALL)


def relinked(text: str, *, source: str, place: str, known: Mapping[str, str], root: Path) -> str:
    """Return a page whose relative links lead to pages of the site.

    Code is left alone. What is in the repository and not on the site (programs, folders) keeps its
    words and loses the link. What is nowhere is left as it is, so that the strict build refuses it.

    Args:
        text: the page in Markdown.
        source: path of the page in the repository.
        place: path of the page on the site.
        known: path on the site by path in the repository.
        root: folder of the repository.
    """

    def mend(match: re.Match[str]) -> str:
        mark, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if not path or re.match(r"[a-z]+:", path):
            return match[0]
        there = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        found = known.get(there) or known.get(f"{there}/README.md")
        if found is None:
            return words if not mark and (root / there).exists() else match[0]
        way = posixpath.relpath(found, posixpath.dirname(place) or ".")
        return f"{mark}[{words}]({way}{'#' + anchor if anchor else ''})"

    parts = _FENCE.split(text)
    return "".join(part if n % 2 else _LINK.sub(mend, part) for n, part in enumerate(parts))
