"""Reads the pages that are run as they are printed: commands, promised lines, files to save.

A fenced block of the language ``console`` holds commands behind ``$``, each with the lines that
must be seen of its output and ``[exit code N]`` where it is not 0; a line of dots stands for lines
that are left out. A block ``python`` is run as a program. A block under the words
"Save as `NAME`:" is
saved. A comment before a block says when it is not run, and why:

    <!-- run: slow, two minutes of computing -->
    <!-- run: never, it waits for a browser -->
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
# machines differ in the last digits of a fit; a change of the answer is larger than this
SHARE = 0.03
WHENS = ("always", "slow", "never")
_BLOCK = re.compile(
    r"(?:<!-- run: (?P<when>\w+), (?P<reason>[^>]*?) -->\s*\n)?"
    r"(?:^[^\n]*Save as `(?P<file>[^`\n]+)`:\n\n)?"
    r"^```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^```",
    re.DOTALL | re.MULTILINE,
)
_CODE = re.compile(r"\[exit code (\d+)\]")


class Step(NamedTuple):
    """One printed command, what must be seen of its output, and its exit code."""

    command: str
    lines: list[str]
    code: int


class Block(NamedTuple):
    """One fenced block of a page, with the line it begins in and when it is run."""

    language: str
    text: str
    file: str
    when: str
    reason: str
    line: int

    @property
    def steps(self) -> list[Step]:
        """The commands of a block ``console``, in order."""
        return _steps(self.text) if self.language == "console" else []


def blocks(text: str) -> list[Block]:
    """Read the fenced blocks of a page in order."""
    return [
        Block(
            language=found["language"],
            text=found["text"],
            file=found["file"] or "",
            when=found["when"] or "always",
            reason=found["reason"] or "",
            line=text.count("\n", 0, found.start()) + 1,
        )
        for found in _BLOCK.finditer(text)
    ]


def steps(text: str) -> list[Step]:
    """Read the commands of a page and the lines printed below each."""
    return [step for block in blocks(text) for step in block.steps]


def files(text: str) -> dict[str, str]:
    """Read the files that a page tells its reader to save, by name."""
    return {block.file: block.text for block in blocks(text) if block.file}


def told(line: str, output: str) -> bool:
    """Whether a line is in the output, its numbers within a few per cent."""
    words = r"\s+".join(re.escape(w) for w in NUMBER.sub("\0", line).split())
    pattern = words.replace("\0", f"({NUMBER.pattern})")
    wanted = [float(n) for n in NUMBER.findall(line)]
    return any(
        all(abs(float(a) - b) <= SHARE * max(abs(b), 0.1) for a, b in zip(m, wanted, strict=True))
        for m in (found.groups() for found in re.finditer(pattern, output))
    )


def pages(root: Path) -> list[Path]:
    """Return the pages of a repository whose blocks are run: the readme and those in ``docs/``."""
    return [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").glob("*.md"))]


def _steps(text: str) -> list[Step]:
    found: list[Step] = []
    lines = iter(text.strip("\n").split("\n"))
    for line in lines:
        code = _CODE.fullmatch(line)
        if line.startswith("$ "):
            command = line.removeprefix("$ ")
            while command.endswith("\\"):
                command += "\n" + next(lines, "")
            found.append(Step(command, [], 0))
        elif code and found:
            found[-1] = found[-1]._replace(code=int(code[1]))
        elif found and line.strip(" .…"):
            found[-1].lines.append(line)
    return found
