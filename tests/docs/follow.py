"""Follow pages as they are printed, each in an empty folder: ``python -m tests.docs.follow PAGES``.

Without names, all pages. ``--slow`` runs the slow blocks, too; ``--jobs N`` follows N pages at a
time; ``--upto SECONDS`` leaves out pages whose blocks take longer; ``--show`` shows all that the
commands print. ``--results FILE`` writes after each page what was found, and the same words go on
with what is not in it, has changed or was wrong. Exit code: 0 when all is as printed, 1 when not.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from tests.docs.pages import Block, blocks, name_of, pages
from tests.docs.session import ROOT, Session, stop


class Tally(NamedTuple):
    """What was done on pages: blocks followed, commands run, figures compared, faults found."""

    blocks: int
    commands: int
    figures: int
    faults: list[str]
    seconds: float = 0.0


class Results:
    """What was found on pages, in a file that is whole after each of them.

    Args:
        path: of the file; None keeps nothing.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        kept = json.loads(path.read_text("utf-8")) if path and path.is_file() else {}
        self.kept: dict[str, dict[str, Any]] = kept

    def of(self, page: Path, *, slow: bool) -> Tally | None:
        """Return what was found on a page that is still the same; None where it must be run."""
        kept = self.kept.get(name_of(page))
        if kept is None or kept["page"] != digest(page, slow=slow) or kept["faults"]:
            return None
        return Tally(**{name: kept[name] for name in Tally._fields})

    def note(self, page: Path, found: Tally, read: str) -> None:
        """Write down what was found on a page, whose blocks were those of a digest."""
        self.kept[name_of(page)] = {"page": read, **found._asdict()}
        if self.path is not None:
            part = self.path.with_name(f"{self.path.name}.part")
            part.write_text(json.dumps(self.kept, indent=1), encoding="utf-8")
            part.replace(self.path)


def digest(page: Path, *, slow: bool) -> str:
    """What is followed on a page, and how: neither free prose nor the times of marks."""
    told = [
        (b.language, b.text, b.file, b.when, b.in_clone)
        for b in blocks(page.read_text(encoding="utf-8"))
    ]
    return hashlib.sha256(repr((told, slow)).encode()).hexdigest()


def follow(page: Path, folder: Path, *, slow: bool = False) -> Tally:
    """Run the blocks of a page in order.

    Args:
        page: the page in Markdown.
        folder: empty folder to work in.
        slow: whether slow blocks are run, too.

    Raises:
        AssertionError: a command ended or printed otherwise than the page says.
    """
    tally = walk(page, folder, slow=slow)
    assert not tally.faults, "\n\n".join(tally.faults)
    return tally


def walk(
    page: Path,
    folder: Path,
    *,
    slow: bool = False,
    tell: Callable[[Block, float, str], None] = lambda block, seconds, printed: None,
) -> Tally:
    """Run the blocks of a page in order, on beyond what is wrong.

    Args:
        page: the page in Markdown.
        folder: empty folder to work in.
        slow: whether slow blocks are run, too.
        tell: called with each block that was followed, the seconds it took, and what it printed.
    """
    session, done, begun = Session(folder), 0, time.perf_counter()
    for block in blocks(page.read_text(encoding="utf-8")):
        if not due(block, slow=slow):
            if block.steps:
                session.pass_by()
            continue
        start, before = time.perf_counter(), len(session.printed)
        session.follow(block)
        done += block.language != "printed"
        tell(block, time.perf_counter() - start, "\n".join(session.printed[before:]))
    faults = [f"{name_of(page)}.md:{fault}" for fault in session.faults]
    took = time.perf_counter() - begun
    return Tally(done, session.commands, session.figures, faults, took)


def due(block: Block, *, slow: bool) -> bool:
    """Whether a block is followed."""
    return block.when == "always" or (slow and block.when == "slow")


class Progress:
    """Prints each block that was followed, and the time left.

    The time left is what the pages say, times how much longer than they say it took so far.
    """

    def __init__(self, work: dict[Path, list[Block]], *, jobs: int, show: bool) -> None:
        found = [block for page in work.values() for block in page]
        self.total = sum(len(block.steps) for block in found)
        self.left = sum(block.seconds for block in found)
        self.jobs, self.show = jobs, show
        self.done = 0
        self.said = self.spent = 10.0
        self.lock = threading.Lock()

    def tell(self, page: Path, block: Block, seconds: float, printed: str) -> None:
        """Say that a block was followed."""
        if not block.steps:
            return
        with self.lock:
            self.done += len(block.steps)
            self.left -= block.seconds
            self.said += block.seconds
            self.spent += seconds
            left = clock(self.left / self.jobs * self.spent / self.said)
            first = block.steps[0].command if block.language == "console" else "a program"
            print(
                f"[{self.done}/{self.total}] {name_of(page)}.md:{block.line}  {seconds:.1f} s  "
                f"{first.partition(chr(10))[0][:60]}  (about {left} left)",
                flush=True,
            )
            if self.show:
                print(printed, flush=True)


def clock(seconds: float) -> str:
    """A time in words: seconds below two minutes, else minutes."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def main(words: list[str]) -> int:
    """Follow the pages named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.docs.follow", description=__doc__)
    parser.add_argument("pages", nargs="*", type=Path, default=pages(ROOT))
    parser.add_argument("--slow", action="store_true")
    parser.add_argument("--show", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--upto", type=float, default=float("inf"))
    parser.add_argument("--results", type=Path)
    told = parser.parse_args(words)
    # a shell ignores Ctrl-C for what it starts in the background, and so would every command
    signal.signal(signal.SIGINT, signal.default_int_handler)
    results = Results(told.results)
    done = [found for page in told.pages if (found := results.of(page, slow=told.slow))]
    work = {
        page: [b for b in blocks(page.read_text(encoding="utf-8")) if due(b, slow=told.slow)]
        for page in told.pages
        if results.of(page, slow=told.slow) is None
    }
    cost = {page: sum(block.seconds for block in found) for page, found in work.items()}
    names = sorted((page for page in work if cost[page] <= told.upto), key=lambda page: cost[page])
    progress = Progress({page: work[page] for page in names}, jobs=told.jobs, show=told.show)
    start = time.perf_counter()

    def one(page: Path) -> None:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place) / "bare"
            folder.mkdir()
            read = digest(page, slow=told.slow)
            found = walk(page, folder, slow=told.slow, tell=partial(progress.tell, page))
        with progress.lock:
            done.append(found)
            results.note(page, found, read)
        for fault in found.faults:
            print(f"\n{fault}\n", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(told.jobs) as pool:
        running = [pool.submit(one, page) for page in names]
        try:
            for page in running:
                page.result()
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            stop()
            return 130
    faults = sum(len(tally.faults) for tally in done)
    print(
        f"{len(done)} pages: {sum(t.commands for t in done)} commands run, "
        f"{sum(t.figures for t in done)} figures compared, {faults} wrong, "
        f"in {clock(time.perf_counter() - start)}"
    )
    return int(faults > 0)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
