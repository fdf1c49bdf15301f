"""Fault injection: every write, flush, rename and close fails or kills once; results are checked.

    python benchmarks/faults.py [CASE ...] [--most POINTS]

A library in C that is loaded before all others counts the calls below the command's folder and
ends, or fails, the n-th, for n from 1 to the last. Afterwards the folder is as before, complete, or
of a run that says that it was cut off; what can be taken up is. One process imports everything and
forks a child a point. Linux, with a C compiler.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import io
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
SHIM = HERE / "fault_shim.c"
MODES = {"kill": 1, "error": 2, "full": 3, "memory": 4, "size": 5}
"""What happens at the n-th call; with ``memory``, what a child may have beyond its parent; with
``size``, how long a file may grow."""
MEMORY, MEMORIES = 2 << 20, 24
"""Step of that [byte], and number of steps."""
SIZE, SIZES = 64, 15
"""Half of the first length of a file [byte], and number of lengths, each twice the one before."""
_ALONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Threads of a parent are not there in its children, which would wait for them."""
PATIENCE = 120.0
"""Time for one command [s]."""


class Tried(NamedTuple):
    """Result of one case.

    Args:
        case: its name.
        points: number of calls that were failed or killed, all modes together.
        bad: points after which the folder was mixed, and why.
    """

    case: str
    points: int
    bad: list[str]


def library() -> Path:
    """Compile the shim and return it.

    Raises:
        OSError: there is no C compiler here.
        CalledProcessError: it is not content.
    """
    target = Path(tempfile.mkdtemp(prefix="faults-")) / "shim.so"
    words = ["cc", "-shared", "-fPIC", "-O1", "-o", str(target), str(SHIM), "-ldl"]
    subprocess.run(words, check=True, capture_output=True)
    return target


def reports(names: Sequence[str], most: int, modes: Sequence[str] = tuple(MODES)) -> Iterator[str]:
    """Run cases in a child process and yield its output lines.

    Raises:
        OSError: there is no C compiler here.
    """
    shim = library()
    line = [sys.executable, str(Path(__file__)), *names, "--most", str(most), "--modes", *modes]
    try:
        with subprocess.Popen(
            line,
            env={**os.environ, **_ALONE, "LD_PRELOAD": str(shim)},
            stdout=subprocess.PIPE,
            text=True,
        ) as process:
            assert process.stdout is not None
            yield from process.stdout
        yield f"exit code {process.returncode}\n"
    finally:
        shutil.rmtree(shim.parent)


def attempt(name: str, case: Any, most: int, modes: Sequence[str]) -> Tried:
    """Inject faults at the points of one case; runs in the process with the shim."""
    root = Path(tempfile.mkdtemp(prefix=f"faults-{name}-")).resolve()
    base, place = root / "base", root / "place"
    base.mkdir()
    os.chdir(base)
    case.prepare(base)
    shutil.copytree(base, place)
    os.chdir(place)
    # once in this process: what is imported here is there in all children
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        case.start()
    os.chdir(root)
    shutil.rmtree(place)
    points, bad = 0, []
    try:
        shutil.copytree(base, place)
        total, code = child(place, case.words, 0, 0)
        verdict = judged(case, base, place, code)
        if code != case.code or verdict != "complete":
            return Tried(name, 0, [f"{name}: without a fault it is {verdict!r}, code {code}"])
        whole = root / "whole"
        place.rename(whole)
        for mode in modes:
            last = {"memory": MEMORIES, "size": SIZES}.get(mode, total)
            step = max(1, -(-last // most)) if most else 1
            for n in range(1, last + 1, step):
                shutil.copytree(base, place)
                _, code = child(place, case.words, n, MODES[mode])
                verdict = judged(case, base, place, code)
                if verdict == "cut" and case.again:
                    _, code = child(place, case.again, 0, 0)
                    after = judged(case, base, place, code)
                    verdict = "cut" if after == "complete" else f"taken up: {after}, code {code}"
                if verdict not in ("before", "complete", "cut"):
                    bad.append(f"{name}, {mode} at {n} of {last}: {verdict}")
                points += 1
                shutil.rmtree(place)
    finally:
        os.chdir("/")
        shutil.rmtree(root, ignore_errors=True)
    return Tried(name, points, bad)


def judged(case: Any, base: Path, place: Path, code: int) -> str:
    """Return the verdict on a folder; an unreadable folder is a failure."""
    try:
        return str(case.judge(base, place, code))
    except Exception as error:  # whatever a torn file makes of its reader
        return f"{type(error).__name__}: {' '.join(str(error).split())}"


def child(place: Path, words: Sequence[str], n: int, mode: int) -> tuple[int, int]:
    """Run a command in a folder; return how many calls it made there, and how it ended."""
    ears, mouth = os.pipe()
    number = os.fork()
    if number == 0:
        os.close(ears)
        _act(place, words, n, mode, mouth)
    os.close(mouth)
    code = _ended(number)
    with open(ears, "rb") as file:
        told = file.read()
    return (int(told) if told else 0), code


def _act(place: Path, words: Sequence[str], n: int, mode: int, mouth: int) -> None:
    """Be the child: never returns."""
    shim = ctypes.CDLL(os.environ["LD_PRELOAD"])
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    code = 99
    try:
        os.chdir(place)
        from seals.cli.main import main

        if mode == MODES["memory"]:
            size = _size() + n * MEMORY
            resource.setrlimit(resource.RLIMIT_AS, (size, size))
        elif mode == MODES["size"]:
            resource.setrlimit(resource.RLIMIT_FSIZE, (SIZE << n, SIZE << n))
        else:
            shim.faults_arm(str(place).encode(), n, mode)
        try:
            code = main(words)
        except (OSError, MemoryError):
            code = 98  # an error of the system that has no words of its own
        except SystemExit as end:
            code = int(end.code or 0)
        calls = shim.faults_count()
        shim.faults_arm(b"", 0, 0)
        os.write(mouth, str(calls).encode())
    finally:
        os._exit(code)


def _size() -> int:
    """Return the address space of this process [byte]."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _ended(number: int) -> int:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        done, status = os.waitpid(number, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(number, signal.SIGKILL)
    os.waitpid(number, 0)
    return -1000


def main(arguments: Sequence[str]) -> int:
    """Run the named cases, or all."""
    sys.path.append(str(HERE.parent))
    from benchmarks.fault_cases import CASES

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", nargs="*", default=list(CASES), metavar="CASE")
    parser.add_argument("--most", type=int, default=0, help="points of a case and mode; 0 for all")
    parser.add_argument("--modes", nargs="+", default=list(MODES), choices=list(MODES))
    given = parser.parse_args(arguments)
    if "LD_PRELOAD" not in os.environ:
        lines = list(map(_shown, reports(given.case, given.most, given.modes)))
        return int(lines[-1].split()[-1])
    worst = 0
    for name in given.case:
        start = time.monotonic()
        tried = attempt(name, CASES[name], given.most, given.modes)
        seconds = time.monotonic() - start
        print(f"{name}: {tried.points} points, {len(tried.bad)} bad, {seconds:.0f} s", flush=True)
        for words in tried.bad:
            print(f"  {words}", flush=True)
        worst = max(worst, bool(tried.bad))
    return worst


def _shown(line: str) -> str:
    print(line, end="", flush=True)
    return line


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
