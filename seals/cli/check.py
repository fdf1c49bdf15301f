"""``seals check``: check a robot folder for physical plausibility."""

from __future__ import annotations

import sys
from collections import Counter
from typing import TYPE_CHECKING, cast

from seals.errors import ConfigError, printable
from seals.terminal import drawing

if TYPE_CHECKING:
    from seals.check.robot import RobotFinding
    from seals.robot.settings import RobotSettings

_COLOURS = {"pass": "green", "warn": "yellow", "fail": "bold red"}


def check(arguments: list[str]) -> int:
    """Check a robot and print all findings; return 1 when one of them is a failure."""
    from omegaconf import OmegaConf

    from seals.config.checks import refuse_unknown
    from seals.config.compose import compose
    from seals.config.refusal import refusals
    from seals.run.assembly import build_model
    from seals.run.build import build_run
    from seals.schema import check_tree
    from seals.world.sensor_suite import carrier_of

    robots = [word for word in arguments if word.startswith("robot=")]
    if len(robots) != 1:
        given = f"{' '.join(robots)}: several robots are given" if robots else "robot is not given"
        raise ConfigError(f"{given}.\nWrite: seals check robot=NAME or robot=FOLDER")
    config = compose(arguments)
    refuse_unknown(config, where="")
    with refusals(arguments):
        settings = cast("RobotSettings", OmegaConf.to_object(config.robot))
    check_tree(settings, where="robot")
    # what a run would refuse
    run = build_run(config)
    robot, _ = build_model(run)
    for name, sensor in run.sensors.items():
        carrier_of(name, sensor, robot)
    from seals.check.robot import check_robot

    findings = check_robot(settings, run.actuators, run.effects)
    show(str(config.robot.name), findings)
    return 1 if any(finding.verdict.value == "fail" for finding in findings) else 0


def show(robot: str, findings: list[RobotFinding]) -> None:
    """Print the findings as a table, and their count below it."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    # a pipe has no width: wide enough that lines are not broken for a reader such as grep
    console = Console(
        file=drawing(sys.stdout),
        width=None if sys.stdout.isatty() else 160,
        highlight=False,
        markup=False,
    )
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for finding in findings:
        word = finding.verdict.value
        words = Text(printable(finding.found))
        if finding.advice:
            words.append(f"\n{printable(finding.advice)}", style="dim")
        table.add_row(Text(word, style=_COLOURS[word]), Text(printable(finding.subject)), words)
    console.print(table)
    numbers = Counter(finding.verdict.value for finding in findings)
    console.print(
        f"\n{printable(robot)}: {numbers['pass']} passed, "
        f"{numbers['warn']} with warnings, {numbers['fail']} failed."
    )
