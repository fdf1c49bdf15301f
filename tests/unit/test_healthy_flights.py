"""Flights beside healthy ones: thrusts by the effects' laws, and what tells them apart."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.crazypad import Answers, read, write
from seals.arrays import Floats
from seals.cli.main import main
from seals.errors import LogError
from seals.logs.log import Log
from seals.logs.native import write_native
from seals.plugins.readers.crazypad import ReaderCrazypad
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.healthy_flights.balance import Balance, DriveLayout
from seals.sysid.healthy_flights.comparison import COMMON, UNEXPLAINED, Reference
from seals.sysid.healthy_flights.explanations import (
    LARGEST,
    SMALLEST,
    explanations,
    neighbours,
)
from seals.sysid.healthy_flights.scatter import Known, Modes, scatter_of

SQUARE = np.array([[1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
ARM = 0.0325
REACTION = 0.006 * np.array([-1.0, 1.0, -1.0, 1.0])
HEALTHY = np.full(4, 0.09)
SIZES = np.geomspace(SMALLEST, LARGEST, 90)
WEIGHT = 0.36


def layout(position: Floats, reaction: Floats, *, signals: bool = False) -> DriveLayout:
    """Rotors that push along z."""
    x, y = position[:, 0], position[:, 1]
    none = 0.0 * x
    return DriveLayout(
        position=position,
        radius=np.full(len(position), 0.0225),
        wrench=np.stack([none, none, none + 1.0, y, -x, reaction]),
        limit=np.full(len(position), 0.15),
        mass=WEIGHT / 9.81,
        gravity=9.81,
        signals=signals,
    )


FRAME = layout(ARM * SQUARE, REACTION)


@pytest.mark.parametrize(
    ("name", "per_size"),
    [
        ("payload@3", WEIGHT * np.array([-0.25, 0.25, 0.75, 0.25])),
        ("payload@3+4", WEIGHT * np.array([0.0, 0.0, 0.5, 0.5])),
        ("payload", WEIGHT * np.array([0.25, 0.25, 0.25, 0.25])),
        ("centre_of_gravity@3", WEIGHT * np.array([-0.5, 0.0, 0.5, 0.0])),
    ],
)
def test_a_load_changes_the_thrusts_as_statics_says(name: str, per_size: Floats) -> None:
    """No yaw from a load, no thrust from a shift; numbers by moments about the arms."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY, SIZES.size)}
    assert known[name][: SIZES.size] == pytest.approx(SIZES[:, None] * per_size, abs=1e-9)


def test_a_load_in_the_wake_of_a_rotor_is_pressed_down() -> None:
    """At most as water of its mass: 1 g is 1 cm^2 of the disc's 15.9, which the rotor makes up."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY, SIZES.size)}
    beside, wholly = known["payload@3"].reshape(4, SIZES.size, 4)[[0, -1]]
    one = int(np.argmin(np.abs(1e3 * FRAME.mass * SIZES - 1.0)))
    share = (FRAME.mass * SIZES[one] / 1000.0) ** (2.0 / 3.0) / (np.pi * 0.0225**2)
    assert share == pytest.approx(0.063, rel=0.08)
    assert wholly[one, 2] == pytest.approx((0.09 + beside[one, 2]) / (1.0 - share) - 0.09)
    assert wholly[:, [0, 1, 3]] == pytest.approx(beside[:, [0, 1, 3]])


def test_a_weak_rotor_is_commanded_up_alone() -> None:
    """It needs 1 / (1 - loss) of its command; the others of four rotors feel nothing."""
    known = {one.name: one.changes for one in explanations(FRAME, HEALTHY, SIZES.size)}
    more = known["weak_rotor@2"]
    assert more[:, 1] == pytest.approx(0.09 * SIZES / (1.0 - SIZES))
    assert more[:, [0, 2, 3]] == pytest.approx(0.0, abs=1e-9)


def test_six_rotors_share_what_one_of_them_loses() -> None:
    """The wrench of the weakened hexacopter is the healthy one; all six commands change."""
    turn = np.arange(6) * np.pi / 3.0
    place = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    frame = layout(0.3 * place, 0.02 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]))
    healthy = np.full(6, 0.06)
    known = {one.name: one.changes for one in explanations(frame, healthy, SIZES.size)}
    k = int(np.argmin(np.abs(SIZES - 0.3)))
    true = healthy + known["weak_rotor@1"][k]
    assert (np.abs(true - healthy) > 1e-4).all()
    true[0] *= 1.0 - SIZES[k]
    assert frame.wrench @ true == pytest.approx(frame.wrench @ healthy, abs=1e-9)


@pytest.mark.parametrize("radius", [0.02, 0.0])
def test_drives_above_each_other_are_no_neighbours(radius: float) -> None:
    """Of an X8, four arms with two rotors each, the neighbours are the adjacent arms'."""
    above = ARM * np.concatenate([SQUARE, SQUARE + np.array([0.0, 0.0, 0.5])])
    frame = layout(above, np.concatenate([REACTION, -REACTION]))
    found = neighbours(replace(frame, radius=np.full(8, radius)))
    arms = {frozenset((i % 4, j % 4)) for i, j in found}
    assert arms == {frozenset(p) for p in ((0, 1), (1, 2), (2, 3), (3, 0))}
    assert len(found) == 4


