"""Robots of other projects: taken over, checked, and driven along a course in their media.

``python tests/validation/outside_robots.py [NAME ...]`` prints the table of
``docs/robot_files.md``.
"""

from __future__ import annotations

import importlib.util
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.check.robot import Verdict, check_robot
from seals.logs import Log
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot

VEHICLES = Path(__file__).parents[1] / "unit/urdfs/vehicles"
_found = importlib.util.find_spec("pybullet_data")
PUBLISHED = Path(_found.origin).parent if _found and _found.origin else Path("pybullet_data")
"""Files of makers that come with PyBullet; not there where it is not installed."""


class Course(NamedTuple):
    """One robot and its course.

    Args:
        file: of the robot, below the folder of the vehicles.
        dialect: of the file.
        words: of the run, beside the robot.
        course: in words.
        measure: error of the run from its log, in metres.
        bound: of that error [m].
        by_hand: lines of YAML or arguments that were written for it, in words.
        options: of the take-over.
        allowed: subjects whose check may fail or warn.
    """

    file: str
    dialect: str
    words: tuple[str, ...]
    course: str
    measure: Callable[[Log], float]
    bound: float
    by_hand: str = "nothing"
    options: Mapping[str, Any] = {}


class Driven(NamedTuple):
    """Outcome of a course: error [m], failures of the check, largest lean [rad], time taken [s]."""

    error: float
    failures: list[str]
    lean: float
    seconds: float


def at_places(*places: tuple[float, float, float]) -> Callable[[Log], float]:
    """Return the measure of waypoints: the largest of the least distances from them."""

    def measured(log: Log) -> float:
        path = log.channel("position")
        return max(float(np.linalg.norm(path - place, axis=1).min()) for place in places)

    return measured


def across(
    a: tuple[float, float], b: tuple[float, float], depth: float | None, after: float
) -> Any:
    """Return the measure of a straight leg: the largest distance from it after a way along it."""

    def measured(log: Log) -> float:
        way = np.subtract(b, a) / np.hypot(*np.subtract(b, a))
        off = log.channel("position")[:, :2] - a
        on = (off @ way > after) & (off @ way < np.hypot(*np.subtract(b, a)))
        if not on.any():
            return float("inf")
        cross = np.abs(off @ np.array([-way[1], way[0]]))[on]
        if depth is None:
            return float(cross.max())
        return float(np.hypot(cross, log.channel("position")[on, 2] - depth).max())

    return measured


def over(*places: tuple[float, float, float]) -> Callable[[Log], float]:
    """Return the measure of a walk: the largest of the least level distances from its places."""

    def measured(log: Log) -> float:
        path = log.channel("position")[:, :2]
        return max(float(np.linalg.norm(path - place[:2], axis=1).min()) for place in places)

    return measured


def at_end(x: float, y: float) -> Callable[[Log], float]:
    """Return the measure of a walk: the distance from its target at the end."""
    return lambda log: float(np.hypot(*(log.channel("position")[-1, :2] - [x, y])))


def at_height(height: float) -> Callable[[Log], float]:
    """Return the measure of a float: the error of its mean height over the last third."""

    def measured(log: Log) -> float:
        late = log.time > 2.0 / 3.0 * log.time[-1]
        return abs(float(log.channel("position")[late, 2].mean()) - height)

    return measured


def places_of(*places: tuple[float, float, float]) -> str:
    """Return the places as an argument of a guide."""
    return f"guide.places={[list(map(float, place)) for place in places]}".replace(" ", "")


def hovering(
    *places: tuple[float, float, float], start: str, duration: float, rest: float = 3.0
) -> tuple[str, ...]:
    """Return the words of a course through waypoints."""
    return (
        "guide=waypoints",
        places_of(*places),
        "guide.speed=0.5",
        "guide.delay=1",
        f"guide.rest={rest}",
        f"initial.position={start}",
        f"time.duration={duration}",
        "time.step=0.008",
    )


