"""Validation of the particle water: cases against theory and measurements, and their page."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from seals.errors import ConfigError, LogError, refuse_unlisted
from seals.experiments.command import CommandParser, checked_folder
from seals.experiments.water_validation import (
    archimedes,
    dam_breaks,
    entry,
    flume,
    heave,
    hydrostatics,
    slam,
    standing_wave,
    tow,
)
from seals.experiments.water_validation.case import Case, Grade, Outcome
from seals.experiments.water_validation.page import Result, write_page
from seals.plugins.fluids.coupling import Device, Method

CASES: tuple[Case, ...] = (
    hydrostatics.CASE,
    *archimedes.CASES,
    *dam_breaks.CASES,
    standing_wave.CASE,
    flume.CASE,
    heave.CASE,
    entry.CASE,
    slam.CASE,
    tow.CASE,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases and write the page.

    Returns:
        0 when every figure with a bar is within it, 1 otherwise.
    """
    parser = CommandParser(prog="seals validate water")
    parser.add_argument("cases", nargs="*", help="names; all of the mode when left out")
    parser.add_argument("--full", action="store_true", help="finer, and the slow cases too")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the page")
    parser.add_argument("--device", choices=[d.value for d in Device], default="cpu")
    parser.add_argument("--threads", type=int, default=0, help="on the cpu; 0 for all")
    parser.add_argument("--solver", choices=[m.value for m in Method], default="pbf")
    parser.add_argument("--across", type=float, default=0.0, help="spacings across, of entry")
    given = parser.parse_args(arguments)
    if given.across and not 3.0 <= given.across <= 100.0:
        raise ConfigError(f"--across {given.across:g} is not allowed.\nAllowed: 3 to 100.")
    device, method = Device(given.device), Method(given.solver)
    grade = Grade(not given.full, device, given.threads, method, given.across)
    checked_folder(given.out)
    results = []
    names = given.cases
    full = given.full
    known = {case.name: case for case in CASES}
    for name in names:
        refuse_unlisted(name, known, f"there is no case '{name}'", label="Cases")
    for case in (
        [known[name] for name in names] if names else [case for case in CASES if full or case.quick]
    ):
        print(f"{case.title} ...", flush=True)
        begun = time.perf_counter()
        try:
            outcome: Outcome | None = case.run(grade)
            missing = ""
        except LogError as absent:
            outcome, missing = None, str(absent).splitlines()[0]
        result = Result(case, outcome, time.perf_counter() - begun, missing)
        results.append(result)
        for line in result.words():
            print(f"  {line}", flush=True)
    path = write_page(given.out, results, grade=grade, cases=CASES)
    print(f"page: {path}")
    return 0 if all(result.passed for result in results) else 1
