"""How far long work is, where no terminal shows a bar."""

from __future__ import annotations

import pytest

from seals.run import progress as module
from seals.run.progress import progress


class Clock:
    """A clock that is put forward by hand."""

    now = 0.0

    def perf_counter(self) -> float:
        """The time [s]."""
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The clock that progress looks at."""
    found = Clock()
    monkeypatch.setattr(module, "time", found)
    return found


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What was said since the last look."""
    out, err = capsys.readouterr()
    assert not out
    return err.splitlines()


def test_a_line_a_minute_with_the_time_left(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing in the first minute; then the share done and what the pace so far promises."""
    with progress("flying", 1000, lambda: "3 of 4 good") as tell:
        for done in range(0, 60):
            clock.now = float(done)
            tell(done)
        assert lines(capsys) == []
        clock.now = 100.0
        tell(100)
        assert lines(capsys) == ["flying: 10%, 15.0 min left  3 of 4 good"]
        clock.now = 159.0
        tell(159)
        assert lines(capsys) == []
        clock.now = 160.0
        tell(160)
        assert lines(capsys) == ["flying: 16%, 14.0 min left  3 of 4 good"]
        clock.now = 300.0
        tell(1000)
        # the result itself says that it is done
        assert lines(capsys) == []


def test_what_was_done_before_does_not_count_for_the_pace(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run taken up at nine tenths is no faster for that."""
    with progress("training", 1000) as tell:
        tell(900)
        clock.now = 100.0
        tell(950)
        assert lines(capsys) == ["training: 95%, 100 s left"]


def test_first_steps_that_compile_do_not_count_for_the_pace(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    """A start and a second step of a minute each are not taken for the pace of the rest."""
    with progress("flying", 10_000) as tell:
        for done, now in ((1, 60.0), (2, 120.0), (32, 121.0), (64, 122.0)):
            clock.now = now
            tell(done)
        (line,) = lines(capsys)
        assert line == "flying: 0%, 5.5 min left"
