"""Runs of the shipped robots and animals in their media, and the effects to hide in them."""

from __future__ import annotations

from dataclasses import dataclass, field

MASS = {
    "aam": 2.6,
    "aam_dual_arm": 3.1,
    "amphibian": 40.0,
    "auv": 9.2,
    "ball": 0.3,
    "basket": 1.0,
    "boat": 24.0,
    "box": 4.2,
    "crab": 0.14,
    "crazyflie": 0.027,
    "cube": 0.1,
    "cylinder": 4.7,
    "free_arm": 1.35,
    "hexacopter": 3.1,
    "impactor": 0.51,
    "pendulum": 0.1,
    "rov": 13.5,
    "rov_arm": 13.97,
    "rover": 1.0,
    "sea_spider": 0.024,
    "ship_section": 46.8,
    "slocum": 70.0,
    "torpedo": 30.5,
    "valve": 0.2,
}
"""Mass [kg]."""
LENGTH = {
    "aam": 0.24,
    "aam_dual_arm": 0.24,
    "amphibian": 0.22,
    "auv": 0.2,
    "ball": 0.05,
    "basket": 0.2,
    "boat": 0.25,
    "box": 0.15,
    "crab": 0.03,
    "crazyflie": 0.045,
    "cube": 0.025,
    "cylinder": 0.1,
    "free_arm": 0.1,
    "hexacopter": 0.3,
    "impactor": 0.02,
    "pendulum": 0.1,
    "rov": 0.25,
    "rov_arm": 0.25,
    "rover": 0.07,
    "sea_spider": 0.02,
    "ship_section": 0.2,
    "slocum": 0.4,
    "torpedo": 0.1,
    "valve": 0.12,
}
"""Half the width of the body, or the arm of the outer drives [m]."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A robot in a medium: one run that is diagnosed, another that verifies.

    Args:
        robot: name.
        medium: for the table.
        words: overrides of both runs.
        first: further overrides of the run that is diagnosed.
        second: of the run that verifies.
        effects: to be hidden, one a run; those that tell most first.
        known: effects of the robot that stand in for a hidden one, by name: instance.
    """

    robot: str
    medium: str
    words: tuple[str, ...]
    first: tuple[str, ...]
    second: tuple[str, ...]
    effects: tuple[str, ...]
    known: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Robot and medium in one word."""
        return f"{self.robot}_{self.medium}"


def hidden(scene: Scene, effect: str) -> list[str]:
    """Overrides that add a hidden effect.

    An effect that the robot has already is taken out of what its log states. Others are a tenth of
    the weight, of the thrust or of the size, and flows as fast as the robot moves.
    """
    if effect in scene.known:
        return [f"hide=[{scene.known[effect]}]"]
    values = truth(scene, effect)
    words = [f"+effect@effects.hidden={effect}", "hide=[hidden]"]
    medium = [f"effects.hidden.medium={scene.medium}"] if effect.endswith("_drag") else []
    return words + medium + [f"effects.hidden.{k}={v:g}" for k, v in values.items()]


def truth(scene: Scene, effect: str) -> dict[str, float]:
    """Parameters of an effect that is hidden; empty where the robot states them."""
    if effect in scene.known:
        return {}
    mass, length = MASS[scene.robot], LENGTH[scene.robot]
    # a drag of a fifth of the weight at the speed of the courses
    drag = 0.2 * 9.81 * mass / 0.8
    values: dict[str, dict[str, float]] = {
        "wind": {"velocity_x": 3.0, "velocity_y": -2.0},
        "current": {"velocity_x": 0.25, "velocity_y": -0.15},
        "payload": {
            "mass": 0.1 * mass,
            "position_x": 0.4 * length,
            "position_y": 0.2 * length,
            "position_z": -0.4 * length,
        },
        "thrust_coefficient": {"relative_change": -0.12},
        "weak_rotor": {"relative_loss": 0.15, "rotor": 2},
        "centre_of_gravity": {"offset_x": 0.08 * length, "offset_y": -0.06 * length},
        "centre_of_buoyancy": {"offset_x": 0.08 * length, "offset_y": -0.06 * length},
        "linear_drag": {"coefficient_x": drag, "coefficient_y": drag, "coefficient_z": drag},
        "accelerometer_bias": {"bias_x": 0.4, "bias_y": -0.3},
        "gyroscope_bias": {"bias_x": 0.03, "bias_z": -0.04},
    }
    return values[effect]


_FLYING = ("payload", "wind", "thrust_coefficient", "weak_rotor", "centre_of_gravity")
_DIVING = ("payload", "current", "thrust_coefficient", "quadratic_drag", "weak_rotor")
_ADRIFT = ("current", "payload", "quadratic_drag", "centre_of_gravity", "accelerometer_bias")
_IN_WATER = {"quadratic_drag": "water_drag"}


def _ways(depth: float, reach: float, speed: float) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Two courses of waypoints about a place at a height [m]."""
    first = ((1.0, 0.6, 0.4), (0.1, -0.7, -0.3), (-0.5, 0.3, 0.3), (0.5, 0.0, 0.0))
    second = ((-0.8, 0.7, -0.3), (0.6, 0.5, 0.4), (0.2, -0.8, 0.0), (0.0, 0.0, 0.2))
    return _course(first, depth, reach, speed), _course(second, depth, reach, speed)