SQUARE = ((1.0, 0.0, 1.5), (1.0, 1.0, 1.2))
UNDER = ((1.5, 0.0, -3.0), (1.5, 1.5, -2.5))
FLIGHT = hovering(*SQUARE, start="[0,0,1]", duration=17)
DIVE = hovering(*UNDER, start="[0,0,-2]", duration=19)
AIR = ("controller=cascade", *FLIGHT)
ROV = ("water=fossen", "controller=station", *DIVE)
FLOWN = {
    "course": "two places in air, a rest at each",
    "measure": at_places(*SQUARE),
    "bound": 0.05,
}
THROUGH = ((0.6, 0.4, -1.0), (0.0, 0.0, 0.8))
BOTH = (
    "water=fossen",
    "controller=cascade",
    *hovering(*THROUGH, start="[0,0,0.6]", duration=20, rest=5.0),
)
DIVED = {
    "course": "two places under water, a rest at each",
    "measure": at_places(*UNDER),
    "bound": 0.05,
}
BUOY_AFLOAT = 0.2 - 0.4 * 18.0 / 998.2 / 0.045
"""Height of the buoy's float of 0.4 m and 45 litre when 18 kg of water are displaced [m]."""
WALK = ("guide=seek", "environment.ground_level=0", "time.step=0.002")
CORNERS = ((1.0, 0.0, 0.0), (1.0, 0.8, 0.0), (0.0, 0.8, 0.0))
TROT = (
    "guide=waypoints",
    places_of(*CORNERS),
    "guide.speed=0.3",
    "guide.delay=1",
    "guide.face_ahead=true",
    "environment.ground_level=0",
    "time.duration=25",
)
WALKED = {
    "course": "trots over three corners of a rectangle of 1 m by 0.8 m, turning at each",
    "measure": over(*CORNERS),
    "bound": 0.05,
}
LEG = ("water=fossen", "controller=autopilot", "guide=los", "time.step=0.01")
COURSES: dict[str, Course] = {
    "bluerov2": Course("bluerov2.sdf", "SDF", ROV, **DIVED),
    "bluerov2_heavy": Course("bluerov2_heavy.urdf", "URDF", ROV, **DIVED),
    "octocopter": Course("octocopter.urdf", "URDF", AIR, **FLOWN),
    "tilted_hexacopter": Course("tilted_hexacopter.urdf", "URDF", AIR, **FLOWN),
    "tricopter": Course("tricopter.urdf", "URDF", AIR, **FLOWN),
    "iris": Course("iris.sdf", "SDF", AIR, **FLOWN),
    "x500": Course("x500/model.sdf", "SDF", AIR, **FLOWN),
    "quadrotor": Course("quadrotor.xml", "MJCF", AIR, **FLOWN),
    "tilted_hexacopter_both": Course(
        "tilted_hexacopter.urdf",
        "URDF",
        (*BOTH, "robot.hulls.body.displaced_volume=0.0043"),
        "air, a place 1 m under water, and out again",
        at_places(*THROUGH),
        0.05,
        by_hand="one line: the displaced volume of its frame, which is no closed box",
        options={"medium": "both"},
    ),
    "buoy": Course(
        "buoy.sdf",
        "SDF",
        ("water=fossen", "initial.position=[0,0,0.14]", "time.duration=60", "time.step=0.01"),
        "dropped from 0.1 m above its draught; mean height afloat against Archimedes",
        at_height(BUOY_AFLOAT),
        0.005,
    ),
    "quadruped": Course("quadruped.xml", "MJCF", (*TROT, "initial.position=[0,0,0.285]"), **WALKED),
    "quadruped_ros": Course(
        "quadruped.urdf", "URDF", (*TROT, "initial.position=[0,0,0.33]"), **WALKED
    ),
    "a1": Course(
        str(PUBLISHED / "a1/a1.urdf"), "URDF", (*TROT, "initial.position=[0,0,0.305]"), **WALKED
    ),
    "aliengo": Course(
        str(PUBLISHED / "aliengo/aliengo.urdf"),
        "URDF",
        (*TROT, "initial.position=[0,0,0.384]"),
        **WALKED,
    ),
    "crab": Course(
        "crab_description/urdf/crab.urdf.xacro",
        "xacro",
        (*WALK, "initial.position=[0,0,0.097]", "guide.place=[0.3,0.1]", "time.duration=16"),
        "0.32 m over land to a place aside",
        at_end(0.3, 0.1),
        0.1,
        options={"packages": {"crab_parts": VEHICLES / "crab_parts"}},
    ),
    "survey_auv": Course(
        "survey_auv.sdf",
        "SDF",
        (
            *LEG,
            "guide.speed=1",
            "guide.acceptance=4",
            places_of((0.1, 0, -4), (60, 0, -4)),
            "initial.position=[0,2,-3]",
            "initial.velocity=[1,0,0]",
            "time.duration=45",
        ),
        "a leg at 4 m depth, begun 2 m beside and 1 m above it",
        across((0.0, 0.0), (60.0, 0.0), -4.0, 30.0),
        0.3,
    ),
    "torpedo": Course(
        "torpedo.sdf",
        "SDF",
        (
            *LEG,
            "guide.speed=1",
            "guide.lookahead=10",
            "guide.climb_lookahead=10",
            "guide.acceptance=8",
            places_of((0.1, 0, -4), (120, 0, -4)),
            "initial.position=[0,2,-3]",
            "initial.velocity=[1,0,0]",
            "time.duration=100",
        ),
        "a leg at 4 m depth, begun 2 m beside and 1 m above it",
        across((0.0, 0.0), (120.0, 0.0), -4.0, 70.0),
        0.3,
        by_hand="two look-aheads of the guide",
    ),
    "boat": Course(
        "boat.sdf",
        "SDF",
        (
            *LEG,
            "guide.speed=1.5",
            "guide.acceptance=4",
            "guide.lookahead=18",
            places_of((0.1, 0, 0), (110, 0, 0)),
            "initial.position=[0,3,0.1]",
            "time.duration=70",
        ),
        "a leg on the surface, begun 3 m beside it",
        across((0.0, 0.0), (110.0, 0.0), None, 70.0),
        0.3,
        by_hand="the look-ahead of the guide: it drifts sideways for seconds",
    ),
}


