"""Fault injection: every write, flush, rename and close fails or kills once; results are checked.

    python benchmarks/faults.py [CASE ...] [--jobs N] [--share K/N] [--out FOLDER]
                                [--most POINTS] [--seconds S] [--fresh]
    python benchmarks/faults.py --told FOLDER

A library in C that is loaded before all others counts the calls below the command's folder and
ends, or fails, the n-th, for n from 1 to the last. Afterwards the folder is as before, complete, or
of a run that says that it was cut off; what can be taken up is. One process a case imports
everything and makes the files that the command needs; it forks a child a point. With ``--fresh``,
each point is tried once more in a process that starts afresh, and both must come to the same.
Each point becomes a line in ``--out`` as it ends: ``--told`` sums up a call that was cut off, too.
Linux, with a C compiler.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import io
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
# at the end: the installed package comes before the checkout
sys.path.append(str(HERE.parent))

from benchmarks.fault_points import MODES, Fate, last_of, needed, run, tried  # noqa: E402

SHIM = HERE / "fault_shim.c"
_ALONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Threads of a parent are not there in its children, which would wait for them."""
_MEMORY_DISK = Path("/dev/shm")


class Tokens:
    """As many processes at a time as there are tokens in a pipe that all cases share."""

    def __init__(self, ears: int, mouth: int) -> None:
        self.ears, self.mouth = ears, mouth
        os.set_blocking(ears, False)

    @classmethod
    def made(cls, count: int) -> Tokens:
        """Return a pipe with so many tokens."""
        tokens = cls(*os.pipe())
        os.write(tokens.mouth, b"." * count)
        return tokens

    def take(self, patience: float) -> bool:
        """Return whether a token came within a time [s]."""
        select.select([self.ears], [], [], patience)
        try:
            return bool(os.read(self.ears, 1))
        except BlockingIOError:  # another case was faster
            return False

    def give(self) -> None:
        """Put a token back."""
        os.write(self.mouth, b".")


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


def reports(names: Sequence[str], *more: str, jobs: int = 1) -> Iterator[str]:
    """Run cases, each in a process of its own, and yield their output lines.

    Args:
        names: of the cases.
        more: further words of this command.
        jobs: number of points at a time.

    Raises:
        OSError: there is no C compiler here.
    """
    shim = library()
    tokens = Tokens.made(jobs)
    environment = {**os.environ, **_ALONE, "LD_PRELOAD": str(shim)}
    line = [sys.executable, "-P", str(HERE / "faults.py"), *more]
    line += ["--tokens", str(tokens.ears), str(tokens.mouth)]
    worst = 0
    try:
        running = [
            subprocess.Popen(
                [*line, name],
                env=environment,
                stdout=subprocess.PIPE,
                text=True,
                pass_fds=(tokens.ears, tokens.mouth),
            )
            for name in names
        ]
        for process in running:
            with process:
                assert process.stdout is not None
                yield from process.stdout
            worst = max(worst, abs(process.returncode))
        yield f"exit code {worst}\n"
    finally:
        os.close(tokens.ears)
        os.close(tokens.mouth)
        shutil.rmtree(shim.parent)


