"""Follow pages as they are printed, each in an empty folder: ``python -m tests.docs.follow PAGES``.

Without names, all pages. ``--slow`` runs the slow blocks, too; ``--jobs N`` follows N pages at a
time; ``--upto SECONDS`` leaves out pages whose blocks take longer; ``--show`` shows all that the
commands print. Exit code: 0 when all is as
printed, 1 when not.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

from tests.docs.pages import Block, blocks, name_of, pages
from tests.docs.session import ROOT, Session, stop


class Tally(NamedTuple):
    """What was done on pages: blocks followed, commands run, figures compared, faults found."""

    blocks: int
    commands: int
    figures: int
    faults: list[str]


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
    session, done = Session(folder), 0
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
    return Tally(done, session.commands, session.figures, faults)


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
    told = parser.parse_args(words)
    # a shell ignores Ctrl-C for what it starts in the background, and so would every command
    signal.signal(signal.SIGINT, signal.default_int_handler)
    work = {
        page: [b for b in blocks(page.read_text(encoding="utf-8")) if due(b, slow=told.slow)]
        for page in told.pages
    }
    cost = {page: sum(block.seconds for block in found) for page, found in work.items()}
    names = sorted((page for page in work if cost[page] <= told.upto), key=lambda page: cost[page])
    progress = Progress({page: work[page] for page in names}, jobs=told.jobs, show=told.show)
    start = time.perf_counter()
    done: list[Tally] = []

    def one(page: Path) -> None:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place) / "bare"
            folder.mkdir()
            done.append(walk(page, folder, slow=told.slow, tell=partial(progress.tell, page)))
        for fault in done[-1].faults:
            print(f"\n{fault}\n", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(told.jobs) as pool:
        results = [pool.submit(one, page) for page in names]
        try:
            for result in results:
                result.result()
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            stop()
            return 130
    faults = sum(len(tally.faults) for tally in done)
    print(
        f"{len(names)} pages: {sum(t.commands for t in done)} commands run, "
        f"{sum(t.figures for t in done)} figures compared, {faults} wrong, "
        f"in {clock(time.perf_counter() - start)}"
    )
    return int(faults > 0)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