def test_signals_leave_the_thrust_law_open_between_two_bounds() -> None:
    """Thrust by the square of the voltage, or in proportion to it: h (T / h)^2, at most full."""
    open_law = layout(ARM * SQUARE, REACTION, signals=True)
    known = {one.name: one.changes for one in explanations(open_law, HEALTHY, SIZES.size)}
    nominal, flat = known["payload"].reshape(-1, SIZES.size, 4)[[0, -1], :, 0]
    assert nominal == pytest.approx(0.09 * SIZES)
    assert flat == pytest.approx(np.minimum(0.09 * (1.0 + SIZES) ** 2, 0.15) - 0.09)


def flight(
    commands: Floats, noise: Floats, turn: Floats | float = 0.0, session: int = 0
) -> Balance:
    """A flight there and back."""
    legs = np.stack([commands - 0.5 * turn, commands + 0.5 * turn]) + noise
    return Balance(
        name=f"flight_{session}", session=session, legs=legs,
        travel=np.array([[1.0, 0.0], [-1.0, 0.0]]),
    )  # fmt: skip


def reference(rng: np.random.Generator, sigma: float, count: int = 6) -> Reference:
    """Healthy flights, each of a session of its own."""
    return Reference(
        FRAME,
        tuple(flight(HEALTHY, rng.normal(0.0, sigma, (1, 4)), session=k) for k in range(count)),
    )


def test_flights_are_told_from_healthy_ones_by_their_scatter() -> None:
    """A loss far beyond it is named with its rotor, a smaller one is not, equal twins are a set."""
    beside, policy = reference(np.random.default_rng(5), 1e-3), DecisionPolicy()

    def answer(change: Sequence[float]) -> tuple[Verdict, tuple[str, ...]]:
        found = beside.compared(flight(HEALTHY + 1e-2 * np.array(change), np.zeros(4)), policy)
        return found.verdict, found.names

    assert answer([0.0, 0.0, 0.1, 0.0]) == (Verdict.nothing_missing, ())
    assert answer([0.0, 0.0, 3.0, 0.0]) == (Verdict.named, ("weak_rotor@3",))
    verdict, names = answer([3.0, 3.0, 0.0, 0.0])
    assert verdict is Verdict.ambiguous
    assert {"weak_rotor@1+2", "payload@1+2"} <= set(names)
    # more thrust of every other drive is a turn that nothing of the library makes
    assert answer([4.0, -4.0, 4.0, -4.0])[0] is Verdict.none_of_these


@pytest.mark.parametrize("losses", [(0.0, 0.5934), (0.21, 0.5934)])
def test_a_loss_between_the_sizes_tried_is_explained(losses: tuple[float, float]) -> None:
    """Two hundred sessions know the scatter to a tenth of what lies between two sizes."""
    beside = reference(np.random.default_rng(5), 1e-5, count=200)
    share = np.array([losses[0], 0.0, losses[1], 0.0])
    found = beside.compared(flight(HEALTHY / (1.0 - share), np.zeros(4)), DecisionPolicy())
    assert found.unexplained > UNEXPLAINED
    assert found.verdict in (Verdict.named, Verdict.ambiguous)
    assert found.names[0] == ("weak_rotor@1+3" if losses[0] else "weak_rotor@3")


def test_a_load_that_trails_on_the_floor_turns_with_the_travel() -> None:
    """Its drag pulls at the arm: a yaw of the sign of the rotor's side, the other way back."""
    beside, policy = reference(np.random.default_rng(5), 1e-3), DecisionPolicy()
    drag = 0.02
    torque = ARM * drag  # at rotor 3, left of the way: +y times a pull along -x
    turn = -2.0 * np.linalg.pinv(FRAME.wrench)[:, 5] * torque
    found = beside.compared(flight(HEALTHY, np.zeros(4), -turn), policy)
    other = beside.compared(flight(HEALTHY, np.zeros(4), turn), policy)
    slung = [{n for n in one.scores if "slung" in n} for one in (found, other)]
    assert {frozenset(s) for s in slung} == {
        frozenset({"slung_load@1", "slung_load@2"}),
        frozenset({"slung_load@3", "slung_load@4"}),
    }


