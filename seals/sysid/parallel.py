"""Parallel runs of independent fits in forked processes, which share the log copy-on-write.

Results come back through the pipe of `multiprocessing`, which pickles them. Both ends are this
program: the children are forked from this very process, and nothing that is pickled comes from a
file or from a socket that others can write to.

`concurrent.futures` is not used: its children wait for work for ever where the parent was killed,
and have no public way to be ended in the midst of a fit.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import struct
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any, TypeVar, cast

from seals.run.stopping import ENDING, ending

if TYPE_CHECKING:
    from multiprocessing.context import ForkProcess

Item = TypeVar("Item")
_HELD = (*ENDING, signal.SIGINT)
"""Signals that are held back until a child has its own handlers."""
_NUMBER = struct.Struct("<i")
_MOST = 16_000
"""Items at once: their numbers fit a pipe."""


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

    Raises:
        RuntimeError: a child ended without its result.
    """
    many = min(processes, len(items))
    forks = "fork" in multiprocessing.get_all_start_methods()
    if many < 2 or not forks or multiprocessing.current_process().daemon:
        return [work(item) for item in items]
    if len(items) > _MOST:
        first = spread(work, items[:_MOST], processes)
        return first + spread(work, items[_MOST:], processes)
    # whoever is free takes the next number: four bytes of a pipe are read at once or not at all
    waiting, given = os.pipe()
    try:
        os.write(given, b"".join(_NUMBER.pack(n) for n in range(len(items))))
    finally:
        os.close(given)
    found: dict[int, Any] = {}
    children, ends = [], []
    try:
        for _ in range(many):
            here, there = multiprocessing.Pipe(duplex=False)
            ends.append(here)
            children.append(_forked(_serve, (work, items, waiting, ends, there)))
            there.close()
        while ends:
            for end in cast("list[Connection]", wait(ends)):
                try:
                    number, fine, result = end.recv()
                except EOFError:
                    ends.remove(end)
                    continue
                if not fine:
                    raise result
                found[number] = result
    finally:
        os.close(waiting)
        for child in children:
            child.terminate()
        for child in children:
            child.join()
    if len(found) < len(items):
        raise RuntimeError(f"a process ended without its result: {len(found)} of {len(items)}")
    return [found[n] for n in range(len(items))]


def _serve(
    work: Callable[[Item], Any],
    items: Sequence[Item],
    waiting: int,
    ends: Sequence[Connection],
    there: Connection,
) -> None:
    """Work in a child until no number is left, or until nobody reads."""
    _leave_signals(ends)
    while taken := os.read(waiting, _NUMBER.size):
        (number,) = _NUMBER.unpack(taken)
        try:
            answer = (number, True, work(items[number]))
        except Exception as fault:
            answer = (number, False, fault)
        if not _sent(there, answer):
            return


class Beside:
    """One job in a forked process, in parallel with the current process.

    Args:
        job: any callable, closures too; its result travels back by pickle.
        processes: at once; with one the job is done here when its result is asked for.
    """

    def __init__(self, job: Callable[[], Any], processes: int) -> None:
        self._job = job
        self._end: Connection | None = None
        self._child: ForkProcess | None = None
        forks = "fork" in multiprocessing.get_all_start_methods()
        if processes < 2 or not forks or multiprocessing.current_process().daemon:
            return
        here, there = multiprocessing.Pipe(duplex=False)
        self._end, self._child = here, _forked(_answer, (job, here, there))
        there.close()

    def result(self) -> Any:
        """Wait for the result, or for what the job raises.

        Raises:
            RuntimeError: the child ended without a result.
        """
        if self._child is None or self._end is None:
            return self._job()
        try:
            fine, result = self._end.recv()
        except EOFError as cause:
            raise RuntimeError("a process ended without its result") from cause
        finally:
            self.stop()
        if not fine:
            raise result
        return result

    def stop(self) -> None:
        """End the child, whatever it has done."""
        if self._child is not None and self._end is not None:
            self._child.terminate()
            self._child.join()
            self._end.close()
            self._child = self._end = None


def _answer(job: Callable[[], Any], here: Connection, there: Connection) -> None:
    """Do one job in a child."""
    _leave_signals([here])
    try:
        answer = (True, job())
    except Exception as fault:
        answer = (False, fault)
    _sent(there, answer)


def _sent(there: Connection, answer: tuple[Any, ...]) -> bool:
    """Send an answer to the parent; false where it was killed."""
    try:
        there.send(answer)
    except BrokenPipeError:
        return False
    return True


def _forked(target: Callable[..., None], arguments: tuple[Any, ...]) -> ForkProcess:
    """Fork a child that gets no signal before it has handlers of its own.

    A child that starts late can be ended while it still has the parent's handler. One that only
    notes the signal, or whose exception is lost in a hook of the fork, would let the child go on,
    and the parent would wait for it for ever.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _HELD)
    try:
        child = multiprocessing.get_context("fork").Process(
            target=target, args=arguments, daemon=True
        )
        child.start()
        return child
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _leave_signals(ends: Sequence[Connection]) -> None:
    """End a child at once on SIGTERM or SIGHUP, and leave all other signals to the parent.

    A child inherits the parent's handlers, and the pool ends its children by SIGTERM: a handler
    that raises would print a traceback of work that is already done. A signal to the whole process
    group, such as that of `timeout`, would end a child that holds the lock of the pool's queue, and
    the parent would wait for that lock for ever: children have a group of their own.

    Args:
        ends: of the parent, which are closed: a child that held them would never learn of its end.
    """
    for end in ends:
        end.close()
    os.setpgid(0, 0)
    for number in ending():
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD)