class Server:
    """The points of one case; runs in a process with the shim."""

    def __init__(self, name: str, given: argparse.Namespace, tokens: Tokens) -> None:
        from benchmarks.fault_cases import CASES

        self.name, self.case, self.given, self.tokens = name, CASES[name], given, tokens
        home = _MEMORY_DISK if os.access(_MEMORY_DISK, os.W_OK) else None
        self.root = Path(tempfile.mkdtemp(prefix="faults-", dir=home)).resolve()
        self.base = self.root / "base"
        self.bad: list[str] = []
        self.counts: dict[str, collections.Counter[str]] = {m: collections.Counter() for m in MODES}
        self.calls, self.peak = 0, 0
        self.running: dict[int, tuple[str, int]] = {}

    def prepare(self) -> None:
        """Make the folder, import everything, and run once without a fault."""
        self.base.mkdir()
        os.chdir(self.base)
        if not self.given.fresh:
            # write pictures without drawing anything in them, which takes most of a short command
            from matplotlib.figure import Figure

            Figure.draw = lambda figure, renderer: None
        self.case.prepare(self.base)
        place = self.root / "place"
        shutil.copytree(self.base, place)
        os.chdir(place)
        # once in this process: what is imported here is there in all children
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            self.case.start()
        os.chdir(self.root)
        shutil.rmtree(place)
        for fresh in (False, True) if {"address"} & {*self.given.modes} else (False,):
            shutil.copytree(self.base, place)
            end = run(place, self.case.words, 0, 0, fresh=fresh)
            whole = Fate(_verdict(self.case, self.base, place, end.code), end.code)
            shutil.rmtree(place)
            if whole != Fate("complete", self.case.code):
                self.bad.append(f"{self.name}: without a fault it is {whole}: {end.said[-900:]}")
                return
            self.calls = self.calls or end.calls
            self.peak = end.peak
        needed(self.peak)

    def points(self) -> Iterator[tuple[str, int]]:
        """Yield mode and number of every point of this share."""
        every = list[tuple[str, int]]()
        for mode in self.given.modes:
            last = last_of(mode, self.calls)
            step = max(1, -(-last // self.given.most)) if self.given.most else 1
            every += [(mode, n) for n in range(1, last + 1, step)]
        part, _, parts = self.given.share.partition("/")
        yield from every[int(part) :: int(parts)]

    def serve(self) -> None:
        """Try every point, as many at a time as there are tokens."""
        while not self.tokens.take(60.0):
            pass
        try:
            self.prepare()
        finally:
            self.tokens.give()
        self.note()
        if self.bad:
            return
        end = time.monotonic() + self.given.seconds
        for mode, n in self.points():
            while not self.tokens.take(0.05):
                self.reap()
            if time.monotonic() > end:
                self.tokens.give()
                self.counts[mode]["left out"] += 1
                continue
            number = os.fork()
            if number == 0:
                self._try(mode, n)
            self.running[number] = (mode, n)
            self.reap()
        while self.running:
            self.reap()
            time.sleep(0.01)

    def _try(self, mode: str, n: int) -> None:
        """Be the process that tries a point: never returns."""
        code = 1
        try:
            place = self.root / f"{mode}_{n}"
            fate = tried(self.case, self.base, place, mode, n)
            if self.given.fresh and mode not in ("memory", "address"):
                other = tried(self.case, self.base, place, mode, n, fresh=True)
                if other != fate:
                    fate = Fate(f"forked {fate}, fresh {other}", fate.code)
            (self.root / f"{mode}_{n}.json").write_text(json.dumps(fate))
            code = 0
        finally:
            os._exit(code)

    def reap(self) -> None:
        """Note the points that are done."""
        for number, (mode, n) in list(self.running.items()):
            if not os.waitpid(number, os.WNOHANG)[0]:
                continue
            del self.running[number]
            self.tokens.give()
            told = self.root / f"{mode}_{n}.json"
            fate = Fate(*json.loads(told.read_text())) if told.exists() else Fate("not judged", -1)
            kind = ("crashed, " if fate.crashed else "") + self._kind(fate)
            self.counts[mode][kind] += 1
            if fate.bad:
                last = last_of(mode, self.calls)
                self.bad.append(f"{self.name}, {mode} at {n} of {last}: {fate.verdict}")
            self.note(kind, mode, n, fate)

    @staticmethod
    def _kind(fate: Fate) -> str:
        return "bad" if fate.bad else fate.verdict

    def note(self, kind: str = "", mode: str = "", n: int = 0, fate: Fate | None = None) -> None:
        """Add a line on a point, or what there is to do, to the file of this case."""
        if self.given.out is None:
            return
        facts: dict[str, Any] = {"calls": self.calls, "all": len([*self.points()])}
        if fate is not None:
            facts = {"mode": mode, "n": n, "kind": kind, "code": fate.code}
            facts |= {"bad": fate.verdict} if fate.bad else {}
        elif self.bad:
            facts = {"bad": self.bad[0]}
        with (self.given.out / f"{self.name.replace(' ', '_')}.jsonl").open("a") as file:
            file.write(json.dumps(facts) + "\n")

    @property
    def total(self) -> int:
        """Number of points that were tried."""
        kinds = [(k, v) for count in self.counts.values() for k, v in count.items()]
        return sum(v for k, v in kinds if k != "left out")


def _verdict(case: Any, base: Path, place: Path, code: int) -> str:
    from benchmarks.fault_points import judged

    return judged(case, base, place, code)


def served(name: str, given: argparse.Namespace) -> int:
    """Try the points of one case and report."""
    start, server = time.monotonic(), Server(name, given, Tokens(*given.tokens))
    try:
        server.serve()
    finally:
        shutil.rmtree(server.root, ignore_errors=True)
    seconds = time.monotonic() - start
    kinds = sum(server.counts.values(), collections.Counter())
    told = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()) if kind != "bad")
    print(f"{name}: {server.total} points, {len(server.bad)} bad, {seconds:.0f} s; {told}")
    for words in server.bad:
        print(f"  {words}")
    return int(bool(server.bad))


