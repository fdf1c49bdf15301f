"""Reads the pages that are run as they are printed: commands, promised lines, files to save.

A fenced block of the language ``console`` holds commands behind ``$``, each with the lines that
must be seen of its output and ``[exit code N]`` where it is not 0. A figure in such a line must
be the printed one to the digits that the page shows; ``...`` stands for what is left out, a part
of a line or lines. ``^C`` interrupts a command that would go on for ever, once its lines were
seen. A block ``python`` is run as a program. A block under the words "Save as `NAME`:" is saved.
A comment before a block says when it is run, and why not always:

    <!-- run: slow, 2 min: particles -->
    <!-- run: slow, 40 s in a clone -->
    <!-- run: never, network: it downloads 300 MB -->

A comment after a paragraph ties its figures to a line that was printed further up; after a
table it may say that all rows were:

    <!-- printed: velocity_x = 2.708 m/s -->
    <!-- printed: rows -->
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
LEFT_OUT = re.compile(r"\s*(?:\.\.\.|…)\s*")
INTERRUPT = "^C"
WHENS = ("always", "slow", "never")
OBSTACLES = ("network", "person", "accelerator", "program")
"""Why a block is never run: what it needs that no test has."""
_BLOCK = re.compile(
    r"(?:<!-- run: (?P<when>\w+), (?P<reason>[^>]*?) -->\s*\n)?"
    r"(?:^[^\n]*Save as `(?P<file>[^`\n]+)`:\n\n)?"
    r"^```(?P<language>[^\n]*)\n(?P<text>.*?)^```"
    r"|^<!-- printed: (?P<printed>.*?) -->",
    re.DOTALL | re.MULTILINE,
)
_CODE = re.compile(r"\[exit code (\d+)\]")
_LASTS = re.compile(r"(\d+) (s|min)\b")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


class Step(NamedTuple):
    """One printed command, what must be seen of its output, its exit code, and its line."""

    command: str
    lines: list[str]
    code: int
    at: int = 0
    interrupted: bool = False


class Block(NamedTuple):
    """One fenced block of a page, with the line it begins in and when it is run.

    A comment ``printed`` is a block of that language: its text is the printed line, its file the
    paragraph above it.
    """

    language: str
    text: str
    file: str
    when: str
    reason: str
    line: int

    @property
    def steps(self) -> list[Step]:
        """The commands of a block, in order: those of ``console``, or the one program."""
        if self.language == "console":
            return _steps(self.text, self.line)
        if self.language == "python" and not self.file:
            program = f"python - <<'END_OF_BLOCK'\n{self.text}END_OF_BLOCK"
            return [Step(program, [], 0, self.line)]
        return []

    @property
    def ties(self) -> list[str]:
        """The lines that must have been printed: that of the comment, or the rows of its table."""
        if self.text.strip() != "rows":
            return [self.text]
        rows = [row for row in self.file.splitlines() if row.lstrip().startswith("|")]
        return [row for row in rows[1:] if row.strip("|:- ")]

    @property
    def seconds(self) -> float:
        """How long the block takes by its comment [s]; without one a second a command."""
        found = _LASTS.search(self.reason) if self.when == "slow" else None
        if found is None:
            return float(len(self.steps))
        return float(found[1]) * (60 if found[2] == "min" else 1)

    @property
    def in_clone(self) -> bool:
        """Whether its commands are run at the top of a clone instead of in an empty folder."""
        return "in a clone" in self.reason


def blocks(text: str) -> list[Block]:
    """Read the fenced blocks of a page in order, and the ties of its prose to printed lines."""
    found = []
    for match in _BLOCK.finditer(text):
        printed = match["printed"]
        fence = match.start() if printed is not None else text.index("```", match.start())
        found.append(
            Block(
                language="printed" if printed is not None else match["language"],
                text=printed or match["text"] or "",
                file=_paragraph(text[: match.start()]) if printed else match["file"] or "",
                when=match["when"] or "always",
                reason=match["reason"] or "",
                line=text.count("\n", 0, fence) + 1,
            )
        )
    return found


def steps(text: str) -> list[Step]:
    """Read the commands of a page and the lines printed below each."""
    return [step for block in blocks(text) if block.language == "console" for step in block.steps]


def files(text: str) -> dict[str, str]:
    """Read the files that a page tells its reader to save, by name."""
    return {b.file: b.text for b in blocks(text) if b.file and b.language != "printed"}


def figures(line: str) -> list[str]:
    """The figures of a line, as they stand there."""
    return NUMBER.findall(line)


def told(line: str, output: str) -> bool:
    """Whether a line is in the output, with the same figures to the digits shown."""
    parts = [_pattern(part) for part in LEFT_OUT.split(line.strip()) if part.strip()]
    pattern = re.compile("[^\n]*?".join(parts))
    start = 0
    while found := pattern.search(output, start):
        pairs = zip(figures(line), found.groups(), strict=True)
        if all(same(shown, printed) for shown, printed in pairs):
            return True
        start = found.start() + 1
        # never begin inside a figure or behind its sign
        while start < len(output) and re.match(r"[-\d.]", output[start - 1]):
            start += 1
    return False


def same(shown: str, printed: str) -> bool:
    """Whether two figures are one, given that each is rounded to the digits that it shows.

    Whole numbers are counts: they must be equal.
    """
    if "." not in shown + printed and "e" not in shown + printed:
        return int(shown) == int(printed)
    room = (_unit(shown) + _unit(printed)) / 2
    return math.isclose(float(shown), float(printed), rel_tol=1e-12, abs_tol=room * (1 + 1e-9))


def untied(block: Block) -> list[str]:
    """The figures of a tie that the paragraph above it does not show."""
    # minus signs and thin spaces of typography are those of a printed line
    prose = block.file.replace("−", "-").replace("\u202f", " ")
    shown = {figure.lstrip("-") for figure in figures(prose)}
    return [figure for figure in figures(block.text) if figure.lstrip("-") not in shown]


def pages(root: Path) -> list[Path]:
    """Return the pages of a repository whose blocks are run: readmes and those in ``docs/``."""
    own = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").glob("*.md"))]
    for folder in ("experiments", "tests/validation", "animals", "robots"):
        own += sorted((root / folder).glob("*/README.md"))
    return [*own, root / "experiments" / "README.md"]


def name_of(page: Path) -> str:
    """The name of a page: that of its file, of a readme below the top with that of its folder.

    Example:
        >>> name_of(Path("experiments/soak/README.md"))
        'soak/README'
    """
    if page.stem == "README" and not (page.parent / "pyproject.toml").is_file():
        return f"{page.absolute().parent.name}/{page.stem}"
    return page.stem


def _pattern(part: str) -> str:
    words = r"\s+".join(re.escape(w) for w in NUMBER.sub("\0", part).split())
    return words.replace("\0", r"(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)")


def _unit(figure: str) -> float:
    """One unit of the last digit shown."""
    mantissa, _, exponent = figure.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def _paragraph(before: str) -> str:
    """The last paragraph, list or table of a text; comments between are passed over."""
    return _COMMENT.sub("", before).rstrip().rpartition("\n\n")[2]


def _steps(text: str, top: int) -> list[Step]:
    found: list[Step] = []
    lines = enumerate(text.strip("\n").split("\n"), start=top + 1)
    for at, line in lines:
        code = _CODE.fullmatch(line)
        if line.startswith("$ "):
            command = line.removeprefix("$ ")
            while command.endswith("\\"):
                command += "\n" + next(lines, (0, ""))[1]
            found.append(Step(command, [], 0, at))
        elif code and found:
            found[-1] = found[-1]._replace(code=int(code[1]))
        elif line == INTERRUPT and found:
            found[-1] = found[-1]._replace(interrupted=True)
        elif found and line.strip(" .…"):
            found[-1].lines.append(line)
    return found