def driven(name: str, course: Course, parent: Path) -> Driven:
    """Take a robot over, check it, and drive it along its course.

    Args:
        name: of the course.
        course: of the robot.
        parent: folder for the robot.
    """
    began = time.perf_counter()
    made = scaffold_robot(f"my_{name}", VEHICLES / course.file, parent=parent, **course.options)
    settings = run_settings([f"robot={made.folder}"])
    found = check_robot(settings.robot, settings.actuators, settings.effects)
    assert build_robot(settings.robot).links == made.robot.links
    failures = [str(one) for one in found if one.verdict is Verdict.FAIL]
    record = simulate(run_settings([f"robot={made.folder}", *course.words]))
    assert record.error is None, record.error
    log = record.log
    _, x, y, _ = log.channel("orientation").T
    lean = float(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)).max())
    return Driven(course.measure(log), failures, lean, time.perf_counter() - began)


def table(courses: Mapping[str, Course]) -> None:
    """Print one row for each course."""
    print("| robot | file | written by hand | course | error [m] | lean [deg] | computed in [s] |")
    print("|---|---|---|---|---|---|---|")
    for name, course in courses.items():
        with tempfile.TemporaryDirectory() as folder:
            found = driven(name, course, Path(folder))
        assert not found.failures, found.failures
        cells = (
            name,
            f"{course.dialect}",
            course.by_hand,
            course.course,
            f"{found.error:.3f}",
            f"{np.degrees(found.lean):.0f}",
            f"{found.seconds:.0f}",
        )
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    table({name: COURSES[name] for name in sys.argv[1:] or COURSES})