def _course(
    corners: tuple[tuple[float, float, float], ...], depth: float, reach: float, speed: float
) -> tuple[str, ...]:
    places = ",".join(
        f"[{reach * x:.3f},{reach * y:.3f},{depth + reach * z:.3f}]" for x, y, z in corners
    )
    return (
        "guide=waypoints",
        f"guide.places=[{places}]",
        f"guide.speed={speed}",
        "guide.rest=0.2",
        "guide.delay=0.3",
        "guide.repeat=true",
    )


def _flown(robot: str, more: tuple[str, ...], effects: tuple[str, ...] = _FLYING) -> Scene:
    reach = 5.0 * LENGTH[robot]
    first, second = _ways(3.0, reach, reach)
    words = (f"robot={robot}", "initial.position=[0,0,3]", "initial.drives=carrying", *STEER, *more)
    return Scene(
        robot=robot, medium="air", words=words, first=first, second=second, effects=effects
    )


def _dived(robot: str, more: tuple[str, ...], *, speed: float = 0.3) -> Scene:
    first, second = _ways(-3.0, 1.25 * speed, speed)
    words = (f"robot={robot}", "water=fossen", "initial.position=[0,0,-3]", *STEER, *more)
    return Scene(
        robot=robot,
        medium="water",
        words=words,
        first=first,
        second=second,
        effects=_DIVING,
        known=_IN_WATER,
    )


def _steered(robot: str, depth: float, more: tuple[str, ...]) -> Scene:
    """A vehicle that steers along legs by line of sight."""
    first, second = (
        f"guide.places=[{','.join(f'[{x},{y},{depth + dive}]' for x, y, dive in corners)}]"
        for corners in (
            ((8.0, 0.0, 0.0), (14.0, 6.0, -0.4 * (depth < 0.0)), (14.0, 30.0, 0.0)),
            ((8.0, 0.0, 0.0), (14.0, -5.0, 0.3 * (depth < 0.0)), (24.0, -20.0, 0.0)),
        )
    )
    place = f"initial.position=[0,0,{depth}]"
    return Scene(
        robot=robot,
        medium="water",
        words=(
            f"robot={robot}",
            "+sensor@sensors.imu=imu",
            "water=fossen",
            "guide=los",
            place,
            *STEER,
            *more,
        ),
        first=(first,),
        second=(second,),
        effects=("current", "payload", "quadratic_drag", "thrust_coefficient", "gyroscope_bias"),
        known={"quadratic_drag": "drag"},
    )


