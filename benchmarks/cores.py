"""What a second core adds to many worlds: ``python benchmarks/cores.py``.

The same blocks are made by one worker and by two at once, in turn, by the clock: worlds in threads
of one process (the loop of machine code holds no lock of the interpreter), worlds in processes,
and environments of Gymnasium in processes. Other programs take cores away, so the best pair counts
beside the median. The last line is 64 environments of Hover behind Gymnasium's vector interface, a
process of its own, which spreads rows over the cores by itself.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import machine
import speed

STEPS = {"aam in air": 6000, "chain crossing": 9000, "gymnasium Hover": 400}
"""Steps of a block: about 0.1 to 0.3 s."""
_KEPT, _BUILDING = threading.local(), threading.Lock()


def block(case: str) -> tuple[float, float]:
    """Make the steps of a case; return when they began and ended by the clock [s]."""
    found = getattr(_KEPT, case, None)
    if found is None:
        # Hydra composes for one thread at a time
        with _BUILDING, tempfile.TemporaryDirectory() as folder:
            found = speed.built(case, Path(folder))
            setattr(_KEPT, case, found)
            _made(found, STEPS[case])
    found.again()
    begin = time.perf_counter()
    _made(found, STEPS[case])
    return begin, time.perf_counter()


def _made(found: Any, steps: int) -> None:
    if found.each == 1:
        found.world.advance(steps)
    else:
        for _ in range(steps):
            found.step()


def paired(pool: Executor, case: str, repeats: int) -> list[tuple[float, float]]:
    """Return steps a second by one worker and by two, in turn."""
    for _ in range(4):
        list(pool.map(block, [case] * 2))

    def pace(workers: int) -> float:
        spans = list(pool.map(block, [case] * workers))
        began, ended = min(a for a, _ in spans), max(b for _, b in spans)
        return workers * STEPS[case] / (ended - began)

    return [(pace(1), pace(2)) for _ in range(repeats)]


def vector(count: int, repeats: int) -> list[float]:
    """Return control steps a second of Hover behind Gymnasium's vector interface."""
    found = speed.built(f"gymnasium Hover, {count}", Path())
    found.again()
    paces = []
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(speed.CONTROLS):
            found.step()
        paces.append(count * speed.CONTROLS / (time.perf_counter() - begin))
    return paces


def told(name: str, rows: Sequence[tuple[float, float]]) -> str:
    """Return one line.

    Example:
        >>> told("a", [(1.0, 1.5), (2.0, 3.8), (1.0, 3.0)])
        'a: one 1, two 3 steps/s; ratio 1.90, of the best 1.90'
    """
    one, two = zip(*rows, strict=True)
    middle = statistics.median(b / a for a, b in rows)
    paces = f"one {statistics.median(one):,.0f}, two {statistics.median(two):,.0f} steps/s"
    return f"{name}: {paces}; ratio {middle:.2f}, of the best {max(two) / max(one):.2f}"


def main() -> None:
    """Print a line for each kind of worker."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=25, help="pairs of blocks")
    repeats = parser.parse_args().repeats
    print(machine.describe())
    spawn = get_context("spawn")
    kinds: dict[str, Callable[[], Executor]] = {
        "threads": lambda: ThreadPoolExecutor(2),
        "processes": lambda: ProcessPoolExecutor(2, mp_context=spawn),
    }
    for kind, case in (
        *(("threads", "aam in air"), ("processes", "aam in air")),
        *(("processes", "chain crossing"), ("processes", "gymnasium Hover")),
    ):
        with kinds[kind]() as pool:
            print(told(f"{case}, {kind}", paired(pool, case, repeats)), flush=True)
    with ProcessPoolExecutor(1, mp_context=spawn) as pool:
        paces = pool.submit(vector, speed.MANY, repeats).result()
    best, middle = max(paces), statistics.median(paces)
    print(f"Hover x {speed.MANY}: median {middle:,.0f}, best {best:,.0f} control steps/s")


if __name__ == "__main__":
    machine.one_thread()
    main()
