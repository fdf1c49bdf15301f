"""Parallel runs of independent fits in forked processes, which share the log copy-on-write.

Results come back through the pipe of `multiprocessing`, which pickles them. Both ends are this
program: the children are forked from this very process, and nothing that is pickled comes from a
file or from a socket that others can write to.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from multiprocessing.pool import Pool
from typing import Any, TypeVar

from seals.run.stopping import ENDING, ending

Item = TypeVar("Item")
_HELD = (*ENDING, signal.SIGINT)
"""Signals that are held back until a child has its own handlers."""
_jobs: tuple[Callable[[Any], Any], Sequence[Any]] | None = None


def cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def spread(work: Callable[[Item], Any], items: Sequence[Item], processes: int) -> list[Any]:
    """Apply a function to every item in parallel processes; results keep the order.

    Args:
        work: any callable, closures too: children are forked from this very process.
        items: what it is applied to; children know them by number, so they may be anything.
        processes: children at once; one means no child at all.

    Returns:
        The results, in the order of the items; they travel back by pickle.
    """
    global _jobs  # noqa: PLW0603  forked children find closures here: they cannot be pickled
    many = min(processes, len(items))
    forks = "fork" in multiprocessing.get_all_start_methods()
    if many < 2 or not forks or multiprocessing.current_process().daemon:
        return [work(item) for item in items]
    _jobs = work, items
    try:
        with _forked(many) as pool:
            return pool.map(_call, range(len(items)), chunksize=1)
    finally:
        _jobs = None


def _forked(many: int) -> Pool:
    """Return a pool whose children get no signal before they have handlers of their own.

    A child that starts late can be ended by the pool while it still has the parent's handler. One
    that only notes the signal, or whose exception is lost in a hook of the fork, would let the
    child go on, and the pool would wait for it for ever.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _HELD)
    try:
        return multiprocessing.get_context("fork").Pool(many, _leave_signals)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _leave_signals() -> None:
    """End a child at once on SIGTERM or SIGHUP, and leave all other signals to the parent.

    A child inherits the parent's handlers, and the pool ends its children by SIGTERM: a handler
    that raises would print a traceback of work that is already done. A signal to the whole process
    group, such as that of `timeout`, would end a child that holds the lock of the pool's queue, and
    the parent would wait for that lock for ever: children have a group of their own.
    """
    os.setpgid(0, 0)
    for number in ending():
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD)


def _call(number: int) -> Any:
    assert _jobs is not None
    work, items = _jobs
    return work(items[number])
