"""Work is shared among processes whatever it is made of."""

from __future__ import annotations

import os

import pytest

from seals.sysid.parallel import spread


@pytest.mark.parametrize("processes", [1, 2])
def test_closures_are_items_and_work_and_order_is_kept(processes: int) -> None:
    """Neither the function nor what it is applied to can be pickled."""
    items = [lambda k=k: k for k in range(5)]
    assert spread(lambda item: 10 * item(), items, processes) == [0, 10, 20, 30, 40]


def test_two_processes_are_children() -> None:
    """Two processes are not this one."""
    assert os.getpid() not in spread(lambda _: os.getpid(), [0, 1], 2)


def test_an_error_in_a_child_arrives() -> None:
    """What goes wrong in a child is raised here."""

    def fail(item: int) -> None:
        raise ValueError(str(item))

    with pytest.raises(ValueError, match=r"[01]"):
        spread(fail, [0, 1], 2)
