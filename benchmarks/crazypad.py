"""Real flights of changed quadrotors: ``python -m benchmarks.crazypad [FOLDER [BESIDE [OUT]]]``.

A folder holds ``flights.csv`` and ``flights/``; references are the healthy flights of BESIDE, such
a folder, too, by default the same one. A flight that is itself a reference is compared with the
healthy flights of other sessions. OUT is a table of the answers.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.crazypad_lines import Row, false_alarms, lines_of
from benchmarks.healthy_flights import (
    Balance,
    Changed,
    Comparison,
    compared,
    comparison_of,
    healthy_of,
)
from benchmarks.hover_balance import Airframe
from benchmarks.real_data import BESIDE, table
from seals.arrays import Floats
from seals.errors import LogError, SealsError
from seals.logs.log import Log
from seals.plugins.readers.crazypad import ReaderCrazypad
from seals.robot.robot_file import read_robot
from seals.robots import crazyflie
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict

FULL = 15.0
"""Nominal thrust of a motor at full command [gram-force]: 0.1471 N."""
_PULSE = (0.088, 0.000624)
"""Volts = a F - b F^2 of the firmware's compensation, F [gram-force] of four motors."""
_AIRBORNE = 0.3
"""Height [m] from which a flight of 0.5 m counts as flown, over what the estimate drifts."""
_SHORTEST = 2.0
"""Seconds that a leg must last, for hover to outweigh take-off and landing."""
_LEAST = 27.0
"""Bare weight [gram-force], which the commands must carry at least."""
_ONE_SESSION = 0.15
"""Root mean square over the motors [gram-force] below which two flights are of one session."""


def airframe() -> Airframe:
    """Return the rotors of the shipped Crazyflie, with the firmware's thrust law."""
    robot = read_robot(Path(crazyflie.__path__[0]))
    rotors = robot.parts["actuators"]["rotors"][1]
    return Airframe(
        position=np.asarray(rotors["position"], dtype=np.float64),
        direction=np.asarray(rotors["direction"], dtype=np.float64),
        torque=rotors["torque_coefficient"][0] / rotors["thrust_coefficient"][0],
        needed=flattest,
        radius=rotors["radius"][0],
        unit=1e-3,
    )


def flattest(healthy: Floats, thrusts: Floats) -> Floats:
    """Return the commands for given thrusts where thrust depends on the motor voltage only.

    The firmware takes thrust to grow steeply near full. A motor that is all resistance,
    V = R I with the torque and so the thrust in proportion to I, gives the least; both laws agree
    at the healthy commands. Commands end at full.
    """
    a, b = _PULSE
    volts = (a * 4.0 * healthy - b * (4.0 * healthy) ** 2) * thrusts / healthy
    force = (a - np.sqrt(np.maximum(a**2 - 4.0 * b * volts, 0.0))) / (2.0 * b)
    return np.where(thrusts > healthy, np.minimum(0.25 * force, FULL), thrusts)