def _released(
    robot: str,
    medium: str,
    first: str,
    second: str,
    *,
    effects: tuple[str, ...] = _ADRIFT,
    drag: str = "water_drag",
    more: tuple[str, ...] = (),
) -> Scene:
    """A body that is let go with a speed, a spin and an attitude, each given by nine numbers."""
    return Scene(
        robot=robot,
        medium=medium,
        words=(f"robot={robot}", *(("water=fossen",) if medium == "water" else ()), FINE, *more),
        first=_start(first),
        second=_start(second),
        effects=effects,
        known={"quadratic_drag": drag},
    )


def _start(numbers: str) -> tuple[str, ...]:
    """Height, three of the attitude, three of the velocity, three of the spin."""
    n = numbers.split()
    return (
        f"initial.position=[0,0,{n[0]}]",
        f"initial.rpy=[{','.join(n[1:4])}]",
        f"initial.velocity=[{','.join(n[4:7])}]",
        f"initial.angular_velocity=[{','.join(n[7:10])}]",
    )


STEER = ("guide.rate=100", "controller.rate=100", "time.step=0.0025")
"""Commands as often as rows of the log, so that a row holds what led to the next."""
FINE = "time.step=0.001"
"""Light bodies on the surface and links that swing: a quarter of the usual step."""
_ARM = ("initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]",)
_ARM_4 = ("initial.joint_position=[1.55,0,0,0,-0.6,-0.6,-0.6]",)
_ARMS = ("initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6,1.55,0,0,-0.6,-0.6,-0.6]",)
_WALKED = ("guide=march", "environment.friction=0.8")
_LIMBS = ("current", "payload", "centre_of_gravity", "accelerometer_bias", "gyroscope_bias")

_DRIVEN = ("guide=los", "guide.speed=0.15", "guide.lookahead=0.2", "initial.position=[0,0,0.033]")