def told(folder: Path) -> Iterator[str]:
    """Yield a line on each case of a folder, with its bad points behind it, and one on them all."""
    sums = collections.Counter[str]()
    for file in sorted(folder.glob("*.jsonl")):
        kinds, bad, every = collections.Counter[str](), list[str](), 0
        lines = file.read_text().split("\n")
        for facts in map(json.loads, lines[:-1]):  # what a cut left of a line is no point
            every += facts.get("all", 0)
            if "kind" in facts:
                kinds[f"{facts['mode']} {facts['kind']}"] += 1
            if "bad" in facts:
                bad.append(f"{facts.get('mode', 'start')} at {facts.get('n', 0)}: {facts['bad']}")
        sums.update(tried=kinds.total(), all=every, bad=len(bad))
        words = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
        yield f"{file.stem}: {kinds.total()} of {every} points tried, {len(bad)} bad; {words}"
        yield from (f"  {line}" for line in bad)
    yield f"all: {sums['tried']} of {sums['all']} points tried, {sums['bad']} bad"


def main(arguments: Sequence[str]) -> int:
    """Run the named cases, or all."""
    from benchmarks.fault_cases import CASES

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", nargs="*", default=list(CASES), metavar="CASE")
    parser.add_argument("--most", type=int, default=0, help="points of a case and mode; 0 for all")
    parser.add_argument("--modes", default=",".join(MODES), help=",".join(MODES))
    parser.add_argument("--jobs", type=int, default=1, help="points at a time")
    parser.add_argument("--share", default="0/1", help="K/N: every N-th point, from the K-th")
    parser.add_argument("--seconds", type=float, default=1e9, help="after which no point begins")
    parser.add_argument("--fresh", action="store_true", help="compare with fresh processes")
    parser.add_argument("--out", type=Path, help="folder of a file of lines for each case")
    parser.add_argument("--told", type=Path, help="sum up such a folder")
    parser.add_argument("--tokens", type=int, nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    unknown = [*{*given.case} - {*CASES}, *{*given.modes.split(",")} - {*MODES}]
    if unknown:
        parser.error(f"there is no {unknown[0]}; there are {', '.join((*CASES, *MODES))}")
    if given.told:
        print("\n".join(told(given.told)))
        return 0
    if given.out:
        given.out = given.out.resolve()
        given.out.mkdir(parents=True, exist_ok=True)
        for file in () if given.tokens else given.out.glob("*.jsonl"):
            file.unlink()  # of an earlier call
    if given.tokens:
        given.modes = given.modes.split(",")
        return served(given.case[0], given)
    last = ""
    for last in reports(given.case, *_passed_on(given), jobs=given.jobs):
        print(last, end="", flush=True)
    if given.out:
        print("\n".join(told(given.out)))
    return int(last.split()[-1])


def _passed_on(given: argparse.Namespace) -> list[str]:
    words = ["--most", str(given.most), "--modes", given.modes, "--seconds", str(given.seconds)]
    words += ["--share", given.share]
    return [*words, *["--fresh"] * given.fresh, *(["--out", str(given.out)] if given.out else [])]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
