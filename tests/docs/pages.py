"""Reads the pages that are run as they are printed: commands, promised lines, files to save."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

SEALS = "from seals.cli.main import main; raise SystemExit(main())"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
# machines differ in the last digits of a fit; a change of the answer is larger than this
SHARE = 0.03


class Step(NamedTuple):
    """One printed command, what must be seen of its output, and its exit code."""

    command: str
    lines: list[str]
    code: int


def steps(text: str) -> list[Step]:
    """Read the commands of a page and the lines printed below each."""
    found = []
    for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL):
        command, *lines = block.strip("\n").split("\n")
        code = re.fullmatch(r"\[exit code (\d+)\]", lines[-1])
        seen = lines[:-1] if code else lines
        found.append(Step(command.removeprefix("$ "), seen, int(code[1]) if code else 0))
    return found


def files(text: str) -> dict[str, str]:
    """Read the files that a page tells its reader to save, by name."""
    return dict(re.findall(r"Save as `([^`]+)`:\n\n```\w+\n(.*?)```", text, re.DOTALL))


def told(line: str, output: str) -> bool:
    """Whether a line is in the output, its numbers within a few per cent."""
    words = r"\s+".join(re.escape(w) for w in NUMBER.sub("\0", line).split())
    pattern = words.replace("\0", f"({NUMBER.pattern})")
    wanted = [float(n) for n in NUMBER.findall(line)]
    return any(
        all(abs(float(a) - b) <= SHARE * max(abs(b), 0.1) for a, b in zip(m, wanted, strict=True))
        for m in (found.groups() for found in re.finditer(pattern, output))
    )


def follow(step: Step, folder: Path) -> None:
    """Run one command in a folder; it must end and print as promised."""
    words = [sys.executable, "-c", SEALS, *step.command.split()[1:]]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == step.code, step.command + done.stderr
    assert [line for line in step.lines if not told(line, done.stdout)] == [], done.stdout
