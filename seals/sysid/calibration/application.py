"""``seals calibrate``: estimates parameters from logs, writes result, diff and report."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, printable
from seals.logs.atomic import finite, write_json, write_text
from seals.logs.shipped import find_log
from seals.report import Chart, Choice, write_picture
from seals.schema import check_value, parameters_of
from seals.sysid.calibration.applying import DIFF, Edited, edited, write_robot
from seals.sysid.calibration.calibration import STAGES, Calibration, calibrated
from seals.sysid.calibration.next_flight import NextFlight, next_flight
from seals.sysid.calibration.report import overlays
from seals.sysid.calibration.settings import CalibrateSettings
from seals.sysid.calibration.words import HEAD, error_sentence, remarks, row
from seals.sysid.report.given_logs import GivenLogs, given_logs, make_folder, sources
from seals.terminal import drawing

ANSWER, ROBOT = "calibration.json", "robot"
_WIDTH = 160
"""Columns of the printed table, so that no name is cut."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of ``seals calibrate``: the calibration and what is derived from it.

    Args:
        found: the calibration.
        edit: of the robot's folder; None without one.
        flight: that would show what the logs do not; None where they show all.
    """

    found: Calibration
    edit: Edited | None
    flight: NextFlight | None


def execute(config: Any) -> int:
    """Run one composed calibration and return its exit code.

    Raises:
        ConfigError: no log is given, a name means no number, or a folder cannot be used.
        LogError: a log cannot be used.
    """
    from hydra.core.hydra_config import HydraConfig

    from seals.run.progress import progress

    if config.log is None:
        raise ConfigError(
            "log is not given.\nSay which: seals calibrate log=FOLDER parameters=[mass] out=FOLDER"
        )
    given = given_logs(config)
    check_value("prior", config.prior, parameters_of(CalibrateSettings)["prior"])
    if config.apply and not config.robot.folder:
        raise ConfigError(
            "apply=true needs the robot's folder.\nGive it: robot=FOLDER, or leave apply out."
        )
    out = Path(config.out or HydraConfig.get().runtime.output_dir)
    if config.apply and (out / ROBOT).exists():
        raise ConfigError(f"{out / ROBOT} is there already.\nGive another folder: out=FOLDER")
    make_folder(out)
    with progress("calibrating", STAGES + 2) as tell:
        outcome = _outcome(given, tell)
        tell(STAGES + 1)
        pages = _write(config, outcome, out)
    _print(outcome)
    for page in pages:
        print(f"{page}")
    return 0


def _outcome(given: GivenLogs, tell: Any) -> Outcome:
    """Calibrate, derive the edited robot files, and propose the next flight."""
    config = given.config
    held = config.held_out
    unseen = None if held is None else find_log(str(held), key="held_out")
    log, robot = given.read()
    found = calibrated(
        log,
        [str(name) for name in config.parameters],
        robot=robot,
        held_out=None if unseen is None else replace(given, places=(unseen,)).read()[0],
        prior=float(config.prior),
        tell=tell,
    )
    words = f"{given.log_words}{given.robot_words}"
    found = replace(found, source=sources(given.places), given=words)
    folder = Path(config.robot.folder) if config.robot.folder else None
    edit = None if folder is None or robot is None else edited(found, folder, robot.robot)
    return Outcome(found=found, edit=edit, flight=next_flight(found) if config.plan else None)


def _write(config: Any, outcome: Outcome, out: Path) -> list[Path]:
    """Write all files of a calibration; return their paths."""
    found, edit, flight = outcome.found, outcome.edit, outcome.flight
    answer = {**found.to_dict(), "next_experiment": None if flight is None else flight.to_dict()}
    write_json(out / ANSWER, finite(answer))
    pages = [out / ANSWER]
    if edit is not None and edit.diff:
        write_text(out / DIFF, edit.diff)
        pages.append(out / DIFF)
    if config.report:
        from seals.sysid.calibration.application import draw
        from seals.sysid.calibration.report import write_report

        diff, notes = ("", ()) if edit is None else (edit.diff, edit.notes)
        more = [] if flight is None else [flight.sentence]
        pages.append(write_report(found, out, diff=diff, notes=notes, more=more))
        pages.append(draw(found, out))
    if config.apply and edit is not None:
        pages.append(write_robot(edit, out / ROBOT))
    return pages


def _print(outcome: Outcome) -> None:
    """Print the table of numbers with remarks."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    found = outcome.found
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, name in enumerate(HEAD):
        table.add_column(name, justify="left" if k == 0 else "right", no_wrap=True)
    for number in found.numbers:
        table.add_row(*(escape(printable(cell)) for cell in row(found, number)))
    Console(file=drawing(sys.stdout), highlight=False, width=_WIDTH).print(table)
    flight = [] if outcome.flight is None else [outcome.flight.sentence]
    notes = () if outcome.edit is None else outcome.edit.notes
    print("\n".join([error_sentence(found), *remarks(found), *flight, *notes]))


PICTURE = "calibration.png"


def draw(found: Calibration, folder: Path) -> Path:
    """Draw measurement and model before and after, the residuals below; return the path.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    choice = next(block for block in overlays(found) if isinstance(block, Choice))
    worst = next(iter(choice.options.values()))
    charts = [replace(chart, note="") for chart in worst if isinstance(chart, Chart)]
    return write_picture(folder / PICTURE, charts)