def test_further_healthy_flights_seldom_raise_an_alarm() -> None:
    """Few healthy flights tell the scatter badly; the share of alarms is kept all the same."""
    rng, policy, alarms = np.random.default_rng(8), DecisionPolicy(), 0
    for _ in range(5):
        beside = reference(rng, 2.7e-3)
        for _ in range(20):
            further = flight(HEALTHY, rng.normal(0.0, 2.7e-3, (1, 4)))
            alarms += bool(set(beside.compared(further, policy).names) - set(COMMON))
    # 2.5 of 100 are allowed; flights beside the same healthy ones go together
    assert alarms <= 6


def test_flights_of_one_session_are_no_proofs_of_their_own() -> None:
    """Nine flights of three sessions know the scatter between sessions by two degrees of freedom.

    Between sessions s = 2, within w = 1 of a unit: a further flight has s^2 (1 + 1/3) + w^2
    (1 - 1/3) with s^2 the variance of the means.
    """
    modes, unit = Modes.of(FRAME), 1e-3
    up = modes.vectors[0]
    flights, values = [], []
    for session, shift in enumerate((-2.0, 0.0, 2.0)):
        for inside in (-1.0, 0.0, 1.0):
            values.append(HEALTHY + unit * (shift + inside) * up)
            flights.append(flight(values[-1], np.zeros(4), session=session))
    nothing = Known(share=0.0, flights=0.0)
    found = scatter_of(modes, flights, values, nothing)
    assert found.sessions == 3
    assert found.degrees[0] == pytest.approx(2.0)
    assert found.variance[0] == pytest.approx(unit**2 * (4.0 * 4.0 / 3.0 + 2.0 / 3.0))
    alone = scatter_of(
        modes, [replace(f, session=k) for k, f in enumerate(flights)], values, nothing
    )
    assert alone.degrees[0] == pytest.approx(8.0)


META = {
    "vehicle": {
        "name": "quad", "mass": WEIGHT / 9.81, "centre_of_gravity": [0.0, 0.0, 0.0],
        "inertia": (1e-5 * np.eye(3)).tolist(),
        "rotors": [
            {
                "position": (ARM * p).tolist(), "axis": [0.0, 0.0, 1.0], "direction": d,
                "thrust_coefficient": 1e-8, "torque_coefficient": 6e-11, "time_constant": 0.02,
                "radius": 0.0225, "max_speed": 4000.0,
            }
            for p, d in zip(SQUARE, (1.0, -1.0, 1.0, -1.0), strict=True)
        ],
    },
    "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None, "air_density": 1.2},
    "baseline": [{"name": "rotor_thrust"}], "sensors": {"channels": {}},
}  # fmt: skip


def saved(folder: Path, name: str, thrusts: Sequence[float], **meta: object) -> str:
    """Write a flight of 8 s by its commands; return its path."""
    rng = np.random.default_rng(len(name) + int(1e4 * sum(thrusts)))
    time = np.arange(0.0, 8.0, 0.02)
    speed = np.sqrt(np.array(thrusts) / 1e-8) * rng.normal(1.0, 0.02, (time.size, 4))
    log = Log(
        name=name,
        columns={"t": time, **{f"rotor_speed_cmd_{k + 1}": speed[:, k] for k in range(4)}},
        meta={k: v for k, v in {**META, **meta}.items() if v is not None},
    )
    write_native(log, folder / name)
    return str(folder / name)


