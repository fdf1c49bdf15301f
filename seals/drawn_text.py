"""Text of strangers where others would read markup into it: pages of a viewer, spreadsheets.

Names of links, robots, effects and logs come from anybody's file. Charts draw every text as it is
(`seals.report.pictures.figure_class`), pages of reports escape by themselves.
"""

from __future__ import annotations

import re

_SIGNS = re.compile(r"[^A-Za-z0-9\s.,:;()/='\"+-]")
_ODD = re.compile(r"[^\n\t -~]")
_FORMULA = re.compile(r"[=+\-@\t\r]")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def readable(text: str) -> str:
    r"""Return text with blanks in place of signs that turn the direction of writing or end lines.

    Ends of lines and tabulators stay. Names with such signs would show another text than they hold.

    Example:
        >>> readable("wi\u202end, - 1\n")
        'wi nd, - 1\n'
    """
    return _ODD.sub(lambda found: found[0] if found[0].isprintable() else " ", text)


def in_markdown(text: str) -> str:
    """Return text for a field of Markdown, in which braces would be programs of the page.

    Example:
        >>> in_markdown("t = 0.1 s {alert(1)} <b>")
        't = 0.1 s &#123;alert(1)&#125; &#60;b&#62;'
    """
    return _SIGNS.sub(lambda found: f"&#{ord(found[0])};", readable(text))


def in_table(text: str) -> str:
    """Return text for a cell of a CSV file, which no spreadsheet takes for a formula.

    Example:
        >>> in_table("=cmd|'/C calc'!A0"), in_table("-0.5"), in_table("ball")
        ("'=cmd|'/C calc'!A0", '-0.5', 'ball')
    """
    formula = _FORMULA.match(text) and not _NUMBER.fullmatch(text)
    return f"'{text}" if formula else text
