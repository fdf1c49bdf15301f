"""Files of other projects as they are published: taken over, checked, and driven along a course.

``python tests/validation/published_robots.py [NAME ...]`` prints the second table of
``docs/robot_files.md``. Those of ``example-robot-data`` need that package
(``pip install --no-deps example-robot-data``), those of Crazyflies ``crazyflow``.
"""

from __future__ import annotations

import importlib.metadata
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from outside_robots import (
    AIR,
    DIVED,
    FLOWN,
    LEG,
    ROV,
    TROT,
    VEHICLES,
    WALKED,
    Course,
    across,
    at_height,
    at_places,
    places_of,
    table,
)

FILES = VEHICLES.with_name("published")
DEEP = ((1.5, 0.0, -4.0), (1.5, 1.5, -3.5))
FLOAT = ("water=fossen", "time.duration=60", "time.step=0.01")
BOXES: dict[str, Any] = {"boxes": True}
BY_HAND = "`missing-meshes=boxes`"
LIGHT_AFLOAT = 0.4 - 67.15 / 998.2 / 1.5**2
"""Height of a float of 1.5 m by 1.5 m and 0.4 m below its origin, with 67.15 kg [m]."""
ROUND_AFLOAT = 0.25 - 0.0702
"""Height of a ball of 0.25 m with 3.5 kg: pi h^2 (0.75 m - h) / 3 = 3.506 litre [m]."""


def _installed(package: str, path: str) -> Path:
    """Return the path of a file of a package; a path that is not there where it is missing."""
    try:
        return Path(str(importlib.metadata.distribution(package).locate_file(path)))
    except importlib.metadata.PackageNotFoundError:
        return Path(package) / path


def _data(path: str) -> str:
    return str(
        _installed("example-robot-data", f"cmeel.prefix/share/example-robot-data/robots/{path}")
    )


def _crazyflow(name: str) -> str:
    return str(_installed("crazyflow", f"crazyflow/drones/{name}.xml"))


def _walker(file: str, height: float) -> Course:
    words = (*TROT, f"initial.position=[0,0,{height}]")
    return Course(_data(file), "URDF", words, **WALKED)


COURSES: dict[str, Course] = {
    "bicopter": Course(
        str(FILES / "bicopter/model.sdf"),
        "SDF",
        AIR,
        by_hand=BY_HAND,
        options={**BOXES, "medium": "air"},
        **FLOWN,
    ),
    "x500": Course(str(FILES / "x500/model.sdf"), "SDF", AIR, **FLOWN),
    "crazyflie": Course(_crazyflow("cf2x_L250"), "MJCF", AIR, **FLOWN),
    "holybro_x500": Course(_crazyflow("hb_x500"), "MJCF", AIR, **FLOWN),
    "iris": Course(_data("iris_description/robots/iris.urdf"), "URDF", AIR, **FLOWN),
    "bluerov2": Course(str(FILES / "bluerov2/model.sdf"), "SDF", ROV, **DIVED),
    "rexrov": Course(
        str(FILES / "uuv_descriptions/models/rexrov/urdf/rexrov_base.xacro"),
        "xacro",
        (
            *("water=fossen", "controller=station", "guide=waypoints", places_of(*DEEP)),
            *("guide.speed=0.3", "guide.delay=1", "guide.rest=8"),
            *("initial.position=[0,0,-3]", "time.duration=40", "time.step=0.008"),
        ),
        "two places under water, a rest at each",
        at_places(*DEEP),
        0.05,
        by_hand=BY_HAND,
        options=BOXES,
    ),
    "tethys": Course(
        str(FILES / "tethys_equipped/model.sdf"),
        "SDF",
        (
            *(*LEG, "guide.speed=1", "guide.lookahead=10", "guide.climb_lookahead=10"),
            *("guide.acceptance=8", places_of((0.1, 0, -4), (120, 0, -4))),
            *("initial.position=[0,2,-3]", "initial.velocity=[1,0,0]", "time.duration=100"),
        ),
        "a leg at 4 m depth, begun 2 m beside and 1 m above it",
        across((0.0, 0.0), (120.0, 0.0), -4.0, 70.0),
        0.05,
        by_hand="`forward=-x`; two look-aheads of the guide",
        options={"forward": "-x"},
    ),
    "wamv": Course(
        str(FILES / "vrx/wamv_gazebo/urdf/wamv_gazebo.urdf.xacro"),
        "xacro",
        (
            *(*LEG, "guide.speed=1.5", "guide.lookahead=12", "guide.acceptance=4"),
            *(places_of((0.1, 0, 0), (110, 0, 0)), "initial.position=[0,3,0]", "time.duration=70"),
        ),
        "a leg on the surface, begun 3 m beside it",
        across((0.0, 0.0), (110.0, 0.0), None, 70.0),
        0.1,
        by_hand="the look-ahead of the guide",
    ),
    "eca_a9": Course(
        str(FILES / "eca_a9_description/urdf/eca_a9_base.xacro"),
        "xacro",
        (
            *(*LEG, "environment.water_density=1027", "guide.speed=1.5", "guide.lookahead=10"),
            *("guide.climb_lookahead=10", "guide.acceptance=8"),
            *(places_of((0.1, 0, -4), (120, 0, -4)), "initial.position=[0,2,-3]"),
            *("initial.velocity=[1,0,0]", "time.duration=90"),
        ),
        "a leg at 4 m depth, begun 2 m beside and 1 m above it",
        across((0.0, 0.0), (120.0, 0.0), -4.0, 70.0),
        0.05,
        by_hand=f"{BY_HAND}; two look-aheads of the guide; the sea water it is trimmed for",
        options=BOXES,
    ),
    "skydio_x2": Course(
        str(FILES / "skydio_x2/x2.xml"),
        "MJCF",
        (*AIR, "actuators.rotors.direction=[-1,1,-1,1]"),
        by_hand="`direction`: the file's rotors of one side turn alike",
        **FLOWN,
    ),
    "omnicopter": Course(str(FILES / "omnicopter/model.sdf"), "SDF", AIR, **FLOWN),
    "light_buoy": Course(
        str(FILES / "buoys/robotx_light_buoy.sdf"),
        "SDF",
        (*FLOAT, "initial.position=[0,0,0.45]"),
        "dropped; mean height afloat against Archimedes",
        at_height(LIGHT_AFLOAT),
        0.005,
    ),
    "round_buoy": Course(
        str(FILES / "buoys/round_buoy.sdf"),
        "SDF",
        (*FLOAT, "initial.position=[0,0,0.25]"),
        "dropped; mean height afloat against Archimedes",
        at_height(ROUND_AFLOAT),
        0.005,
    ),
    "spot": Course(
        str(FILES / "spot/spot.xml"),
        "MJCF",
        (
            *(*TROT, "initial.position=[0,0,0.467]"),
            f"actuators.servos.kp_each={[1500] * 12}".replace(" ", ""),
        ),
        by_hand=f"{BY_HAND}; `kp_each`, as the command asks",
        options=BOXES,
        **WALKED,
    ),
    "solo12": _walker("solo_description/robots/solo12.urdf", 0.243),
    "go2": _walker("go2_description/urdf/go2.urdf", 0.332),
    "hyq": _walker("hyq_description/robots/hyq_no_sensors.urdf", 0.463),
    "anymal_b": _walker("anymal_b_simple_description/robots/anymal.urdf", 0.45),
    "anymal_c": _walker("anymal_c_simple_description/urdf/anymal.urdf", 0.49),
}

if __name__ == "__main__":
    table({name: COURSES[name] for name in sys.argv[1:] or COURSES})
