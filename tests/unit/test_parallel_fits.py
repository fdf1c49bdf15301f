"""Fits in forked processes: order, and signals that children must not inherit."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from seals.run.stopping import stoppable
from seals.sysid.parallel import spread


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
        "def late():\n"
        "    with contextlib.suppress(FileExistsError):\n"
        "        os.close(os.open(sys.argv[1], os.O_CREAT | os.O_EXCL))\n"
        "        time.sleep(2.0)\n"
        "    usual()\n"
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
