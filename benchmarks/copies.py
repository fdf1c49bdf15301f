"""Copies of the checkout and of the installed package, so that commands run side by side.

Tests without a guard may write where they should not: one must not meet what another left behind.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from importlib.metadata import files
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple, TypeVar

ROOT = Path(__file__).resolve().parents[1]
DISTRIBUTION = "aam-seals"
_LEFT_OUT = ("build", "dist", "runs", "outputs", "multirun")
"""Products in the checkout, besides what is hidden."""
Item, Result = TypeVar("Item"), TypeVar("Result")


class Place(NamedTuple):
    """A checkout to run in.

    Args:
        root: its folder.
        own: folder of the copies of package, cache and temporary files; None for the checkout
            itself, with the package as it is installed.
    """

    root: Path = ROOT
    own: Path | None = None

    def environment(self) -> dict[str, str]:
        """Return environment variables under which a child finds the copied package."""
        if self.own is None:
            return dict(os.environ)
        site = os.pathsep.join(filter(None, [str(self.own / "site"), os.getenv("PYTHONPATH", "")]))
        own = {"TMPDIR": str(self.own / "tmp"), "XDG_CACHE_HOME": str(self.own / "cache")}
        return {**os.environ, **own, "PYTHONPATH": site}


@contextlib.contextmanager
def places(count: int) -> Iterator[SimpleQueue[Place]]:
    """Yield a queue of places; the copies are removed afterwards.

    Args:
        count: number of places; 1 for the checkout itself.

    Raises:
        PackageNotFoundError: the package is not installed.
    """
    free: SimpleQueue[Place] = SimpleQueue()
    with tempfile.TemporaryDirectory(prefix="copies-", ignore_cleanup_errors=True) as folder:
        for k in range(count):
            free.put(Place() if count == 1 else _copied(Path(folder) / str(k)))
        yield free


def side_by_side(
    work: Callable[[Item, Place], Result], items: Sequence[Item], jobs: int, seconds: float = 1e9
) -> Iterator[tuple[Item, Result | None]]:
    """Yield the result of every item as it comes, None where the time was up before its turn.

    Args:
        work: of an item and the place where it may run.
        items: in the order in which they begin.
        jobs: number of items at a time, each in a place of its own.
        seconds: time after which no item begins [s].
    """
    end = time.monotonic() + seconds
    jobs = max(1, min(jobs, len(items)))

    def done(item: Item) -> Result | None:
        if time.monotonic() > end:
            return None
        place = free.get()
        try:
            return work(item, place)
        finally:
            free.put(place)

    with places(jobs) as free, ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(done, item): item for item in items}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _copied(own: Path) -> Place:
    """Copy the checkout and the installed package below a folder."""
    root = own / "checkout"
    shutil.copytree(ROOT, root, symlinks=True, ignore=_products)
    for file in files(DISTRIBUTION) or ():
        if ".." in file.parts:
            continue  # the command itself, beside the interpreter
        target = own / "site" / file
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(file.locate(), target)  # with its time, for compiled files to fit
    (own / "tmp").mkdir()
    return Place(root, own)


def _products(folder: str, names: list[str]) -> list[str]:
    top = Path(folder) == ROOT
    return [n for n in names if n == "__pycache__" or (top and (n in _LEFT_OUT or n[0] == "."))]
