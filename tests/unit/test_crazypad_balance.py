"""Hover of a changed multirotor: commands by the effects' laws, and what tells them apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.healthy_flights import Balance, compared, healthy_of
from benchmarks.hover_balance import SIZES, Airframe, explanations
from seals.arrays import Floats
from seals.errors import LogError
from seals.plugins.readers.crazypad import ReaderCrazypad
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict

SQUARE = np.array([[1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])


def exact(healthy: Floats, thrusts: Floats) -> Floats:
    """A thrust law that holds: commands are thrusts."""
    return thrusts


FRAME = Airframe(
    position=0.0325 * SQUARE,
    direction=np.array([-1.0, 1.0, -1.0, 1.0]),
    torque=0.006,
    needed=exact,
)
HEALTHY = np.full(4, 9.0)


@pytest.mark.parametrize(
    ("name", "per_size"),
    [
        ("payload@3", 36.0 * np.array([-0.25, 0.25, 0.75, 0.25])),
        ("payload@3+4", 36.0 * np.array([0.0, 0.0, 0.5, 0.5])),
        ("centre_of_gravity@3", 36.0 * np.array([-0.5, 0.0, 0.5, 0.0])),
    ],
)
def test_a_load_changes_the_commands_as_statics_says(name: str, per_size: Floats) -> None:
    """No yaw from a load, no thrust from a shift; numbers by moments about the arms."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY)}
    assert known[name][: SIZES.size] == pytest.approx(SIZES[:, None] * per_size, abs=1e-9)


def test_a_weak_rotor_is_commanded_up_alone() -> None:
    """It needs 1 / (1 - loss) of its command; the others feel nothing."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY)}
    more = known["weak_rotor@2"]
    assert more[:, 1] == pytest.approx(9.0 * SIZES / (1.0 - SIZES))
    assert not more[:, [0, 2, 3]].any()


def flight(commands: Floats, noise: Floats, turn: Floats | float = 0.0) -> Balance:
    """A flight there and back."""
    legs = np.stack([commands - 0.5 * turn, commands + 0.5 * turn]) + noise
    return Balance(vehicle="a", legs=legs, travel=np.array([[1.0, 0.0], [-1.0, 0.0]]))


def test_flights_are_told_from_healthy_ones_by_their_scatter() -> None:
    """A loss far beyond it is named with its rotor, a smaller one is not, equal twins are a set."""
    rng = np.random.default_rng(5)
    some = [flight(HEALTHY, rng.normal(0.0, 0.1, (2, 4))) for _ in range(6)]
    healthy, policy = healthy_of(FRAME, some, "a"), DecisionPolicy()

    def answer(change: list[float], turn: Floats | float = 0.0) -> tuple[Verdict, tuple[str, ...]]:
        found = compared(FRAME, healthy, flight(HEALTHY + change, np.zeros(4), turn), policy)
        return found.verdict, found.names

    assert answer([0.0, 0.0, 0.1, 0.0]) == (Verdict.nothing_missing, ())
    verdict, names = answer([0.0, 0.0, 3.0, 0.0])
    assert verdict in (Verdict.named, Verdict.ambiguous)
    assert names[0] == "weak_rotor@3"
    verdict, names = answer([3.0, 3.0, 0.0, 0.0])
    assert verdict is Verdict.ambiguous
    assert {"weak_rotor@1+2", "payload@1+2"} <= set(names)
    with pytest.raises(ValueError, match="too few healthy flights"):
        healthy_of(FRAME, some, "b")


def test_a_table_of_another_kind_is_refused(tmp_path: Path) -> None:
    """The columns that are needed are named."""
    pd = pytest.importorskip("pandas")
    table = tmp_path / "flight.parquet"
    pd.DataFrame({"t_s": [0.0, 0.01], "command_1": [0.1, 0.2]}).to_parquet(table)
    with pytest.raises(LogError, match="command_2"):
        ReaderCrazypad().read(table)
    (tmp_path / "log00").write_bytes(b"\xbc\x01")
    with pytest.raises(LogError, match="offline form"):
        ReaderCrazypad().read(tmp_path / "log00")