SCENES = (
    _dived("auv", (), speed=0.8),
    _dived("rov", (), speed=0.4),
    _dived("rov_arm", _ARM_4, speed=0.4),
    _released(
        "box",
        "water",
        "-0.03 0.5 0.3 0 0.5 0.3 0 0.4 0.3 0.8",
        "-0.05 -0.4 0.2 0 -0.4 0.4 0 -0.3 0.5 -1",
    ),
    _released(
        "cylinder",
        "water",
        "0.02 0.3 0.2 0 0.4 0.3 0 0.3 0.3 0.8",
        "-0.06 -0.2 0.4 0 -0.3 0.4 0 -0.3 0.5 -1",
    ),
    _released("ball", "water", "-0.02 0 0 0 0.6 0.3 0 2 1 3", "-0.03 0 0 0 -0.5 0.4 0 -1 2 2"),
    _released(
        "cube",
        "water",
        "-0.5 0.5 0.3 0 0.6 0.3 0.8 2 1 3",
        "-0.5 -0.3 0.5 0 -0.5 0.4 0.9 -1 2 -2",
        more=("+sensor@sensors.imu=imu",),
    ),
    _released(
        "ship_section",
        "water",
        "-0.05 0.3 0.15 0 0.5 0.3 0 0.3 0.2 0.5",
        "-0.12 -0.2 0.2 0 -0.4 0.4 0 -0.3 0.3 -0.5",
        effects=(
            "payload",
            "centre_of_gravity",
            "linear_drag",
            "accelerometer_bias",
            "gyroscope_bias",
        ),
        more=("+sensor@sensors.imu=imu",),
    ),
    _released(
        "slocum",
        "water",
        "-10 0 0.4 0 0.6 0.05 -0.1 0.1 0.1 0.1",
        "-10 0 -0.4 0 0.7 -0.05 0.1 -0.1 0.1 0.1",
        drag="hull_drag",
        more=("+sensor@sensors.imu=imu",),
    ),
    _released(
        "impactor",
        "water",
        "0.5 0 0 0 0.2 0.1 -2 0 0 0.5",
        "0.3 0 0.05 0 0.1 0.2 -3 0 0 0.5",
        drag="nose_drag",
    ),
    _released(
        "free_arm",
        "water",
        "-3 0.5 0.3 0 0.6 0.3 0.5 1 0.5 1",
        "-3 -0.3 0.4 0 -0.5 0.4 0.6 -1 0.5 -1",
        more=("initial.joint_position=[0.4,-0.3]",),
    ),
    _flown("aam", _ARM),
    _dived("aam", _ARM),
    _flown("hexacopter", _ARM_4),
    _dived("hexacopter", _ARM_4),
    _flown("aam_dual_arm", _ARMS),
    _dived("aam_dual_arm", _ARMS),
    _flown(
        "crazyflie",
        # the robot states no lag, a real one has some
        ("controller=cascade", "actuators.rotors.time_constant=[0.03]"),
        ("payload", "weak_rotor", "thrust_coefficient", "linear_drag", "centre_of_gravity"),
    ),
    Scene(
        robot="crab",
        medium="land",
        words=(
            "robot=crab",
            "environment.ground_level=0.0",
            "initial.position=[0,0,0.029]",
            "+sensor@sensors.imu=imu",
            *_WALKED,
        ),
        first=("guide.speed=0.2", "guide.way=1.5708"),
        second=("guide.speed=0.15", "guide.way=1.5708"),
        effects=_LIMBS[1:],
    ),
    Scene(
        robot="crab",
        medium="seabed",
        words=(
            "robot=crab",
            "water=fossen",
            "environment.tank_bottom=-1.0",
            "initial.position=[0,0,-0.971]",
            "+sensor@sensors.imu=imu",
            *_WALKED,
        ),
        first=("guide.speed=0.1", "guide.way=1.5708"),
        second=("guide.speed=0.08", "guide.way=1.5708"),
        effects=_LIMBS,
    ),
    Scene(
        robot="sea_spider",
        medium="seabed",
        words=(
            "robot=sea_spider",
            "water=fossen",
            "environment.tank_bottom=-1.0",
            "initial.position=[0,0,-0.96]",
            "+sensor@sensors.imu=imu",
            *_WALKED,
        ),
        first=("guide.speed=0.03",),
        second=("guide.speed=0.02",),
        effects=_LIMBS,
    ),
    _steered("torpedo", -3.0, ("initial.velocity=[1.5,0,0]", "guide.speed=1.5")),
    _steered("boat", 0.0, ("guide.speed=0.8",)),
    _steered("amphibian", 0.054, ("guide.speed=0.8",)),
    Scene(
        robot="rover",
        medium="land",
        words=("robot=rover", "+sensor@sensors.imu=imu", "environment.ground_level=0.0", *_DRIVEN),
        first=("guide.places=[[1,0,0],[1,1,0]]",),
        second=("guide.places=[[1,0,0],[1,-1,0]]",),
        # it never leaves the ground, whose forces a diagnosis does not model
        effects=(),
    ),
    Scene(
        robot="pendulum",
        medium="air",
        words=("robot=pendulum", "+sensor@sensors.imu=imu"),
        first=("initial.joint_position=[1.0472]",),
        second=("initial.joint_position=[0.6]",),
        effects=(),
    ),
    Scene(
        robot="valve",
        medium="air",
        words=("robot=valve", "+sensor@sensors.imu=imu"),
        first=("initial.joint_velocity=[2.0]",),
        second=("initial.joint_velocity=[1.5]",),
        effects=(),
    ),
    Scene(
        robot="basket",
        medium="air",
        words=("robot=basket", "+sensor@sensors.imu=imu"),
        first=(),
        second=(),
        effects=(),
    ),
)
"""Every robot and animal in the media it lives in; the quick ones first."""
