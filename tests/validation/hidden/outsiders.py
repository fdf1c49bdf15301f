"""Forces that no catalogue holds: what must be answered with "none of these"."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.validation.hidden.rotation import Array, to_body

if TYPE_CHECKING:
    from tests.validation.hidden.forces import Motion
    from tests.validation.hidden.plant import Plant

CABLE = 900.0  # stiffness of a slung cable per kg of load [N/(m kg)]


def absent(actuators: int) -> Plant:
    """Parameters of every outsider, all of them off."""
    return {
        "magnet_gain": np.zeros(()),
        "magnet_place": np.zeros(3),
        "magnet_core": np.array(0.5),
        "sling_mass": np.zeros(()),
        "sling_length": np.array(0.5),
        "vortex_gain": np.zeros(()),
        "vortex_width": np.array(0.2),
        "cubic": np.zeros(()),
        "wheel": np.zeros(3),
        "hum": np.zeros(3),
        "hum_rate": np.array(10.0),
        "field": np.zeros(3),
        "field_edge": np.zeros(()),
        "stick_band": np.zeros(actuators),
        "sway_by_yaw": np.zeros(()),
        "paddle": np.zeros(()),
        "gyro_scale": np.zeros(3),
    }


def magnet(plant: Plant, m: Motion) -> Array:
    """Pull towards a place in the world, fading with the square of the distance; body axes."""
    away = plant["magnet_place"] - m.place
    soft = (away**2).sum(0) + plant["magnet_core"] ** 2
    return to_body(m.turn, plant["magnet_gain"] * away / soft**1.5)


def region(plant: Plant, m: Motion) -> Array:
    """Constant world force beyond a plane x = edge, with a soft border; body axes."""
    inside = 0.5 * (1.0 + np.tanh((m.place[0] - plant["field_edge"]) / 0.05))
    return to_body(m.turn, plant["field"] * inside)


def cubic(plant: Plant, m: Motion) -> Array:
    """Drag with the third power of the speed, along the motion."""
    v = _wetted(m)
    return -plant["cubic"] * (v**2).sum(0) * v


def sway_by_yaw(plant: Plant, m: Motion) -> Array:
    """Sideways force in proportion to the rate of yaw, in water."""
    side = plant["sway_by_yaw"] * m.wet * m.spin[2]
    return np.stack((np.zeros_like(side), side, np.zeros_like(side)))


def paddle(plant: Plant, m: Motion, swing: Array) -> Array:
    """Force ahead in proportion to the swing rate of the last link (n,), in water."""
    ahead = plant["paddle"] * m.wet * swing
    return np.stack((ahead, np.zeros_like(ahead), np.zeros_like(ahead)))


def vortices(plant: Plant, m: Motion, phase: Array) -> Array:
    """Side force that swings with the shedding phase, square in the speed along x."""
    v = _wetted(m)
    size = plant["vortex_gain"] * (v**2).sum(0) * np.sin(phase)
    fast = np.maximum(np.sqrt(v[0] ** 2 + v[1] ** 2), 1e-6)
    return np.stack((-size * v[1] / fast, size * v[0] / fast, 0.5 * size))


def shedding_rate(plant: Plant, m: Motion) -> Array:
    """Rate of the shedding phase: Strouhal number 0.2 [rad/s]."""
    speed = np.sqrt((_wetted(m) ** 2).sum(0))
    return 2.0 * np.pi * 0.2 * speed / plant["vortex_width"]


def wheel(plant: Plant, m: Motion) -> Array:
    """Torque of a fast wheel inside the body: minus spin x momentum."""
    h, w = plant["wheel"], m.spin
    return np.stack(
        (h[1] * w[2] - h[2] * w[1], h[2] * w[0] - h[0] * w[2], h[0] * w[1] - h[1] * w[0])
    )


def hum(plant: Plant, t: Array) -> Array:
    """Torque of an unbalanced rotating part at a fixed rate."""
    return plant["hum"] * np.sin(plant["hum_rate"] * t)


def sling(plant: Plant, m: Motion, load: Array, speed: Array) -> tuple[Array, Array]:
    """Cable force on the body (body axes) and acceleration of the slung load (world).

    Args:
        plant: Parameters.
        m: Motion of the body.
        load: Place of the load in the world, (3, n).
        speed: Its velocity, (3, n).
    """
    span = load - m.place
    length = np.maximum(np.sqrt((span**2).sum(0)), 1e-6)
    along = span / length
    slip = (along * (speed - m.world_velocity)).sum(0)
    stretch = length - plant["sling_length"]
    mass = plant["sling_mass"]
    pull = np.maximum(mass * (CABLE * stretch + 12.0 * slip), 0.0) * (stretch > 0.0)
    hung = mass > 0.0
    down = np.zeros_like(span)
    down[2] = -plant["gravity"] * (1.0 - 0.35 * m.wet)
    calm = 0.15 * speed
    accel = np.where(hung, down - calm - pull / np.where(hung, mass, 1.0) * along, 0.0)
    return to_body(m.turn, pull * along), accel


def _wetted(m: Motion) -> Array:
    """Velocity against the medium that matters, air or water."""
    return m.wet * m.through_water + (1.0 - m.wet) * m.through_air


def draw(name: str, kind: str, rng: np.random.Generator, plant: Plant) -> None:
    """Switch one outsider on in a plant, about as strong as a clear effect."""
    heavy = float(plant["mass"])
    sign = rng.choice([-1.0, 1.0])
    if name == "magnet":
        middle = np.array([0.0, 0.0, {"auv": -2.0, "crossing": -0.2, "drop": 0.0}.get(kind, 1.4)])
        plant["magnet_place"] = middle + rng.uniform(-0.7, 0.7, 3)
        plant["magnet_gain"] = np.array(heavy * 0.25 * rng.uniform(0.7, 1.3) * sign)
        plant["magnet_core"] = np.array(rng.uniform(0.3, 0.5))
    elif name == "slung_mass":
        plant["sling_mass"] = np.array(heavy * rng.uniform(0.04, 0.07))
        plant["sling_length"] = np.array(rng.uniform(0.35, 0.7))
    elif name == "cubic_drag":
        plant["cubic"] = np.array((0.09 if kind == "quad" else 45.0) * rng.uniform(0.8, 1.3))
    elif name == "periodic_torque":
        plant["hum"] = rng.uniform(0.8, 1.4, 3) * plant["inertia"] * sign
        plant["hum_rate"] = np.array(rng.uniform(8.0, 25.0))
    elif name == "force_region":
        heading = rng.uniform(0.0, 2.0 * np.pi)
        size = heavy * (0.35 if kind != "auv" else 0.12) * rng.uniform(0.8, 1.3)
        plant["field"] = size * np.array([np.cos(heading), np.sin(heading), 0.0])
        plant["field_edge"] = np.array(rng.uniform(-0.1, 0.15))
    elif name == "spinning_wheel":
        plant["wheel"] = rng.uniform(1.0, 2.5, 3) * plant["inertia"].mean() * sign
    elif name == "vortex_shedding":
        plant["vortex_gain"] = np.array(heavy * 0.55 * rng.uniform(0.8, 1.4))
        plant["vortex_width"] = np.array(rng.uniform(0.08, 0.2))
    elif name == "sticking_actuator":
        band = np.zeros(plant["act_place"].shape[1])
        size = 45.0 if kind != "auv" else 3.5
        band[rng.integers(band.shape[0])] = size * rng.uniform(0.8, 1.2)
        plant["stick_band"] = band
    elif name == "sway_by_yaw":
        plant["sway_by_yaw"] = np.array(heavy * 0.5 * rng.uniform(0.8, 1.2) * sign)
    elif name == "paddling_arm":
        plant["paddle"] = np.array(heavy * 0.6 * rng.uniform(0.8, 1.2) * sign)
    elif name == "gyroscope_scale":
        plant["gyro_scale"] = rng.uniform(0.06, 0.1, 3) * rng.choice([-1.0, 1.0], 3)
    else:
        raise KeyError(name)
