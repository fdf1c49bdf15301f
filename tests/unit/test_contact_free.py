"""Runs note when they touch something; a diagnosis uses the rest, or refuses in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import LogError
from seals.logs.log import Log
from seals.logs.native import read_native
from seals.sysid.data.contact import contact_free
from seals.sysid.data.join import join_logs

TIME = np.arange(0.0, 10.0, 0.1)


def _log(contacts: object, *, posed: bool = True, **more: object) -> Log:
    columns = {"t": TIME, **({"position_x": TIME} if posed else {})}
    return Log(name="hop", columns=columns, meta={"contacts": contacts, **more})


def test_stretches_without_contact_are_runs_of_their_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Between landings, what is too short to be of use goes."""
    free = contact_free(_log([[0.0, 1.25], [5.05, 6.0], [6.95, 7.15]]))
    assert [(round(r.time[0], 6), round(r.time[-1], 6)) for r in free.segments()] == [
        (1.3, 5.0),
        (7.2, 9.9),
    ]
    assert "contacts" not in free.meta
    assert "1.30 to 5.00 s, 7.20 to 9.90 s" in capsys.readouterr().err
    assert contact_free(free) is free


def test_without_a_measured_pose_the_stated_start_is_needed() -> None:
    """A later stretch begins in a state that nobody states."""
    free = contact_free(_log([[4.05, 5.0]], posed=False))
    assert (free.time[0], round(free.time[-1], 6)) == (0.0, 4.0)


def test_a_robot_that_stands_is_refused() -> None:
    """In two lines, with what to do."""
    with pytest.raises(LogError, match=r"never without contact.*longest 0\.8 s") as refusal:
        contact_free(_log([[0.0, 9.0]]))
    assert str(refusal.value).count("\n") == 1
    with pytest.raises(LogError, match="beginnings and ends"):
        contact_free(_log([1.0, 2.0]))


def test_logs_that_are_joined_are_cut_each_by_itself() -> None:
    """Contacts may differ between logs of one vehicle."""
    joined = join_logs([_log([[0.0, 5.0]]), _log([[7.0, 9.0]])])
    assert [part.rows for part in joined.segments()] == [49, 70]


def test_a_run_states_when_it_touched_the_ground(tmp_path: Path) -> None:
    """A ball dropped from 0.2 m over the ground: sqrt(2 h / g) of fall, then contact."""
    words = ["robot=ball", "environment.ground_level=0.0", "initial.position=[0,0,0.25]"]
    run = ["time.duration=0.5", f"hydra.run.dir={tmp_path / 'dropped'}"]
    assert main(["run", *words, *run]) == 0
    first = read_native(tmp_path / "dropped").meta["contacts"][0]
    assert first[0] == pytest.approx(np.sqrt(2.0 * 0.2 / 9.81), abs=0.02)
    assert main(["run", *words[:1], *run[:1], f"hydra.run.dir={tmp_path / 'falling'}"]) == 0
    assert "contacts" not in read_native(tmp_path / "falling").meta
