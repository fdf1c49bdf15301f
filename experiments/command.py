"""Command line, output folder, tables and exit codes common to all experiments."""

from __future__ import annotations

import argparse
import datetime
import importlib
import math
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from seals.cli.main import left_by_reader, two_lines
from seals.cli.of_system import explained
from seals.errors import ConfigError, SealsError
from seals.run.stopping import stoppable


class CommandParser(argparse.ArgumentParser):
    """Parser of a command line whose errors are refusals in two lines."""

    def error(self, message: str) -> NoReturn:
        """Refuse the command line.

        Raises:
            ConfigError: always.
        """
        raise ConfigError(f"{message}.\nSee: {self.prog} --help")


class ExperimentParser(CommandParser):
    """Parser of an experiment, to which ``out=FOLDER``, as of a verb, is ``--out FOLDER``."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the words; see `argparse.ArgumentParser.parse_known_args`."""
        words = sys.argv[1:] if args is None else args
        named = [f"--{word}" if word.startswith("out=") else word for word in words]
        return super().parse_known_args(named, namespace)


def whole(low: int, high: int) -> Callable[[str], int]:
    """Return the type of an argument that is a whole number.

    Args:
        low: least.
        high: largest.

    Example:
        >>> whole(1, 9)("3")
        3
    """

    def number(text: str) -> int:
        if not re.fullmatch(r"[+-]?\d{1,18}", text) or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(
                f"'{text}' is not allowed.\nAllowed: a whole number from {low} to {high}"
            )
        return int(text)

    return number


def seconds(text: str) -> float:
    """Return a time given as an argument [s].

    Raises:
        argparse.ArgumentTypeError: it is no positive number.

    Example:
        >>> seconds("2.5")
        2.5
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed.\nAllowed: seconds above 0")
    return value


def run_main(package: str) -> None:
    """Run ``main`` of an experiment's package and leave the process with its exit code.

    Args:
        package: dotted name, such as ``seals.experiments.soak``.
    """
    sys.exit(ended(importlib.import_module(package).main))


def ended(main: Callable[[Sequence[str] | None], int]) -> int:
    """Return the exit code of an experiment; a refusal is printed in two lines, not raised.

    SIGTERM and SIGHUP end it as Ctrl-C does.

    Args:
        main: of the experiment; takes its arguments, None for those of the command line.
    """
    try:
        with stoppable():
            code = main(None)
            sys.stdout.flush()
            return code
    except BrokenPipeError:
        return left_by_reader()
    except SealsError as refusal:
        print(two_lines(refusal), file=sys.stderr)
        return refusal.exit_code
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
    except OSError as fault:
        refused = explained(fault)
        if refused is None:
            raise
        print(two_lines(refused), file=sys.stderr)
        return refused.exit_code


def parser_of(
    name: str, overrides: str = "as for seals run", out: str = "folder; runs/DATE/TIME_NAME"
) -> ExperimentParser:
    """Return a parser with the option ``--out`` and the overrides.

    Args:
        name: of the experiment.
        overrides: help on the overrides; empty for an experiment that takes none.
        out: help on the folder.
    """
    parser = ExperimentParser(prog=f"python -m seals.experiments.{name}")
    parser.add_argument("--out", type=Path, help=f"{out} when left out")
    if overrides:
        parser.add_argument("overrides", nargs="*", help=overrides)
    return parser


def checked_folder(folder: Path) -> Path:
    """Return the folder of ``--out``, which may still have to be made.

    Raises:
        ConfigError: there is a file in its place, or nothing may be written there.
    """
    there = next(place for place in (folder, *folder.resolve().parents) if place.exists())
    if not there.is_dir():
        raise ConfigError(f"--out {folder}: '{there}' is a file.\nGive a folder: --out FOLDER")
    return _writable(folder, there)


def checked_file(file: Path, suffixes: Sequence[str]) -> Path:
    """Return the file of ``--out``, whose folder is made, before any work is done for it.

    Args:
        file: to be written.
        suffixes: that its name may end with.

    Raises:
        ConfigError: its name ends otherwise, it is a folder, or its folder cannot be written.
    """
    if file.suffix not in suffixes:
        named = f"a file whose name ends with {' or '.join(suffixes)}"
        raise ConfigError(f"--out {file} is not allowed.\nGive {named}: --out FILE")
    if file.is_dir():
        raise ConfigError(f"--out {file} is a folder.\nGive a file: --out FILE{suffixes[0]}")
    checked_folder(file.parent).mkdir(parents=True, exist_ok=True)
    return file if not file.exists() else _writable(file, file)


def _writable(asked: Path, there: Path) -> Path:
    if not os.access(there, os.W_OK):
        raise ConfigError(
            f"--out {asked}: '{there}' may not be written.\n"
            "Choose another place, or change the permissions."
        )
    return asked


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