def balance_of(log: Log, vehicle: str) -> Balance:
    """Return the mean commands of the two legs of a flight.

    Raises:
        LogError: the log shows no such flight.
    """
    height, time = log.channel("estimated_position")[:, 2], log.time
    commands = FULL * log.channel("motor_pwm")
    flown = np.flatnonzero((height >= _AIRBORNE) & np.isfinite(commands).all(axis=1))
    if flown.size < 2:
        raise LogError(f"log '{log.name}' never flies at {_AIRBORNE} m.")
    ground = int(np.argmax(np.diff(time[flown])))
    legs = [flown[: ground + 1], flown[ground + 1 :]]
    if any(float(np.ptp(time[leg])) < _SHORTEST for leg in legs):
        raise LogError(f"log '{log.name}' does not fly there and back for {_SHORTEST} s each.")
    means = np.stack([commands[leg].mean(axis=0) for leg in legs])
    if not (means.sum(axis=1) >= _LEAST).all():
        raise LogError(f"log '{log.name}' flies on less than the bare weight.")
    place = log.channel("estimated_position")[:, :2]
    ways = np.stack([place[leg[-1]] - place[leg[0]] for leg in legs])
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    return Balance(vehicle=vehicle, legs=means, travel=ways / np.maximum(lengths, 1e-9))


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A row of ``flights.csv`` with its balance; None where the log shows no flight."""

    row: Row
    balance: Balance | None


def read(folder: Path) -> list[Flight]:
    """Return the flights of a folder in the order of its table.

    Raises:
        LogError: the table is absent or lacks a column.
    """
    place = folder / "flights.csv"
    if not place.is_file():
        raise LogError(f"there is no '{place}'.\nNeeded: flights.csv beside the folder flights.")
    with place.open(encoding="utf-8", newline="") as file:
        rows = [Row.of(raw, place) for raw in csv.DictReader(file)]
    return [_flight(folder, row) for row in rows]


def _flight(folder: Path, row: Row) -> Flight:
    try:
        (log,) = ReaderCrazypad().read(folder / "flights" / row.file)
        return Flight(row=row, balance=balance_of(log, row.vehicle))
    except LogError:
        return Flight(row=row, balance=None)


def other_sessions(references: Sequence[Balance], flight: Balance) -> list[Balance]:
    """Return the references without the sessions of a flight that is one of them.

    Where nothing else of the vehicle is left, the flight alone is taken out.
    """
    if not any(one is flight for one in references):
        return list(references)

    def near(one: Balance) -> bool:
        apart = float(np.sqrt(np.mean((one.mean - flight.mean) ** 2)))
        return one.vehicle == flight.vehicle and apart < _ONE_SESSION

    left = [one for one in references if not near(one)]
    if any(one.vehicle == flight.vehicle for one in left):
        return left
    return other_flights(references, flight)


def other_flights(references: Sequence[Balance], flight: Balance) -> list[Balance]:
    """Return the references without a flight that is one of them."""
    return [one for one in references if one is not flight]


def answers(
    flights: Iterable[Flight],
    references: Sequence[Balance],
    others: Callable[[Sequence[Balance], Balance], list[Balance]] = other_sessions,
) -> list[Changed | None]:
    """Return the answer about each flight; None for a log that is no flight.

    Args:
        flights: to answer about.
        references: healthy flights.
        others: the references that a flight is compared with.
    """
    frame, policy = airframe(), DecisionPolicy()
    out: list[Changed | None] = []
    known: dict[tuple[int, ...], Comparison] = {}
    for flight in flights:
        if flight.balance is None:
            out.append(None)
            continue
        beside = others(references, flight.balance)
        key = (hash(flight.balance.vehicle), *map(id, beside))
        if key not in known:
            known[key] = comparison_of(frame, healthy_of(frame, beside, flight.balance.vehicle))
        out.append(compared(known[key], flight.balance, policy))
    return out


def grouped(flights: Sequence[Flight]) -> list[Flight]:
    """Return one flight for each group, of the mean balance; references stay out."""
    found: dict[str, list[Flight]] = {}
    for flight in flights:
        if flight.balance is not None and not flight.row.healthy:
            found.setdefault(flight.row.group, []).append(flight)
    return [Flight(row=some[0].row, balance=_mean(some)) for some in found.values()]


def _mean(flights: Sequence[Flight]) -> Balance:
    balances = [flight.balance for flight in flights if flight.balance is not None]
    return Balance(
        vehicle=balances[0].vehicle,
        legs=np.mean([one.legs for one in balances], axis=0),
        travel=balances[0].travel,
    )


def words(name: str, answer: Changed | None) -> str:
    """Return one line about a flight or a group."""
    if answer is None:
        return f"{name:40}  {Verdict.bad_data.value}"
    losses = " ".join(f"{100.0 * loss:5.1f}" for loss in answer.losses)
    named = ", ".join(answer.names) or "-"
    return f"{name:40}  {answer.verdict.value:15}  {answer.evidence:5.1f}  {losses}  {named}"


def write(flights: Sequence[Flight], found: Sequence[Changed | None], out: Path) -> None:
    """Write one row for each flight: verdict, explanations joined by ``|``, lost shares."""
    with out.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["file", "verdict", "explanations", *(f"loss_{k}" for k in (1, 2, 3, 4))])
        for flight, one in zip(flights, found, strict=True):
            if one is None:
                table.writerow([flight.row.file, Verdict.bad_data.value, "", *[""] * 4])
                continue
            losses = [f"{loss:.4f}" for loss in one.losses]
            table.writerow([flight.row.file, one.verdict.value, "|".join(one.names), *losses])


def main() -> int:
    """Print the answers by flight and by group, and the lines where labels are given."""
    places = [Path(word) for word in sys.argv[1:4]] or [BESIDE / "crazypad"]
    try:
        flights = read(places[0])
        known = flights if len(places) == 1 else read(places[1])
        references = [f.balance for f in known if f.row.healthy and f.balance is not None]
        found = answers(flights, references)
        groups = grouped(flights)
        of_groups = answers(groups, references)
        healthy = [f for f in flights if f.row.healthy]
        beside = answers(healthy, references, other_flights)
        if len(places) > 2:
            write(flights, found, places[2])
    except (SealsError, ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    print("flight, verdict, evidence, lost thrust by motor [%], explanations")
    for flight, answer in zip(flights, found, strict=True):
        print(words(Path(flight.row.file).stem, answer))
    print("\ngroup")
    for flight, answer in zip(groups, of_groups, strict=True):
        print(words(flight.row.group, answer))
    lines = lines_of([f.row for f in flights], found)
    if lines and places[0] == places[-1]:
        lines.insert(1, false_alarms("of the same sessions", [f.row for f in healthy], beside))
    print("\n" + table(lines))
    return sum(not line.reached for line in lines)


if __name__ == "__main__":
    sys.exit(main())
