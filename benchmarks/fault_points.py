"""One command with one fault: a process in which the n-th call fails, or that lacks memory.

The process is forked from one that has imported everything, or, to compare, started afresh.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import os
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

MODES = {"kill": 1, "error": 2, "full": 3, "memory": 4, "size": 5, "address": 6}
"""What happens at the n-th call; with ``memory``, what a forked process may have beyond its parent;
with ``size``, how long a file may grow; with ``address``, the whole memory of a fresh process."""
MEMORY, MEMORIES = 2 << 20, 24
"""Step of that beyond the parent [byte], and number of steps."""
SIZE, SIZES = 64, 15
"""Half of the first length of a file [byte], and number of lengths, each twice the one before."""
ADDRESSES = 20
"""Number of steps of the whole memory, up to what the command takes."""
_ENV = "SEALS_FAULT_ADDRESS"
HERE = Path(__file__).resolve()
PATIENCE = 300.0
"""Time for one command [s]."""
OF_SYSTEM = 98
"""Exit code of a command that ended with an error without words."""
_LONGEST, _MARK = 1 << 20, "\0told "
"""Bytes that a command may write to its streams; what stands before its own count."""
GOOD = ("before", "complete", "cut")
"""What a folder may be afterwards."""


class End(NamedTuple):
    """How a command ended.

    Args:
        calls: number of calls that it made below its folder.
        code: its exit code; negative where a signal ended it.
        said: what it wrote to its streams.
        peak: the most memory that it had [byte]; 0 where it did not come to tell.
    """

    calls: int
    code: int
    said: str
    peak: int = 0


class Fate(NamedTuple):
    """What became of one point.

    Args:
        verdict: on the folder: ``before``, ``complete``, ``cut``, or what is wrong with it.
        code: exit code of the command.
        crashed: whether a library ended the process for want of memory.
    """

    verdict: str
    code: int
    crashed: bool = False

    @property
    def bad(self) -> bool:
        """Whether the folder is mixed, or the command ended without words."""
        return self.verdict not in GOOD


def last_of(mode: str, calls: int) -> int:
    """Return the number of points of a mode, for a command of so many calls."""
    return {"memory": MEMORIES, "size": SIZES, "address": ADDRESSES}.get(mode, calls)


def tried(case: Any, base: Path, place: Path, mode: str, n: int, *, fresh: bool = False) -> Fate:
    """Run a command with the n-th fault in a copy of its folder, and judge what is left of it.

    Args:
        case: the command.
        base: folder as it was before.
        place: where the copy shall lie; removed afterwards.
        mode: what happens.
        n: at which call, or step.
        fresh: whether the process starts afresh.
    """
    shutil.copytree(base, place)
    try:
        end = run(place, case.words, n, MODES[mode], fresh=fresh)
        verdict = judged(case, base, place, end.code)
        again = case.again(place) if verdict == "cut" else ()
        if again:
            after = run(place, again, 0, 0)
            whole = judged(case, base, place, after.code)
            if whole != "complete":
                verdict = f"taken up: {whole}, code {after.code}: {_tail(after.said)}"
        short = mode in ("memory", "address")
        crashed = end.code < 0 and not (mode == "kill" and end.code == -signal.SIGKILL)
        wordless = end.code == OF_SYSTEM or "Traceback (most recent" in end.said
        if verdict in GOOD and (wordless or (crashed and not short)):
            verdict = f"ended with code {end.code}, without words: {_tail(end.said)}"
        return Fate(verdict, end.code, crashed and short)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def judged(case: Any, base: Path, place: Path, code: int) -> str:
    """Return the verdict on a folder; an unreadable folder is a failure."""
    try:
        return str(case.judge(base, place, code))
    except Exception as error:  # whatever a torn file makes of its reader
        return f"{type(error).__name__}: {' '.join(str(error).split())}"


def run(place: Path, words: Sequence[str], n: int, mode: int, *, fresh: bool = False) -> End:
    """Run a command in a folder with the n-th fault; 0 for none."""
    # pipes: neither the length of files nor a full disk shall silence the command
    ears, mouth = os.pipe()
    with contextlib.suppress(OSError):  # as the system has it, then
        fcntl.fcntl(mouth, fcntl.F_SETPIPE_SZ, _LONGEST)
    os.set_inheritable(mouth, True)
    os.set_blocking(ears, False)
    said = ""
    try:
        if fresh or mode == MODES["address"]:
            line = [sys.executable, "-P", str(HERE), str(place), str(n), str(mode), str(mouth)]
            number = os.posix_spawn(sys.executable, [*line, *words], os.environ)
        else:
            number = os.fork()
            if number == 0:
                _act(place, words, n, mode, mouth)
        code = _ended(number)
        with contextlib.suppress(BlockingIOError):
            said = os.read(ears, _LONGEST).decode(errors="replace")
        # what the processes that it leaves behind say comes after
        said, _, told = said.partition(_MARK)
        calls, peak = map(int, told.partition("\0")[0].split() or (0, 0))
        return End(calls, code, said, peak)
    finally:
        os.close(ears)
        os.close(mouth)


def _act(place: Path, words: Sequence[str], n: int, mode: int, mouth: int) -> None:
    """Be the process of the command: never returns."""
    shim = ctypes.CDLL(os.environ["LD_PRELOAD"])
    for stream in (1, 2):
        os.dup2(mouth, stream)
    code = 99
    try:
        os.chdir(place)
        from seals.cli.main import main

        _limit(mode, n)
        if mode <= MODES["full"]:
            shim.faults_arm(str(place).encode(), n, mode)
        try:
            code = main(list(words))
        except SystemExit as end:
            code = int(end.code or 0)
        except BaseException as error:  # a traceback, for whoever gave the command
            code = OF_SYSTEM
            with contextlib.suppress(BaseException):
                os.write(2, "".join(traceback.format_exception(error, limit=-3)).encode())
        calls = shim.faults_count()
        shim.faults_arm(b"", 0, 0)
        with contextlib.suppress(MemoryError):
            os.write(mouth, f"{_MARK}{calls} {_field('VmPeak') or _field('VmSize')}\0".encode())
    finally:
        os._exit(code)


def _limit(mode: int, n: int) -> None:
    """Bound memory, or the length of files."""
    if mode == MODES["memory"]:
        size = _field("VmSize") + n * MEMORY
    elif mode == MODES["address"]:
        size = _field("VmSize")
        size += n * (int(os.environ[_ENV]) - size) // (ADDRESSES + 1)
    elif mode == MODES["size"]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (SIZE << n, SIZE << n))
        return
    else:
        return
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


def needed(peak: int) -> None:
    """Tell fresh processes how much memory their command takes [byte]."""
    os.environ[_ENV] = str(peak)


def _field(name: str) -> int:
    """Return a size of this process [byte]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        key, _, value = line.partition(":")
        if key == name:
            return int(value.split()[0]) << 10
    return 0


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


def _tail(said: str) -> str:
    return " ".join(said.split())[-300:]


if __name__ == "__main__":
    _place, _n, _mode, _mouth, *_words = sys.argv[1:]
    _act(Path(_place), _words, int(_n), int(_mode), int(_mouth))
