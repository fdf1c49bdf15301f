"""A reader at work: an empty folder, a shell, and an environment of its own to install into."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
import time
import venv
from pathlib import Path

from tests.docs.pages import Block, Step, figures, told, untied

ROOT = Path(__file__).parents[2]
LONGEST = 5400.0
"""Seconds after which a command counts as hanging [s]."""
TAIL = 3000
"""Characters of the end of an output that a failure shows."""
_PROGRAMS = {
    "seals": "from seals.cli.main import main; raise SystemExit(main())",
    "pytest": "from pytest import main; raise SystemExit(main())",
    "pip": "from pip._internal.cli.main import main; raise SystemExit(main())",
}
_running: set[int] = set()
_stopped = threading.Event()
# what is made in a clone is no part of one
_MADE = re.compile(r"\.git|\.venv.*|build|dist|runs|models|.*\.egg-info|.*_cache")


def stop() -> None:
    """End the commands of all sessions, and let no other begin."""
    _stopped.set()
    for group in list(_running):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)


class Session:
    """Follows the blocks of one page, in order, in one folder.

    What a page installs goes into an environment of its own, which sees the packages of the
    running interpreter and is left behind with the folder.

    Args:
        folder: empty folder to work in; the environment, and a clone for the blocks that need
            one, are made beside it.

    Attributes:
        faults: what was otherwise than printed: line of the page, expected, and got.
        commands: how many commands were run.
        figures: how many figures of the page were compared with what was printed.
        printed: what each command printed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = folder.parent / f"{folder.name}_environment"
        self.clone = folder.parent / f"{folder.name}_clone"
        self.faults: list[str] = []
        self.commands = 0
        self.figures = 0
        self.printed: list[str] = []
        self._whole = True
        venv.create(self.environment, with_pip=False, symlinks=True)
        self._see_installed()

    def pass_by(self) -> None:
        """Leave a block out: what it would have printed is known to be missing."""
        self._whole = False

    def follow(self, block: Block) -> None:
        """Run or save one block; what it prints and its exit codes must be as promised."""
        if block.language == "printed":
            self._tie(block)
        elif block.file:
            path = self.folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        for step in block.steps:
            place = self._cloned() if block.in_clone else self.folder
            self.run(step, place)

    def run(self, step: Step, place: Path) -> None:
        """Run one command in the shell; note what it ended with or printed otherwise.

        Raises:
            InterruptedError: all sessions were stopped.
        """
        if _stopped.is_set():
            raise InterruptedError
        with tempfile.TemporaryFile() as output:
            code = self._code(step, place, output.fileno())
            output.seek(0)
            printed = output.read().decode("utf-8", errors="replace")
        self.commands += 1
        self.printed.append(printed)
        wrong = []
        if code != step.code:
            wrong.append(f"  expected: exit code {step.code}\n  got:      exit code {code}")
        for line in step.lines:
            self.figures += len(figures(line))
            if not told(line, printed):
                wrong.append(f"  expected: {line.strip()}\n  got:      {nearest(line, printed)}")
        if wrong:
            end = printed[-TAIL:].rstrip()
            self.faults.append("\n".join([f"{step.at}: {step.command}", *wrong, "  output:", end]))

    def _tie(self, block: Block) -> None:
        """Figures of prose: they stand in the paragraph, and the line was printed."""
        missing = untied(block)
        if missing:
            paragraph = block.file.strip()
            self.faults.append(
                f"{block.line}: figures {', '.join(missing)} of a printed line\n"
                f"  expected: in the paragraph before\n  got:      {paragraph}"
            )
        everything = "\n".join(self.printed)
        for line in block.ties:
            if told(line, everything):
                self.figures += len(figures(line))
            elif self._whole:
                self.faults.append(
                    f"{block.line}: figures of prose\n  expected: {line}\n"
                    f"  got:      {nearest(line, everything)}"
                )

    def _code(self, step: Step, place: Path, output: int) -> int:
        """Run a command to its end, or interrupt it; return its exit code."""
        process = subprocess.Popen(
            ["bash", "-c", step.command],
            cwd=place,
            env=self._surroundings(),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        _running.add(process.pid)
        try:
            if step.interrupted:
                self._interrupt(step, process, output)
            code = process.wait(60 if step.interrupted else LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            code = process.wait()
        finally:
            with contextlib.suppress(ProcessLookupError):
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
            _running.discard(process.pid)
        # a shell shows no exit code behind ^C: the usual ones are one
        usual = step.interrupted and code in (0, 130, -signal.SIGINT)
        return step.code if usual else code

    @staticmethod
    def _interrupt(step: Step, process: subprocess.Popen[bytes], output: int) -> None:
        """Press Ctrl-C once all lines were seen."""
        end = time.monotonic() + LONGEST
        while process.poll() is None and time.monotonic() < end:
            seen = os.pread(output, 10**7, 0).decode("utf-8", errors="replace")
            if all(told(line, seen) for line in step.lines):
                break
            time.sleep(0.2)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)

    def _cloned(self) -> Path:
        """The top of a clone: links to the sources, and to what lies beside them."""
        if not self.clone.exists():
            self.clone.mkdir()
            for path in ROOT.iterdir():
                if not _MADE.fullmatch(path.name):
                    (self.clone / path.name).symlink_to(path)
            beside = self.clone.parent / "shared"
            if (ROOT.parent / "shared").is_dir() and not beside.exists():
                beside.symlink_to(ROOT.parent / "shared")
            # as after the first command of the README: the sources run from where they lie
            pip = [str(self.environment / "bin" / "pip"), "install", "--quiet", "--no-deps"]
            subprocess.run([*pip, "-e", "."], cwd=self.clone, env=self._surroundings(), check=True)
        return self.clone

    def _surroundings(self) -> dict[str, str]:
        surroundings = {
            **os.environ,
            "PATH": f"{self.environment / 'bin'}:{os.environ['PATH']}",
            # packages are built with what is installed: nothing is fetched
            "PIP_NO_BUILD_ISOLATION": "0",
            "PIP_NO_INDEX": "1",
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        measurements = ROOT.parent / "shared" / "data"
        if measurements.is_dir() and not surroundings.get("SEALS_DATA"):
            surroundings["SEALS_DATA"] = str(measurements)
        return surroundings

    def _see_installed(self) -> None:
        """Let the environment see what is installed here, and have the programs of it."""
        major, minor = sys.version_info[:2]
        site = self.environment / "lib" / f"python{major}.{minor}" / "site-packages"
        there = sysconfig.get_paths()["purelib"]
        (site / "installed.pth").write_text(f"import site; site.addsitedir({there!r})\n")
        for name, program in _PROGRAMS.items():
            path = self.environment / "bin" / name
            path.write_text(f"#!{self.environment}/bin/python\n{program}\n", encoding="utf-8")
            path.chmod(0o755)


def nearest(line: str, output: str) -> str:
    """The line of an output that is most like the one expected."""
    lines = [text.strip() for text in output.splitlines() if text.strip()]
    return next(iter(difflib.get_close_matches(line.strip(), lines, n=1, cutoff=0.0)), "nothing")
