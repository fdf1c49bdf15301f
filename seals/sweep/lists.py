"""Parsing of list values: ``[0,0,1]``, ``[[1,2],[3,4]]``."""

from __future__ import annotations


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


def at_place(text: str, place: int) -> str | None:
    """Return one element of a list, or None.

    Example:
        >>> at_place("[0, 0, 1]", 2), at_place("[[1,2],[3,4]]", 1), at_place("[1]", 1)
        ('1', '[3,4]', None)
    """
    if not (text.startswith("[") and text.endswith("]")):
        return None
    found = parts(text[1:-1])
    return found[place].strip() if place < len(found) else None
