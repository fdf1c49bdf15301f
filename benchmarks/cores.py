"""What a second core adds to many worlds: ``python benchmarks/cores.py``.

The same blocks are made by one worker and by two at once, in turn, by the clock: worlds in threads
of one process (the loop of machine code holds no lock of the interpreter), worlds in processes,
and environments of Gymnasium in processes. Other programs take cores away: pairs of blocks during
which they had less than a twentieth of the cores are told apart. The last line is 64 environments
of Hover behind Gymnasium's vector interface, in a process of its own, which spreads rows over the
cores by itself.
"""

from __future__ import annotations

import argparse
import os
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

STEPS = {"aam in air": 18000, "chain crossing": 27000, "gymnasium Hover": 500}
"""Steps of a block: about 0.3 s."""
FREE = 0.05
"""Share of both cores that other programs may have during a pair of blocks [1]."""
_KEPT, _BUILDING = threading.local(), threading.Lock()


def block(case: str) -> tuple[float, float, float]:
    """Make the steps of a case; return when they began and ended, and the processor's time [s]."""
    found = getattr(_KEPT, case, None)
    if found is None:
        # Hydra composes for one thread at a time
        with _BUILDING, tempfile.TemporaryDirectory() as folder:
            found = speed.built(case, Path(folder))
            setattr(_KEPT, case, found)
            _made(found, STEPS[case])
    found.again()
    begin, used = time.perf_counter(), time.thread_time()
    _made(found, STEPS[case])
    return begin, time.perf_counter(), time.thread_time() - used


def _made(found: Any, steps: int) -> None:
    if found.each == 1:
        found.world.advance(steps)
    else:
        for _ in range(steps):
            found.step()


def paired(pool: Executor, case: str, repeats: int) -> list[tuple[float, float, float]]:
    """Return steps a second by one worker and by two, in turn, and the share of others [1]."""
    for _ in range(4):
        list(pool.map(block, [case] * 2))

    def pace(workers: int) -> tuple[float, float]:
        busy = _busy()
        began, ended, used = zip(*pool.map(block, [case] * workers), strict=True)
        span, others = max(ended) - min(began), _busy() - busy - sum(used)
        return workers * STEPS[case] / span, others / (2.0 * span)

    pairs = [(pace(1), pace(2)) for _ in range(repeats)]
    return [(one, two, max(a, b)) for (one, a), (two, b) in pairs]


def _busy() -> float:
    """Time that all cores have worked [s]."""
    first = Path("/proc/stat").read_text(encoding="utf-8").splitlines()[0]
    user, nice, system, _, _, irq, soft, *_ = map(int, first.split()[1:])
    return (user + nice + system + irq + soft) / os.sysconf("SC_CLK_TCK")


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


def told(name: str, rows: Sequence[tuple[float, float, float]]) -> str:
    """Return one line.

    Example:
        >>> told("a", [(1.0, 1.5, 0.4), (2.0, 3.8, 0.01), (1.0, 1.4, 0.2)])
        'a: one 1, two 2 steps/s; ratio 1.50, 1.90 in 1 pairs with free cores'
    """
    one, two, _ = (statistics.median(column) for column in zip(*rows, strict=True))
    ratio = statistics.median(b / a for a, b, _ in rows)
    free = [b / a for a, b, others in rows if others < FREE]
    quiet = f"{statistics.median(free):.2f}" if free else "unknown"
    words = f"ratio {ratio:.2f}, {quiet} in {len(free)} pairs with free cores"
    return f"{name}: one {one:,.0f}, two {two:,.0f} steps/s; {words}"


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