def test_the_command_names_what_changed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Verdict, exit code, files; the number is within its interval; another session is told."""
    healthy = [saved(tmp_path, n, [0.09] * 4) for n in ("a", "bb", "ccc")]
    sick = saved(tmp_path, "sick", [0.09, 0.09, 0.09 / 0.75, 0.09])
    out = tmp_path / "out"
    words = [f"log={sick}", f"healthy=[{','.join(healthy)}]", f"out={out}"]
    assert main(["diagnose", *words]) == 10
    answer = json.loads((out / "diagnosis.json").read_text())
    assert (out / "report.html").is_file()
    (effect,) = answer["effects"]
    assert (answer["verdict"], effect["name"], effect["drives"]) == ("named", "weak_rotor", [3])
    loss = effect["parameters"]["relative_loss"]
    assert loss["low90"] < 0.25 < loss["high90"]
    assert set(answer["healthy"]["left_out"]) == {"a", "bb", "ccc"}
    said = capsys.readouterr().out
    assert "weak_rotor at drive 3" in said
    again = saved(tmp_path, "again", [0.0902] * 4)
    assert main(["diagnose", f"log={again}", *words[1:], "report=false"]) == 0
    one = [f"log={sick}", f"healthy={healthy[0]}", f"out={out}"]
    assert main(["diagnose", *one]) in (10, 11)
    assert "one healthy session" in capsys.readouterr().out


def test_a_healthy_flight_that_is_itself_sick_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is named among the reasons: the others would call it changed."""
    healthy = [saved(tmp_path, n, [0.09] * 4) for n in ("a", "bb", "ccc", "dddd")]
    healthy.append(saved(tmp_path, "broken", [0.09, 0.09, 0.09 / 0.75, 0.09]))
    further = saved(tmp_path, "further", [0.09] * 4)
    words = [f"log={further}", f"healthy=[{','.join(healthy)}]", f"out={tmp_path / 'out'}"]
    assert main(["diagnose", *words]) == 0
    assert "the healthy flight broken differs" in capsys.readouterr().out


def test_what_cannot_be_compared_is_refused_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another vehicle, no commands, other units, the log itself, empty and unknown lists."""
    healthy = [saved(tmp_path, n, [0.09] * 4) for n in ("a", "bb")]
    given = [f"healthy=[{','.join(healthy)}]", f"out={tmp_path / 'out'}"]
    heavy = {**META["vehicle"], "mass": 1.0}  # type: ignore[dict-item]
    other = saved(tmp_path, "other", [0.09] * 4, vehicle=heavy)
    assert main(["diagnose", f"log={other}", *given]) == 20
    assert "another vehicle (mass 1.0)" in capsys.readouterr().out
    assert main(["diagnose", f"log={saved(tmp_path, 'units', [0.3] * 4)}", *given]) == 20
    assert "times the thrust" in capsys.readouterr().out
    silent = Log(
        name="silent", meta=META,
        columns={"t": np.arange(100) * 0.02, "specific_force_z": np.full(100, 9.81)},
    )  # fmt: skip
    write_native(silent, tmp_path / "silent")
    assert main(["diagnose", f"log={tmp_path / 'silent'}", *given]) == 20
    assert "rotor_speed_cmd" in capsys.readouterr().out
    for bad in (f"[{healthy[0]}]", "[]", "[[]]", "[nowhere]", f"[{healthy[1]},{healthy[1]}]"):
        assert main(["diagnose", f"log={healthy[0]}", f"healthy={bad}", given[1]]) == 2
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "words"),
    [({"name": "octo"}, "name octo"), ({"mass": 1.0}, "mass 1.0"), ({"rotors": []}, "")],
)
def test_another_vehicle_is_noticed_where_the_robot_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: dict[str, object], words: str
) -> None:
    """What the logs themselves say is compared; what they do not say is not."""
    healthy = [saved(tmp_path, n, [0.09] * 4) for n in ("a", "bb")]
    other = {**META["vehicle"], **change}  # type: ignore[dict-item]
    sick = saved(tmp_path, "sick", [0.09] * 4, vehicle=other)
    given = [f"healthy=[{','.join(healthy)}]", f"out={tmp_path / 'out'}", "robot=crazyflie"]
    assert main(["diagnose", f"log={sick}", *given]) == (20 if words else 0)
    assert words in capsys.readouterr().out


def test_a_log_that_names_no_vehicle_flew_the_healthy_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where no log names one, robot= is asked for; logs of one name are told by their folders."""
    (tmp_path / "day1").mkdir()
    (tmp_path / "day2").mkdir()
    healthy = [saved(tmp_path / day, "flight", [0.09] * 4) for day in ("day1", "day2")]
    healthy.append(saved(tmp_path, "other", [0.09] * 4))
    sick = saved(tmp_path, "sick", [0.09, 0.09, 0.09 / 0.75, 0.09], vehicle=None)
    out = tmp_path / "out"
    assert main(["diagnose", f"log={sick}", f"healthy=[{','.join(healthy)}]", f"out={out}"]) == 10
    left = json.loads((out / "diagnosis.json").read_text())["healthy"]["left_out"]
    assert sorted(name[-11:] for name in left) == ["day1/flight", "day2/flight", "other"]
    capsys.readouterr()
    unknown = saved(tmp_path, "unknown", [0.09] * 4, vehicle=None)
    assert main(["diagnose", f"log={sick}", f"healthy={unknown}", f"out={out}"]) == 2
    assert "robot=NAME" in capsys.readouterr().err


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
    answers = Answers(flights[:2])
    found = [answers.about(one) for one in flights[2:]]
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
