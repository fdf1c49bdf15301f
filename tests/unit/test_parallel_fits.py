"""Fits in forked processes: order, and signals that children must not inherit."""

from __future__ import annotations

import signal

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
