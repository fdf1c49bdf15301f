"""Law of one row as machine code for many rows, on several threads."""

from __future__ import annotations

import ctypes
import functools
import itertools
import os
import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.scalar_compiler.graph import Node
from seals.scalar_compiler.kernel import View, followed, written
from seals.scalar_compiler.llvm import text_of

LEAST = 16
"""Rows that are worth a thread: the work of a tenth of a millisecond."""
_LOOP = """define void @rows(ptr %given, ptr %out, ptr %work, i64 %count) {
begin:
  br label %row
row:
  %k = phi i64 [0, %begin], [%next, %row]
  %g = mul i64 %k, {given}
  %o = mul i64 %k, {out}
  %a = getelementptr double, ptr %given, i64 %g
  %b = getelementptr double, ptr %out, i64 %o
  call void @law(ptr %a, ptr %b, ptr %work)
  %next = add i64 %k, 1
  %more = icmp slt i64 %next, %count
  br i1 %more, label %row, label %done
done:
  ret void
}
"""


class RowKernel:
    """Law on arrays of one row, compiled for arrays of many.

    Every row is computed by itself, by the same machine code whatever the others are: results do
    not depend on how many rows or threads there are. Python's lock is not held meanwhile.

    Args:
        law: pure, of arrays; it returns arrays. Their first axis is the batch, or that of links
            within which the batch is: of one row m, of N rows m N, link by link.
        shapes: of its arguments for one row.

    Raises:
        CannotCompile: see `seals.scalar_compiler.compiled`.

    Example:
        >>> double = RowKernel(lambda x: [x + x], [(1, 2)])
        >>> double([np.array([[1.0, 2.0], [3.0, 4.0]])])[0].tolist()
        [[2.0, 4.0], [6.0, 8.0]]
    """

    def __init__(self, law: Callable[..., Sequence[Array]], shapes: Sequence[Any]) -> None:
        self._given = _views(shapes)
        results = followed(law, shapes)
        self._results = _views([x.shape for x in results])
        entries = [entry for x in results for entry in x.entries.flat]
        self._text = text_of(entries)
        loop = _LOOP.replace("{given}", str(_width(self._given)))
        loop = loop.replace("{out}", str(_width(self._results)))
        self._engine, address = written(self._text.lines + loop, "rows")
        kinds = [*[ctypes.c_void_p] * 3, ctypes.c_int64]
        self._call = ctypes.CFUNCTYPE(None, *kinds)(address)
        # results that are numbers stand there from the beginning
        self._blank = np.zeros((1, max(1, len(entries))))
        self._blank[0, : len(entries)] = [0.0 if isinstance(x, Node) else x for x in entries]

    def __call__(self, given: Sequence[Any]) -> list[Floats]:
        """Return the results for arrays of N rows, in memory of their own."""
        return self.results(self.run(self.block(given)))

    def block(self, given: Sequence[Any]) -> Floats:
        """Return the arguments of N rows, a row of numbers each."""
        rows = len(given[0]) // self._given[0].shape[0]
        block = np.empty((rows, _width(self._given)))
        for view, value in zip(self._given, given, strict=True):
            if view.size:
                # rows of numbers of an array whose first axis is the batch within links
                links = view.shape[0]
                array = np.asarray(value, dtype=float)
                if links > 1:
                    array = array.reshape(links, rows, -1).swapaxes(0, 1)
                found: Floats = array.reshape(rows, -1)
                block[:, view.start : view.start + view.size] = found
        return block

    def results(self, out: Floats) -> list[Floats]:
        """Return the results in rows of numbers."""
        return [_cut(out, view) for view in self._results]

    def run(self, block: Floats) -> Floats:
        """Return rows of results for rows of arguments; parts of them on other threads."""
        rows, threads = len(block), cores()
        out = np.repeat(self._blank, rows, axis=0)
        parts = max(1, min(threads, rows // LEAST))
        bounds = [rows * k // parts for k in range(parts + 1)]
        work = [
            functools.partial(self._part, block[a:b], out[a:b])
            for a, b in itertools.pairwise(bounds)
        ]
        if parts > 1:
            # this process's threads: those of another one are gone after a fork
            key = os.getpid(), threads
            if key not in _WORKERS:
                _WORKERS[key] = Workers(threads - 1)
            _WORKERS[key].run(work)
        else:
            work[0]()
        return out

    def _part(self, block: Floats, out: Floats) -> None:
        work = self._text.memory()
        self._call(*(x.ctypes.data for x in (block, out, work)), len(out))


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers:
    """Threads that do parts of a work beside the thread that has it done.

    Args:
        count: of the threads.

    Example:
        >>> found = []
        >>> Workers(2).run([functools.partial(found.append, k) for k in range(5)])
        >>> sorted(found)
        [0, 1, 2, 3, 4]
    """

    def __init__(self, count: int) -> None:
        self._jobs: SimpleQueue[tuple[Callable[[], None], SimpleQueue[None]]] = SimpleQueue()
        for _ in range(count):
            threading.Thread(target=self._serve, name="seals rows", daemon=True).start()

    def run(self, parts: Sequence[Callable[[], None]]) -> None:
        """Do all parts, the first one on this thread; they raise nothing."""
        done: SimpleQueue[None] = SimpleQueue()
        for part in parts[1:]:
            self._jobs.put((part, done))
        parts[0]()
        for _ in parts[1:]:
            done.get()

    def _serve(self) -> None:
        while True:
            part, done = self._jobs.get()
            try:
                part()
            finally:
                done.put(None)


_WORKERS: dict[tuple[int, int], Workers] = {}


def _views(shapes: Sequence[tuple[int, ...]]) -> list[View]:
    """Return places side by side in a row."""
    found, start = [], 0
    for shape in shapes:
        found.append(View(tuple(shape), start))
        start += found[-1].size
    return found


def _width(views: Sequence[View]) -> int:
    return max(1, views[-1].start + views[-1].size) if views else 1


def _cut(out: Floats, view: View) -> Floats:
    """Return a result of all rows; a view where there is one link."""
    rows, (links, *rest) = len(out), view.shape
    part = out[:, view.start : view.start + view.size]
    if links > 1:
        part = part.reshape(rows, links, *rest).swapaxes(0, 1)
    found: Floats = part.reshape(links * rows, *rest)
    return found
