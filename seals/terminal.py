"""Output streams that keep what strangers named from steering the terminal."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Any, TextIO

_KEPT = frozenset("\n\t")


class PlainStream:
    r"""Stream that replaces the signs that steer a terminal by blanks.

    Names of columns, links, files and runs come from strangers; a sequence of signs in one may
    clear lines, forge others, or set the title of the window.

    Args:
        below: the stream that is written to.

    Example:
        >>> import io
        >>> PlainStream(io.StringIO()).cleaned("a\x1b[2J\n")
        'a [2J\n'
    """

    def __init__(self, below: TextIO) -> None:
        self.below = below

    @staticmethod
    def cleaned(text: str) -> str:
        """Return a text without those signs; ends of lines and tabulators stay."""
        if text.isprintable():
            return text
        return "".join(s if s.isprintable() or s in _KEPT else " " for s in text)

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        plain = self.cleaned(text)
        try:
            self.below.write(plain)
        except UnicodeEncodeError:
            # a terminal of few signs shows a mark in place of each other one
            code = self.below.encoding
            self.below.write(plain.encode(code, "replace").decode(code))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        """Return anything else from the stream below."""
        return getattr(self.below, name)


@contextlib.contextmanager
def plain_streams() -> Iterator[None]:
    """Replace the standard streams temporarily; a closed one discards its output."""
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout, sys.stderr = (
            # a stream that was closed before the start is None
            stream if isinstance(stream, PlainStream) else PlainStream(stream or nowhere)
            for stream in before
        )
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before


@contextlib.contextmanager
def silenced(*numbers: int) -> Iterator[None]:
    """Suppress the output of C code, such as that of drivers.

    Args:
        numbers: of the streams, 1 for output and 2 for errors; both when left out.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    kept = {number: os.dup(number) for number in numbers or (1, 2)}
    silent = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in kept:
            os.dup2(silent, number)
        yield
    finally:
        for number, before in kept.items():
            os.dup2(before, number)
            os.close(before)
        os.close(silent)


def drawing(stream: TextIO) -> TextIO:
    """Return the stream for colours and bars, whose texts are `printable` by themselves."""
    return stream.below if isinstance(stream, PlainStream) else stream
