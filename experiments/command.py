"""Command line, output folder, tables and exit codes common to all experiments."""

from __future__ import annotations

import argparse
import datetime
import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from seals.cli.main import two_lines
from seals.errors import ConfigError, SealsError


class CommandParser(argparse.ArgumentParser):
    """Parser of a command line whose errors are refusals in two lines."""

    def error(self, message: str) -> NoReturn:
        """Refuse the command line.

        Raises:
            ConfigError: always.
        """
        raise ConfigError(f"{message}.\nSee: {self.prog} --help")


def run_main(package: str) -> None:
    """Run ``main`` of an experiment's package and leave the process with its exit code.

    Args:
        package: dotted name, such as ``seals.experiments.soak``.
    """
    sys.exit(ended(importlib.import_module(package).main))


def ended(main: Callable[[Sequence[str] | None], int]) -> int:
    """Return the exit code of an experiment; a refusal is printed in two lines, not raised.

    Args:
        main: of the experiment; takes its arguments, None for those of the command line.
    """
    try:
        return main(None)
    except SealsError as refusal:
        print(two_lines(refusal), file=sys.stderr)
        return refusal.exit_code
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130


def parser_of(
    name: str, overrides: str = "as for seals run", out: str = "folder; runs/DATE/TIME_NAME"
) -> CommandParser:
    """Return a parser with the option ``--out`` and the overrides.

    Args:
        name: of the experiment.
        overrides: help on the overrides; empty for an experiment that takes none.
        out: help on the folder.
    """
    parser = CommandParser(prog=f"python -m seals.experiments.{name}")
    parser.add_argument("--out", type=Path, help=f"{out} when left out")
    if overrides:
        parser.add_argument("overrides", nargs="*", help=overrides)
    return parser


def checked_folder(folder: Path) -> Path:
    """Return the folder of ``--out``, which may still have to be made.

    Raises:
        ConfigError: there is a file in its place.
    """
    there = next(place for place in (folder, *folder.resolve().parents) if place.exists())
    if not there.is_dir():
        raise ConfigError(f"--out {folder}: '{there}' is a file.\nGive a folder: --out FOLDER")
    return folder


def folder_of(given: argparse.Namespace, name: str) -> Path:
    """Return the folder that ``--out`` names, or ``runs/DATE/TIME_NAME``."""
    stamp = datetime.datetime.now().astimezone()
    if given.out:
        return checked_folder(given.out)
    return Path("runs") / f"{stamp:%Y-%m-%d}" / f"{stamp:%H-%M-%S}_{name}"


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]]) + "\n"


def figure_table(found: Mapping[str, float | str], digits: int = 4) -> str:
    """Return named figures as a table in Markdown, numbers with so many significant digits."""
    cells = [(k, v if isinstance(v, str) else f"{v:.{digits}g}") for k, v in found.items()]
    return markdown(("figure", "value"), cells)


def show_table(folder: Path, text: str) -> None:
    """Write ``table.md`` and print it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table.md").write_text(text, encoding="utf-8")
    print(text)
