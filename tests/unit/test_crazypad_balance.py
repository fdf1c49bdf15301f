"""Hover of a changed multirotor: commands by the effects' laws, and what tells them apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.crazypad import answers, read, write
from benchmarks.healthy_flights import Balance, compared, comparison_of, healthy_of
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
    radius=0.0225,
    unit=1e-3,
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


def test_a_load_in_the_wake_of_a_rotor_is_pressed_down() -> None:
    """At most as water of its mass: 1 g is 1 cm^2 of the disc's 15.9, which the rotor makes up."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY)}
    beside, wholly = known["payload@3"].reshape(4, -1, SIZES.size, 4)[[0, -1], 0]
    one = int(np.argmin(np.abs(36.0 * SIZES - 1.0)))
    share = (36e-6 * SIZES[one]) ** (2.0 / 3.0) / (np.pi * 0.0225**2)
    assert share == pytest.approx(0.063, rel=0.05)
    assert wholly[one, 2] == pytest.approx((9.0 + beside[one, 2]) / (1.0 - share) - 9.0)
    assert wholly[:, [0, 1, 3]] == pytest.approx(beside[:, [0, 1, 3]])


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
    beside, policy = comparison_of(FRAME, healthy_of(FRAME, some, "a")), DecisionPolicy()

    def answer(change: list[float], turn: Floats | float = 0.0) -> tuple[Verdict, tuple[str, ...]]:
        found = compared(beside, flight(HEALTHY + change, np.zeros(4), turn), policy)
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


def test_further_healthy_flights_seldom_raise_an_alarm() -> None:
    """Few healthy flights tell the scatter badly; the share of alarms is kept all the same."""
    rng, policy, alarms = np.random.default_rng(8), DecisionPolicy(), 0
    for _ in range(5):
        some = [flight(HEALTHY, rng.normal(0.0, 0.3, (2, 4))) for _ in range(6)]
        beside = comparison_of(FRAME, healthy_of(FRAME, some, "a"))
        for _ in range(20):
            further = flight(HEALTHY, rng.normal(0.0, 0.3, (2, 4)))
            names = compared(beside, further, policy).names
            alarms += bool(set(names) - {"thrust_coefficient"})
    # 2.5 of 100 are allowed; flights beside the same healthy ones go together
    assert alarms <= 6


def test_a_table_without_labels_is_answered(tmp_path: Path) -> None:
    """Files and references are enough; a log that is no flight is bad data."""
    pd = pytest.importorskip("pandas")
    (tmp_path / "flights").mkdir()
    rng, time = np.random.default_rng(2), np.arange(0.0, 20.0, 0.05)
    aloft = (time % 10.0 > 1.0) & (time % 10.0 < 9.0)
    for name, more in (("a", 0.0), ("b", 0.0), ("c", 0.3), ("d", -1.0)):
        share = np.where(aloft, 0.62, 0.0)[:, None] + rng.normal(0.0, 0.05, (time.size, 4))
        share[:, 2] += np.where(aloft, more, 0.0)
        table = {"t_s": time, "x_m": np.abs(10.0 - time), "y_m": 0.0 * time, "z_m": 0.5 * aloft}
        table |= {f"command_{k}": share[:, k - 1] for k in (1, 2, 3, 4)}
        if name == "d":
            table["z_m"] = 0.0 * time
        pd.DataFrame(table).to_parquet(tmp_path / "flights" / f"{name}.parquet")
    (tmp_path / "flights.csv").write_text(
        "file,reference\n" + "".join(f"{name}.parquet,E\n" for name in "abcd")
    )
    flights = read(tmp_path)
    healthy = [one.balance for one in flights[:2] if one.balance is not None]
    found = answers(flights[2:], healthy)
    write(flights[2:], found, tmp_path / "out.csv")
    header, changed, bad = (tmp_path / "out.csv").read_text().splitlines()
    assert header == "file,verdict,explanations,loss_1,loss_2,loss_3,loss_4"
    assert "weak_rotor@3" in changed
    assert bad.startswith("d.parquet,bad_data,,")


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
