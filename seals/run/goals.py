"""Tracking results of a run: references beside the motion, goals reached or missed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.protocols import Goal
from seals.frames import AXES, matrix_of
from seals.logs import Log
from seals.report import Block, Paragraph, Table
from seals.report.figures import ROUNDING, Chart, Series, without_rounding
from seals.run.simulation import Ending, Record


class GoalResult(NamedTuple):
    """Outcome of one goal.

    Args:
        goal: as the guide states it.
        distance: at the end for a place that is held, the smallest one otherwise [m].
        time: from which on it was held, or at which it was nearest [s]; NaN where it was not held.
    """

    goal: Goal
    distance: float
    time: float

    @property
    def reached(self) -> bool:
        """Whether the goal was reached within its tolerance."""
        return self.distance <= self.goal.tolerance

    def __str__(self) -> str:
        verb = "reached" if self.reached else "missed"
        words = f"{self.goal.name}: {verb}, {self.distance:.3g} m away"
        if not self.goal.held:
            return f"{words} at {self.time:.4g} s"
        since = "" if np.isnan(self.time) else f", within {self.goal.tolerance:g} m since"
        return f"{words} at the end{since}{f' {self.time:.4g} s' if since else ''}"


def goal_results(record: Record) -> list[GoalResult]:
    """Return the outcome of every goal of the guide, in order; none for a run that failed.

    A guide in whose step the run failed may not know its own memory any more.
    """
    log = record.log
    if record.ending is Ending.failed or not np.isfinite(log.channel("position")).any():
        return []
    return [result_of(goal, log.time, log.channel("position")) for goal in record.stages.goals]


def result_of(goal: Goal, time: Floats, place: Floats) -> GoalResult:
    """Return the outcome of one goal.

    Args:
        goal: of the guide.
        time: of the rows [s], shape (T,).
        place: of the body origin in the world [m], shape (T, 3); rows without a reading are NaN.

    Example:
        >>> rows = np.array([[0.0, 0, 0], [0.98, 0, 0], [2.0, 0, 0]])
        >>> print(result_of(Goal("place 1", np.array([1.0, 0, 0])), np.arange(3.0), rows))
        place 1: reached, 0.02 m away at 1 s
    """
    there = np.isfinite(place).all(axis=1)
    time, away = time[there], np.linalg.norm(place[there] - goal.position, axis=1)
    if not goal.held:
        nearest = int(np.argmin(away))
        return GoalResult(goal, float(away[nearest]), float(time[nearest]))
    outside = np.flatnonzero(away > goal.tolerance)
    first = 0 if not len(outside) else int(outside[-1]) + 1
    since = float(time[first]) if first < len(time) else np.nan
    return GoalResult(goal, float(away[-1]), since)


def missed(record: Record) -> list[str]:
    """Return one line for every goal that was missed."""
    results = goal_results(record)
    return [f"Goal {result}." for result in results if not result.reached]


def goal_blocks(record: Record) -> list[Block]:
    """Return the blocks of the report: goals, then references beside motion."""
    charts = reference_charts(record.log)
    results = goal_results(record)
    blocks: list[Block] = []
    lost = [result for result in results if not result.reached]
    if lost:
        goals = "goal" if len(results) == 1 else "goals"
        text = f"{len(lost)} of {len(results)} {goals} missed: " + "; ".join(map(str, lost)) + "."
        blocks.append(Paragraph(text=text, tone="warn"))
    elif results:
        told = "The goal was reached."
        if len(results) > 1:
            told = f"All {len(results)} goals were reached."
        blocks.append(Paragraph(text=told, tone="good"))
    if results:
        rows = [
            (
                result.goal.name,
                ", ".join(f"{x if abs(x) > ROUNDING else 0:.4g}" for x in result.goal.position),
                f"{result.goal.tolerance:g}",
                f"{result.distance:.3g}",
                "-" if np.isnan(result.time) else f"{result.time:.4g}",
                "reached" if result.reached else "missed",
            )
            for result in results
        ]
        head = ("goal", "place [m]", "tolerance [m]", "distance [m]", "time [s]", "outcome")
        blocks.append(Table(head=head, rows=rows, right=(2, 3, 4)))
    return [*blocks, *charts]


def reference_charts(log: Log) -> list[Chart]:
    """Return wanted and achieved velocity and heading over time; none without a guide."""
    if "aim_velocity_x" not in log.columns:
        return []
    turn = matrix_of(log.channel("orientation")[:, [1, 2, 3, 0]])
    velocity = np.einsum("nij,nj->ni", turn, log.channel("velocity"))
    charts = []
    for k, axis in enumerate(AXES):
        wanted = log.columns[f"aim_velocity_{axis}"]
        if np.nanmax(np.abs([wanted, velocity[:, k]]), initial=0.0) <= ROUNDING:
            continue
        pair = _pair(log.time, wanted, velocity[:, k])
        charts.append(
            Chart(title=f"Velocity along world {axis}", y_label="velocity [m/s]", series=pair)
        )
    yaw = np.unwrap(np.nan_to_num(np.arctan2(turn[:, 1, 0], turn[:, 0, 0])))
    aim = log.columns["aim_yaw"]
    # on the same turn as what was achieved
    wanted = aim + 2.0 * np.pi * np.round((yaw - aim) / (2.0 * np.pi))
    pair = _pair(log.time, np.degrees(wanted), np.degrees(yaw))
    return [*charts, Chart(title="Heading", y_label="heading [deg]", series=pair)]


def _pair(time: Floats, wanted: Floats, achieved: Floats) -> tuple[Series, Series]:
    return (
        Series(name="wanted", x=time, y=without_rounding(wanted), dashed=True),
        Series(name="achieved", x=time, y=without_rounding(achieved)),
    )
