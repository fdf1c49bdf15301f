"""Random robots of a user's own in and on water."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.validation.hidden.plant import THICK
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import GRAVITY, WATER, Vehicle, six
from tests.validation.hidden.wild.robots import Rng, Robot, noise

BOTTOM = -8.0
CELLS = 2000.0  # about as many cells as a hull is cut into: smaller than a ripple is long


def part(kind: str, place: list[float], size: list[float], pitch: float = 0.0) -> dict[str, Any]:
    """A primitive of a hull."""
    return {
        "type": kind,
        "position": list(six(place)),
        "rpy": [0.0, six(pitch), 0.0],
        "size": list(six(size)),
    }


def wet(
    rng: Rng, mass: float, inertia: Array, *, drag: list[float], carried: list[float], damp: float
) -> dict[str, Any]:
    """Fields of a vehicle in water: drags, added mass, gusts.

    Args:
        rng: Random state.
        mass: Mass of the displaced water [kg].
        inertia: Inertia, (3,).
        drag: Quadratic drag of x, y, z.
        carried: Added mass over displaced mass of x, y, z.
        damp: Linear angular drag over inertia [1/s].
    """
    spin = inertia * damp * rng.uniform(0.85, 1.15)
    roll = inertia * rng.uniform(0.45, 0.7, 3)
    return {
        "water_quadratic": six(np.asarray(drag) * rng.uniform(0.85, 1.15, 3)),
        "angular_linear": six(spin),
        "angular_quadratic": six(spin * rng.uniform(0.8, 1.2, 3)),
        "added": six(np.concatenate((mass * np.asarray(carried) * rng.uniform(0.9, 1.1), roll))),
        "water": True,
        "bottom": BOTTOM,
    }


def rov(rng: Rng, family: str) -> Robot:
    """A submerged box with two tubes and six or eight thrusters."""
    n = int(family[-1])
    size = rng.uniform(0.95, 1.2) * np.array([0.45, 0.34, 0.125])
    radius = 0.45 * size[2]
    box = float(np.prod(size)) + 2.0 * np.pi * radius**2 * size[0]
    volume = six(box * rng.uniform(0.85, 1.0))
    mass = six(volume * WATER / rng.uniform(1.001, 1.009))
    inertia = mass * np.array([size[1] ** 2 + 0.05, size[0] ** 2 + 0.04, (size[:2] ** 2).sum()])
    inertia = six(inertia * rng.uniform(0.13, 0.16))
    x, y, z = 0.55 * size[0], 0.62 * size[1], rng.uniform(0.0, 0.03)
    c = np.sqrt(0.5)
    place = [[x, -y, 0], [x, y, 0], [-x, -y, 0], [-x, y, 0]]
    axis = [[c, c, 0], [c, -c, 0], [c, -c, 0], [c, c, 0]]
    if n == 8:
        place += [[0.6 * a, b, z] for a, b in ((x, -y), (x, y), (-x, -y), (-x, y))]
    else:
        place += [[0, -0.8 * y, z], [0, 0.8 * y, z]]
    axis += [[0, 0, 1]] * (n - 4)
    side, low, high = 0.42 * size[1], -rng.uniform(0.05, 0.08), rng.uniform(0.06, 0.09)
    gust = 0.006 * mass
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=inertia,
        centre=six([rng.uniform(-0.004, 0.004), 0.0, -rng.uniform(0.008, 0.025)]),
        imu=six([rng.uniform(-0.12, 0.12), rng.uniform(-0.05, 0.05), rng.uniform(0.0, 0.05)]),
        positions=six(np.array(place, dtype=float).T),
        axes=six(np.array(axis, dtype=float).T),
        directions=np.zeros(n),
        lag=six(rng.uniform(0.09, 0.15)),
        primitives=[
            part("box", [0, 0, high], list(size)),
            part("cylinder", [0, side, low], [radius, size[0]], np.pi / 2),
            part("cylinder", [0, -side, low], [radius, size[0]], np.pi / 2),
        ],
        volume=volume,
        centre_of_buoyancy=six([0.0, 0.0, rng.uniform(0.018, 0.035)]),
        plan_area=six(size[0] * size[1] * 1.2),
        gust_force=six(gust),
        gust_torque=six(0.13 * gust),
        **wet(
            rng,
            mass,
            inertia,
            drag=[60 * size[1] + 5, 120 * size[0], 190 * size[0]],
            carried=[0.34, 0.55, 0.8],
            damp=1.2,
        ),
    )
    vehicle.coarse = _coarse(volume, size[2])
    channels = noise(rng, slow=4, velocity=True)
    return Robot(family, f"ROV with {n} thrusters", vehicle, [], channels, box=size)


def torpedo(rng: Rng, family: str) -> Robot:
    """A long capsule with a tail propeller and four tunnel thrusters."""
    radius, length = rng.uniform(0.075, 0.1), rng.uniform(0.9, 1.3)
    volume = six(np.pi * radius**2 * length + 4.0 / 3.0 * np.pi * radius**3)
    mass = six(volume * WATER / rng.uniform(1.0, 1.006))
    long = mass * (length + 2 * radius) ** 2 / 12.0 * rng.uniform(0.85, 1.0)
    inertia = six([mass * radius**2 * 0.5, long, long])
    bow, stern = 0.38 * length, -0.36 * length
    place = [[-0.5 * length - radius, 0, 0], [bow, 0, 0], [stern, 0, 0]]
    place += [[bow + 0.06, 0, 0], [stern - 0.06, 0, 0]]
    axis = [[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]]
    gust = 0.005 * mass
    side = 500.0 * radius * length
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=inertia,
        centre=six([rng.uniform(-0.01, 0.01), 0.0, -rng.uniform(0.012, 0.025)]),
        imu=six([rng.uniform(-0.2, 0.2), 0.0, rng.uniform(0.0, 0.04)]),
        positions=six(np.array(place, dtype=float).T),
        axes=np.array(axis, dtype=float).T,
        directions=np.zeros(5),
        lag=six(rng.uniform(0.1, 0.14)),
        limit=45.0,
        primitives=[part("capsule", [0, 0, 0], [radius, length], np.pi / 2)],
        volume=volume,
        plan_area=six(2 * radius * length),
        driven=(0, 1, 2, 4),
        gust_force=six(gust),
        gust_torque=six(0.2 * gust),
        **wet(
            rng,
            mass,
            inertia,
            drag=[45 * radius, side, side],
            carried=[0.06, 0.85, 0.85],
            damp=1.3,
        ),
    )
    vehicle.angular_linear[0] = six(2.2 * inertia[0])
    vehicle.coarse = _coarse(volume, 2 * radius) * 2.0
    channels = noise(rng, slow=3, velocity=True)
    box = np.array([length, 2 * radius, 2 * radius])
    return Robot(family, "Torpedo with tunnel thrusters", vehicle, [], channels, box=box)


def boat(rng: Rng, family: str) -> Robot:
    """A box that floats, two stern thrusters and a bow tunnel."""
    size = np.array([rng.uniform(0.8, 1.2), rng.uniform(0.36, 0.5), rng.uniform(0.2, 0.27)])
    volume = six(np.prod(size))
    share = rng.uniform(0.4, 0.55)
    mass = six(share * volume * WATER)
    inertia = mass / 12.0 * np.array([size[1] ** 2, size[0] ** 2, size[0] ** 2 + size[1] ** 2])
    inertia = six(inertia * rng.uniform(0.9, 1.1) + mass * size[2] ** 2 / 20.0)
    low = -0.35 * size[2]
    x, y = 0.45 * size[0], 0.32 * size[1]
    gust = 0.006 * mass
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=inertia,
        centre=six([rng.uniform(-0.02, 0.02), 0.0, -rng.uniform(0.03, 0.05)]),
        imu=six([rng.uniform(-0.2, 0.2), rng.uniform(-0.05, 0.05), 0.3 * size[2]]),
        positions=six(np.array([[-x, y, low], [-x, -y, low], [x, 0, low]]).T),
        axes=np.array([[1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]]).T,
        directions=np.zeros(3),
        lag=six(rng.uniform(0.1, 0.15)),
        primitives=[part("box", [0, 0, 0], list(size))],
        volume=volume,
        plan_area=six(size[0] * size[1]),
        driven=(0, 1, 4),
        gust_force=six(gust),
        gust_torque=six(0.1 * gust),
        **wet(
            rng,
            volume * WATER,
            inertia,
            drag=[90 * size[1], 260 * size[0], 300 * size[0]],
            carried=[0.1, 0.4, 0.7],
            damp=1.2,
        ),
    )
    vehicle.coarse = _coarse(volume, size[2])
    channels = noise(rng, slow=5)
    waves = _waves(rng) if rng.random() < 0.6 else None
    return Robot(family, "Boat with bow tunnel", vehicle, [], channels, waves, box=size)


def drifter(rng: Rng, family: str) -> Robot:
    """A moored buoy, a spar or a box that floats: no actuators."""
    sizes = {
        "buoy": [rng.uniform(0.22, 0.3), rng.uniform(0.36, 0.5)],
        "spar": [rng.uniform(0.07, 0.1), rng.uniform(0.9, 1.3)],
        "float": [rng.uniform(0.4, 0.55), rng.uniform(0.28, 0.36), rng.uniform(0.2, 0.27)],
    }
    size = sizes[family]
    kind = "box" if family == "float" else "cylinder"
    if kind == "box":
        volume, wide, tall = float(np.prod(size)), size[:2], size[2]
        thick = [size[1] ** 2 / 12.0, size[0] ** 2 / 12.0]
    else:
        volume, wide, tall = np.pi * size[0] ** 2 * size[1], [2 * size[0]] * 2, size[1]
        thick = [size[0] ** 2 / 4.0] * 2
    share = rng.uniform(0.7, 0.8) if family == "spar" else rng.uniform(0.45, 0.55)
    mass = six(share * volume * WATER)
    inertia = six(
        mass * np.array([thick[0] + tall**2 / 12, thick[1] + tall**2 / 12, sum(thick)]) * 1.1
    )
    # the centre of gravity: low enough to float upright
    below = 0.25 * tall if family == "spar" else 0.16 * tall
    gust = 0.004 * mass
    mooring = None
    if family == "buoy":
        depth, pull = rng.uniform(4.0, 6.0), mass * GRAVITY * rng.uniform(0.08, 0.13)
        stiff, rise = rng.uniform(200.0, 320.0), (0.5 - share) * tall
        # the pull at rest comes from the stretch that is left when the buoy floats
        length = depth + rise - pull / stiff
        mooring = {"anchor_x": 0.0, "anchor_y": 0.0, "anchor_z": -six(depth)}
        mooring |= {"length": six(length), "stiffness": six(stiff)}
    face = wide[1] * tall
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=inertia,
        centre=six([0.0, 0.0, -below * rng.uniform(0.9, 1.1)]),
        imu=six([*rng.uniform(-0.05, 0.05, 2), rng.uniform(0.2, 0.45) * tall]),
        primitives=[part(kind, [0, 0, 0], size)],
        volume=six(volume),
        plan_area=six(wide[0] * wide[1] * (1.0 if kind == "box" else np.pi / 4)),
        battery=False,
        mooring=mooring,
        gust_force=six(gust),
        gust_torque=six(0.05 * gust),
        **wet(
            rng,
            volume * WATER,
            inertia,
            drag=[550 * face, 560 * face * wide[0] / wide[1], 500 * wide[0] * wide[1]],
            carried=[0.5, 0.5, 0.55 if family != "spar" else 0.1],
            damp=1.1,
        ),
    )
    vehicle.coarse = _coarse(volume, tall)
    channels = noise(rng, slow=5)
    channels["orientation"] = (channels["orientation"][0], 5)
    waves = _waves(rng) if rng.random() < 0.6 else None
    text = {"buoy": "Moored buoy", "spar": "Spar that floats", "float": "Free float"}[family]
    return Robot(family, text, vehicle, [], channels, waves, box=np.array([*wide, tall]))


def projectile(rng: Rng, family: str) -> Robot:
    """A cylinder with a round nose that is dropped into water."""
    radius, length = rng.uniform(0.05, 0.07), rng.uniform(0.14, 0.2)
    volume = six(np.pi * radius**2 * length + 2.0 / 3.0 * np.pi * radius**3)
    mass = six(volume * WATER * rng.uniform(0.88, 1.05))
    across = mass * (length + radius) ** 2 / 12.0 * rng.uniform(0.9, 1.1)
    inertia = six([across, 1.02 * across, mass * radius**2 * 0.5])
    gust = 0.012 * mass
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=inertia,
        centre=six([0.0, 0.0, -rng.uniform(0.025, 0.04)]),
        primitives=[
            part("cylinder", [0, 0, 0], [radius, length]),
            part("sphere", [0, 0, -0.5 * length], [radius]),
        ],
        volume=volume,
        centre_of_buoyancy=np.array([0.0, 0.0, -0.01]),
        plan_area=six(np.pi * radius**2),
        battery=False,
        gust_force=six(gust),
        gust_torque=six(0.025 * gust),
        **wet(
            rng,
            volume * WATER,
            inertia,
            drag=[620 * radius * length, 640 * radius * length, 500 * radius**2],
            carried=[0.42, 0.42, 0.38],
            damp=5.0,
        ),
    )
    channels = noise(rng)
    if rng.random() < 0.5:
        channels = {k: channels[k] for k in ("angular_velocity", "specific_force")}
    box = np.array([2 * radius, 2 * radius, length])
    return Robot(family, "Projectile dropped into water", vehicle, [], channels, box=box)


def _waves(rng: Rng) -> dict[str, float]:
    return {
        "amplitude": six(rng.uniform(0.02, 0.045)),
        "period": six(rng.uniform(1.6, 2.6)),
        "direction": six(rng.uniform(0.0, 6.28)),
    }


def _coarse(volume: float, tall: float) -> float:
    # cells of 30 x 30 x 12 mm times the cube of this, a whole number of them in the height: the
    # layer over which a cell fills is then as thick as the cells lie apart
    wished = max(1.0, float((volume / (0.03 * 0.03 * THICK * CELLS)) ** (1.0 / 3.0)))
    layers = np.ceil(tall / (THICK * wished))
    return float(tall / layers / THICK * (1.0 + 2e-5))


def afloat(vehicle: Vehicle) -> float:
    """Height of the origin of a box or an upright cylinder that floats, without its mooring [m]."""
    size = vehicle.primitives[0]["size"]
    tall = size[2] if vehicle.primitives[0]["type"] == "box" else size[1]
    return float((0.5 - vehicle.mass / (WATER * vehicle.volume)) * tall)
