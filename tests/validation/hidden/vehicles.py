"""Random nominal vehicles: the numbers that a log's description states."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.validation.hidden.rotation import Array

WATER = 998.0
GRAVITY = 9.81


def six(value: Any) -> Any:
    """Numbers cut to six significant digits, so that the description is exact."""
    array = np.asarray(value, dtype=float)
    cut = np.vectorize(lambda x: float(f"{x:.6g}"), otypes=[float])(array)
    return float(cut) if cut.ndim == 0 else cut


@dataclass
class Vehicle:
    """Nominal vehicle; batch-free arrays, lists of actuators along the last axis.

    The centre of gravity and the place of the IMU are in the body frame, the inertia is about the
    centre of gravity: diagonal, and products xy, xz, yz as the matrix holds them. `driven` lists
    what of x, y, z, roll and yaw the thrusters control.
    """

    kind: str
    mass: float
    inertia: Array
    centre: Array = field(default_factory=lambda: np.zeros(3))
    products: Array = field(default_factory=lambda: np.zeros(3))
    imu: Array = field(default_factory=lambda: np.zeros(3))
    positions: Array = field(default_factory=lambda: np.zeros((3, 0)))
    axes: Array = field(default_factory=lambda: np.zeros((3, 0)))
    directions: Array = field(default_factory=lambda: np.zeros(0))
    thrust: float = 1.0
    torque: float = 0.0
    lag: float = 0.05
    limit: float = 40.0
    radius: float = 0.1
    primitives: list[dict[str, Any]] = field(default_factory=list)
    volume: float = 0.0
    centre_of_buoyancy: Array = field(default_factory=lambda: np.zeros(3))
    plan_area: float = 0.0
    coarse: float = 1.0
    air_linear: Array = field(default_factory=lambda: np.zeros(3))
    air_quadratic: Array = field(default_factory=lambda: np.zeros(3))
    water_quadratic: Array = field(default_factory=lambda: np.zeros(3))
    angular_linear: Array = field(default_factory=lambda: np.zeros(3))
    angular_quadratic: Array = field(default_factory=lambda: np.zeros(3))
    added: Array = field(default_factory=lambda: np.zeros(6))
    water_ratio: float = 1.0
    ground: float | None = None
    water: bool = False
    bottom: float | None = None
    battery: bool = True
    gust_force: float = 0.0
    gust_torque: float = 0.0
    arm: Any = None
    driven: tuple[int, ...] = (0, 1, 2, 3, 4)
    mooring: dict[str, float] | None = None

    @property
    def rotor(self) -> bool:
        """Whether the actuators are rotors, whose command is a speed."""
        return self.torque > 0.0

    @property
    def count(self) -> int:
        """Number of actuators."""
        return int(self.positions.shape[1])


def _around(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def rotors(rng: np.random.Generator, mass: float, arm: float, height: float) -> dict[str, Any]:
    """Fields of four rotors that hover at 440 to 615 rad/s."""
    hover = _around(rng, 440.0, 615.0)
    thrust = mass * GRAVITY / 4.0 / hover**2
    return {
        "positions": six(
            np.array([[arm, -arm, arm, -arm], [-arm, arm, arm, -arm], [height] * 4], dtype=float)
        ),
        "axes": np.tile(np.array([[0.0], [0.0], [1.0]]), (1, 4)),
        "directions": np.array([1.0, 1.0, -1.0, -1.0]),
        "thrust": six(thrust),
        "torque": six(thrust * _around(rng, 0.012, 0.02)),
        "lag": six(_around(rng, 0.03, 0.05)),
        "limit": six(1.75 * hover),
        "radius": six(_around(rng, 0.1, 0.13)),
    }


def air(rng: np.random.Generator) -> dict[str, Any]:
    """Fields of the drag in air."""
    x = _around(rng, 0.2, 0.4)
    out: dict[str, Any] = {
        "air_linear": six([x, x * _around(rng, 0.93, 1.07), _around(rng, 0.2, 0.4)])
    }
    if rng.random() < 0.4:
        x = _around(rng, 0.025, 0.045)
        out["air_quadratic"] = six([x, x * _around(rng, 0.8, 1.2), _around(rng, 0.045, 0.08)])
    return out


def quad(rng: np.random.Generator) -> Vehicle:
    """A quadrotor of 1.2 to 2.2 kg in air."""
    mass, arm = six(_around(rng, 1.2, 2.2)), _around(rng, 0.12, 0.175)
    xx = mass * arm**2 * _around(rng, 0.33, 0.45)
    yy = xx * _around(rng, 0.97, 1.15)
    spin = six([_around(rng, 0.0007, 0.004)] * 3) if rng.random() < 0.6 else np.zeros(3)
    return Vehicle(
        kind="quad",
        mass=mass,
        inertia=six([xx, yy, (xx + yy) * _around(rng, 0.75, 0.95)]),
        angular_linear=spin,
        ground=0.0,
        gust_force=six(0.018 * mass),
        gust_torque=six(0.0002 * mass),
        **rotors(rng, mass, arm, _around(rng, 0.0, 0.04)),
        **air(rng),
    )


def crossing(rng: np.random.Generator) -> Vehicle:
    """A quadrotor with a hull that dips into water and comes out."""
    mass, arm = six(_around(rng, 1.5, 2.2)), _around(rng, 0.12, 0.135)
    xx = mass * arm**2 * _around(rng, 0.32, 0.42)
    yy = xx * _around(rng, 1.0, 1.1)
    lift = rotors(rng, mass, arm, _around(rng, 0.0, 0.04))
    inertia = six([xx, yy, (xx + yy) * _around(rng, 0.78, 0.92)])
    spin, turn = _around(rng, 0.05, 0.07), _around(rng, 0.05, 0.07)
    boom = arm * 2.0 * np.sqrt(2.0) * _around(rng, 0.98, 1.02)
    x = _around(rng, 0.22, 0.28)
    volume = mass / WATER * _around(rng, 0.58, 0.72)
    drop = _around(rng, -0.01, 0.002)
    carried = WATER * volume * _around(rng, 0.33, 0.46) * np.array([1.0, 1.125, 2.0])
    turned = _around(rng, 0.37, 0.42) * inertia * np.array([1.0, 1.0, 0.63])
    return Vehicle(
        kind="crossing",
        mass=mass,
        inertia=inertia,
        primitives=[
            _part("box", [0, 0, 0], [0, 0, 0], [0.2, 0.14, 0.09]),
            _part("capsule", [0, 0, drop], [0, np.pi / 2, np.pi / 4], [0.016, six(boom)]),
            _part("capsule", [0, 0, drop], [0, np.pi / 2, -np.pi / 4], [0.016, six(boom)]),
            _part("cylinder", [0, 0, -0.06], [0, 0, 0], [0.05, 0.06]),
        ],
        volume=six(volume),
        centre_of_buoyancy=six([0.0, 0.0, _around(rng, 0.01, 0.02)]),
        plan_area=six(0.028 + 2 * 0.032 * boom * 0.98),
        air_linear=six([x, x * _around(rng, 0.9, 1.05), _around(rng, 0.2, 0.25)]),
        water_quadratic=six(
            [_around(rng, 7.5, 11.5), _around(rng, 9.0, 12.0), _around(rng, 14.5, 20.5)]
        ),
        angular_linear=six([spin, spin, spin / 1.2]),
        angular_quadratic=six([turn, turn, 0.8 * turn]),
        added=six(np.concatenate((carried, turned))),
        water_ratio=six(_around(rng, 0.75, 0.85)),
        water=True,
        bottom=-3.0,
        gust_force=six(0.02 * mass),
        gust_torque=six(0.0003 * mass),
        **lift,
    )


def _part(kind: str, position: list[float], rpy: list[float], size: list[float]) -> dict[str, Any]:
    return {"type": kind, "position": position, "rpy": rpy, "size": size}


def auv(rng: np.random.Generator) -> Vehicle:
    """A submerged vehicle with six thrusters, about 10 kg and neutrally buoyant."""
    mass = six(_around(rng, 9.7, 13.5))
    length, width = _around(rng, 0.36, 0.445), _around(rng, 0.181, 0.215)
    height = _around(rng, 0.11, 0.132)
    tube, side = length / 0.9, width / 2 * 7 / 6
    volume = mass / WATER * _around(rng, 1.0025, 1.009)
    inertia = six(mass * np.array([_around(rng, 0.011, 0.0165), _around(rng, 0.0168, 0.025), 0.0]))
    inertia[2] = six((inertia[0] + inertia[1]) * _around(rng, 0.68, 0.76))
    x, y = 0.5 * tube, _around(rng, 0.15, 0.18)
    rise, c45 = 0.8 * y, 0.707107
    spin, turn = _around(rng, 0.35, 0.52), _around(rng, 0.32, 0.52)
    share = mass * _around(rng, 0.33, 0.4)
    roll = inertia * np.array([_around(rng, 0.42, 0.56), _around(rng, 0.58, 0.78), 0.0])
    roll[2] = inertia[2] * _around(rng, 0.52, 0.69)
    tubes = [
        _part("cylinder", [0, s * side, -0.02], [0, np.pi / 2, 0], [0.05, six(tube)])
        for s in (1, -1)
    ]
    return Vehicle(
        kind="auv",
        coarse=2.0,
        mass=mass,
        inertia=inertia,
        positions=six([[x, x, -x, -x, 0, 0], [-y, y, -y, y, -rise, rise], [0.0] * 6]),
        axes=np.array([[c45] * 4 + [0, 0], [c45, -c45, -c45, c45, 0, 0], [0.0] * 4 + [1.0, 1.0]]),
        directions=np.zeros(6),
        lag=six(_around(rng, 0.087, 0.14)),
        primitives=[
            _part("box", [0, 0, 0.03], [0, 0, 0], list(six([length, width, height]))),
            *tubes,
        ],
        volume=six(volume),
        centre_of_buoyancy=six([0.0, 0.0, _around(rng, 0.047, 0.06)]),
        plan_area=six(length * width + 2 * 0.1 * tube * 0.7),
        water_quadratic=six(
            [_around(rng, 19.0, 29.0), _around(rng, 30.0, 43.0), _around(rng, 45.0, 64.0)]
        ),
        angular_linear=six([spin, 1.5 * spin, spin]),
        angular_quadratic=six([turn, 1.25 * turn, 1.5 * turn]),
        added=six(np.concatenate((share * np.array([1.0, 1.714, 2.429]), roll))),
        water=True,
        bottom=-6.0,
        gust_force=six(0.006 * mass),
        gust_torque=six(0.0008 * mass),
    )


def drop(rng: np.random.Generator, *, with_added_mass: bool = True) -> Vehicle:
    """A hull without actuators that falls into water and floats or sinks slowly."""
    mass = six(_around(rng, 0.95, 1.25))
    edge, tall = _around(rng, 0.14, 0.162), _around(rng, 0.06, 0.074)
    boom = _around(rng, 0.265, 0.34)
    xx = mass * _around(rng, 0.0055, 0.007)
    inertia = six([xx, 1.067 * xx, 1.667 * xx])
    spin, turn = _around(rng, 0.0095, 0.0155), _around(rng, 0.0125, 0.0195)
    x, share = _around(rng, 4.5, 7.0), mass * _around(rng, 0.24, 0.37)
    roll = inertia * np.array([0.48, 0.48, 0.2]) * _around(rng, 0.85, 1.1)
    added = np.concatenate((share * np.array([1.0, 1.0, 2.333]), roll))
    return Vehicle(
        kind="drop",
        mass=mass,
        inertia=inertia,
        primitives=[
            _part("box", [0, 0, 0], [0, 0, 0], list(six([edge, edge, tall]))),
            _part("box", [0, 0, 0.012], [0, 0, np.pi / 4], [six(boom), 0.025, 0.02]),
            _part("box", [0, 0, 0.012], [0, 0, -np.pi / 4], [six(boom), 0.025, 0.02]),
            _part("capsule", [0.02, 0, -tall / 2 - 0.035], [0, 0.25, 0], [0.018, 0.05]),
        ],
        volume=six(mass / WATER / _around(rng, 0.905, 1.04)),
        centre_of_buoyancy=six([0.0, 0.0, _around(rng, 0.009, 0.014)]),
        plan_area=six(edge**2 + 2 * 0.025 * (boom - edge)),
        water_quadratic=six([x, x * _around(rng, 0.8, 1.3), _around(rng, 12.0, 17.0)]),
        angular_linear=six([spin, spin, spin / 1.2]),
        angular_quadratic=six([turn, turn, turn / 1.5]),
        added=six(added) if with_added_mass else np.zeros(6),
        water=True,
        bottom=-3.0,
        battery=False,
        gust_force=six(0.012 * mass),
        gust_torque=six(0.0003 * mass),
    )
