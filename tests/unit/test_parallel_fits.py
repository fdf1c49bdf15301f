"""Fits in forked processes: order, and signals that children must not inherit."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from seals.run.stopping import stoppable
from seals.sysid.parallel import Beside, spread


def test_results_keep_the_order_of_the_items() -> None:
    """The results come back in the order of what was given."""
    assert spread(lambda x: x * x, range(7), 2) == [x * x for x in range(7)]


def test_children_do_not_inherit_handlers_that_raise() -> None:
    """The pool ends its children by SIGTERM: the parent's handler would print tracebacks."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("no forked processes on this system")
    with stoppable():
        found = spread(
            lambda _: (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)),
            range(2),
            2,
        )
    assert found == [(signal.SIG_DFL, signal.SIG_IGN)] * 2


def test_a_signal_to_the_whole_group_ends_parent_and_children() -> None:
    """As `timeout` and process managers send it: one child idle, one at work, nobody hangs."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("no forked processes on this system")
    program = (
        "import signal, time\n"
        "from seals.sysid.parallel import spread\n"
        "def stop(*_):\n"
        "    raise SystemExit(5)\n"
        "signal.signal(signal.SIGTERM, stop)\n"
        "print('ready', flush=True)\n"
        "spread(lambda seconds: time.sleep(seconds), [0.05, 120.0], 2)\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        time.sleep(1.5)
        os.killpg(parent.pid, signal.SIGTERM)
        try:
            assert parent.wait(30.0) == 5
        finally:
            if parent.poll() is None:
                os.killpg(parent.pid, signal.SIGKILL)


def test_a_child_that_starts_late_is_ended_too(tmp_path: Path) -> None:
    """The work is done before it has handlers of its own; the parent's only notes the signal."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("no forked processes on this system")
    program = (
        "import contextlib, os, signal, sys, time\n"
        "from seals.sysid import parallel\n"
        "usual = parallel._leave_signals\n"
        "def late(ends):\n"
        "    with contextlib.suppress(FileExistsError):\n"
        "        os.close(os.open(sys.argv[1], os.O_CREAT | os.O_EXCL))\n"
        "        time.sleep(2.0)\n"
        "    usual(ends)\n"
        "parallel._leave_signals = late\n"
        "signal.signal(signal.SIGTERM, lambda *_: None)\n"
        "assert parallel.spread(lambda x: x, range(2), 2) == [0, 1]\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "first")]
    with subprocess.Popen(command, start_new_session=True) as parent:
        try:
            assert parent.wait(30.0) == 0
        finally:
            if parent.poll() is None:
                os.killpg(parent.pid, signal.SIGKILL)


def test_a_parent_that_is_killed_leaves_no_child() -> None:
    """Children of `concurrent.futures` would wait for ever: each ends when nobody reads."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("no forked processes on this system")
    program = (
        "import os, time\n"
        "from seals.sysid.parallel import spread\n"
        "def work(_):\n"
        "    os.write(1, f'{os.getpid()} '.encode())\n"
        "    time.sleep(1.0)\n"
        "spread(work, range(100), 2)\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        told = b""
        while len(set(told.split())) < 2:
            told += os.read(parent.stdout.fileno(), 100)
        parent.kill()
        # the pipe ends once no child holds it
        end = time.monotonic() + 30.0
        while time.monotonic() < end and os.read(parent.stdout.fileno(), 100):
            pass
        assert time.monotonic() < end


@pytest.mark.parametrize("processes", [1, 2])
def test_a_job_beside_gives_its_result_or_its_error(processes: int) -> None:
    """A closure comes back with its value; what it raises is raised where it is asked for."""
    number = 21
    assert Beside(lambda: 2 * number, processes).result() == 42
    with pytest.raises(ZeroDivisionError):
        Beside(lambda: 1 // 0, processes).result()


def test_a_child_that_is_ended_is_no_result() -> None:
    """The system ends a child that takes too much memory: the parent does not wait for ever."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("no forked processes on this system")

    def die(_: int) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(RuntimeError, match="without its result"):
        spread(die, range(2), 2)
    with pytest.raises(RuntimeError, match="without its result"):
        Beside(lambda: die(0), 2).result()


def test_a_job_that_is_stopped_leaves_no_child() -> None:
    """Where nobody asks for its result, a long job ends at once."""
    job = Beside(lambda: time.sleep(60.0), 2)
    begin = time.monotonic()
    job.stop()
    assert time.monotonic() - begin < 30.0
    assert not multiprocessing.active_children()
