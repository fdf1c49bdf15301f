"""Real flights of changed quadrotors: ``python -m benchmarks.crazypad [FOLDER [BESIDE [OUT]]]``.

Every flight of FOLDER, which holds ``flights.csv`` and ``flights/``, is answered as by ``seals
diagnose log=FLIGHT healthy=[...] robot=crazyflie reader=crazypad``, with the healthy flights of its
vehicle in BESIDE, by default the same folder. A flight that is itself healthy is compared with
those of other sessions. OUT is a table of the answers.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.crazypad_lines import Row, false_alarms, lines_of
from benchmarks.real_data import BESIDE, table
from seals.errors import LogError, SealsError
from seals.logs.log import Log
from seals.plugins.readers.crazypad import ReaderCrazypad
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.decision.verdict import Verdict
from seals.sysid.healthy_flights.comparison import Changed
from seals.sysid.healthy_flights.diagnosis import HealthyFlights

_ONE_SESSION = 0.0167
"""Root mean square over the drives, as a share of their mean thrust, below which two flights are of
one session: 0.15 of 9 gram-force."""


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A row of ``flights.csv`` with its log."""

    row: Row
    log: Log


def read(folder: Path) -> list[Flight]:
    """Return the flights of a folder in the order of its table.

    Raises:
        LogError: the table is absent, or lacks a column.
    """
    place = folder / "flights.csv"
    if not place.is_file():
        raise LogError(f"there is no '{place}'.\nNeeded: flights.csv beside the folder flights.")
    with place.open(encoding="utf-8", newline="") as file:
        rows = [Row.of(raw, place) for raw in csv.DictReader(file)]
    logs = [ReaderCrazypad().read(folder / "flights" / row.file)[0] for row in rows]
    return [Flight(row=row, log=log) for row, log in zip(rows, logs, strict=True)]


class Answers:
    """Answers about flights, beside healthy ones."""

    def __init__(self, healthy: Sequence[Flight]) -> None:
        self._robot = describe_robot("crazyflie")
        self._healthy: dict[str, list[Flight]] = {}
        for flight in healthy:
            self._healthy.setdefault(flight.row.vehicle, []).append(flight)
        self._known: dict[tuple[str, ...], HealthyFlights] = {}

    def beside(self, flights: Sequence[Flight]) -> HealthyFlights:
        """Return healthy flights made ready."""
        key = tuple(flight.row.file for flight in flights)
        if key not in self._known:
            self._known[key] = HealthyFlights.of([f.log for f in flights], self._robot)
        return self._known[key]

    def about(self, flight: Flight, *, same_session: bool = False) -> Changed | None:
        """Return the answer about a flight, None for a log that is no flight.

        Args:
            flight: to answer about.
            same_session: whether a healthy flight is compared with those of its own session, too.
        """
        own = self._healthy[flight.row.vehicle]
        others = [f for f in own if f.row.file != flight.row.file]
        if len(others) < len(own) and not same_session:
            others = self._other_sessions(own, flight) or others
        try:
            return self.beside(others).diagnose(flight.log, self._robot).changed
        except LogError:
            return None

    def _other_sessions(self, own: Sequence[Flight], flight: Flight) -> list[Flight]:
        means = {
            f.row.file: b.mean for f, b in zip(own, self.beside(own).reference.flights, strict=True)
        }
        mean = means[flight.row.file]
        apart = {n: float(np.sqrt(np.mean((m - mean) ** 2))) for n, m in means.items()}
        return [f for f in own if apart[f.row.file] > _ONE_SESSION * float(np.mean(mean))]


def words(flight: Flight, answer: Changed | None) -> str:
    """Return one line about a flight."""
    name = f"{Path(flight.row.file).stem:40}"
    if answer is None:
        return f"{name}  {Verdict.bad_data.value}"
    lost_shares = " ".join(f"{100.0 * loss:5.1f}" for loss in answer.lost_shares)
    named = ", ".join(answer.names) or "-"
    return f"{name}  {answer.verdict.value:15}  {answer.evidence:5.1f}  {lost_shares}  {named}"


def write(flights: Sequence[Flight], found: Sequence[Changed | None], out: Path) -> None:
    """Write one row for each flight: verdict, explanations joined by ``|``, lost shares."""
    with out.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["file", "verdict", "explanations", *(f"loss_{k}" for k in (1, 2, 3, 4))])
        for flight, one in zip(flights, found, strict=True):
            if one is None:
                rows.writerow([flight.row.file, Verdict.bad_data.value, "", *[""] * 4])
                continue
            lost_shares = [f"{loss:.4f}" for loss in one.lost_shares]
            # a load in the middle has no name of its own there: thrust_coefficient stands for it
            names = [name for name in one.names if name != "payload"]
            rows.writerow([flight.row.file, one.verdict.value, "|".join(names), *lost_shares])


def main() -> int:
    """Print the answers, and the lines where labels are given."""
    places = [Path(word) for word in sys.argv[1:4]] or [BESIDE / "crazypad"]
    try:
        flights = read(places[0])
        known = flights if len(places) == 1 or places[0] == places[1] else read(places[1])
        answers = Answers([f for f in known if f.row.healthy])
        found = [answers.about(flight) for flight in flights]
        healthy = [f for f in flights if f.row.healthy]
        same = [answers.about(f, same_session=True) for f in healthy]
        if len(places) > 2:
            write(flights, found, places[2])
    except (SealsError, ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    print("flight, verdict, evidence, lost thrust by motor [%], explanations")
    for flight, answer in zip(flights, found, strict=True):
        print(words(flight, answer))
    lines = lines_of([f.row for f in flights], found)
    if lines and known is flights:
        lines.insert(1, false_alarms("of the same sessions", [f.row for f in healthy], same))
    print("\n" + table(lines))
    return sum(not line.reached for line in lines)


if __name__ == "__main__":
    sys.exit(main())
