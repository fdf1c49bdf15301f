"""Forces and torques on the body, each from the motion alone; body axes, about the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array, cross, to_body

HUB_BAND = 0.06


@dataclass
class Motion:
    """State of motion that the force laws read; batch last."""

    place: Array
    turn: Array
    velocity: Array
    spin: Array
    world_velocity: Array
    through_air: Array
    through_water: Array
    wet: Array
    filling: Array
    centroid: Array


def power_law(gain: Array, v: Array, power: Array, speed: Array) -> Array:
    """Drag -gain |v|^(power-1) v, equal to the square law at the given speed."""
    size = np.abs(v) + 1e-9
    return -gain * speed ** (2.0 - power) * size ** (power - 1.0) * v


def baseline_air(plant: Plant, m: Motion) -> Array:
    """Drag of the dry share of the body."""
    dry = 1.0 - m.wet
    out = -plant["air_linear"] * m.through_air
    if plant["air_quadratic"].any():
        out = out + power_law(
            plant["air_quadratic"], m.through_air, plant["air_power"], plant["speed"]
        )
    return dry * out


def baseline_water(plant: Plant, m: Motion) -> Array:
    """Drag of the wet share, a power slightly off the square."""
    v = m.through_water
    wet = m.wet ** plant["wet_power"]
    return wet * power_law(plant["water_quadratic"], v, plant["water_power"], plant["speed"])


def angular(plant: Plant, m: Motion) -> Array:
    """Torque against the spin, with the medium's share where it is the water's."""
    weight = np.where(plant["spin_in_water"] > 0.5, m.wet, 1.0)
    out = -plant["angular_linear"] * m.spin
    if plant["hidden_spin"].any():
        size = (np.abs(m.spin) + 1e-9) / plant["spin_speed"]
        out = out - plant["hidden_spin"] * size ** (plant["hidden_first"] - 1.0) * m.spin
    if plant["angular_quadratic"].any():
        out = out + power_law(
            plant["angular_quadratic"], m.spin, plant["spin_power"], plant["spin_speed"]
        )
    return weight * out


def spread_drag(plant: Plant, m: Motion) -> tuple[Array, Array]:
    """Hidden drag shared by stations along x: force and the torque it brings."""
    in_water = plant["hidden_in_water"] > 0.5
    weight = np.where(in_water, m.wet, 1.0 - m.wet)
    v = np.where(in_water, m.through_water, m.through_air)
    x = plant["hidden_span"]
    local = np.empty((3, *x.shape))
    local[0] = v[0]
    local[1] = v[1] + m.spin[2] * x
    local[2] = v[2] - m.spin[1] * x
    size = np.abs(local) + 1e-9
    speed = plant["speed"][:, None]
    first, second = plant["hidden_first"], plant["hidden_power"]
    line = plant["hidden_linear"][:, None] * (size / speed) ** (first - 1.0)
    force = -line * local
    if plant["hidden_quadratic"].any():
        force -= (
            plant["hidden_quadratic"][:, None] * speed * (size / speed) ** (second - 1.0) * local
        )
    force *= weight / x.shape[0]
    torque = np.stack((np.zeros_like(v[0]), -(x * force[2]).sum(0), (x * force[1]).sum(0)))
    return force.sum(1), torque


def slamming(plant: Plant, m: Motion) -> tuple[Array, Array]:
    """Upward entry force while the hull fills: the true one, skewed, and the textbook's."""
    sink = -m.world_velocity[2]
    active = (m.filling > 0.0) & (sink > 0.0)
    push = 0.5 * plant["density"] * plant["slam"] * plant["slam_area"] * sink**2 * active
    p = plant["slam_shape"]
    level = (p + 1.0) * (p + 2.0) / 6.0
    dry = 4.0 * (1.0 - m.wet)
    return push * level * dry * m.wet**p, push * dry * m.wet


def tether(plant: Plant, m: Motion) -> Array:
    """Cable that pulls when taut and hardens a little with its strain."""
    away = m.place - plant["tether_anchor"]
    length = np.maximum(np.sqrt((away**2).sum(0)), 1e-6)
    slack = np.maximum(length - plant["tether_length"], 0.0)
    pull = plant["tether_gain"] * slack * (1.0 + plant["tether_hardening"] * slack)
    return to_body(m.turn, -pull * away / length)


def sag_factor(plant: Plant, voltage: Array) -> Array:
    """Thrust factor of a tired battery: one minus gain times a power of the shortfall."""
    short = np.maximum(1.0 - voltage / plant["full_voltage"], 0.0)
    typical = 0.1
    return 1.0 - plant["sag"] * short * (short / typical + 1e-9) ** (plant["sag_power"] - 1.0)


def ground_ratio(plant: Plant, m: Motion, level: float) -> Array:
    """Radius over four heights of each rotor, (na, n)."""
    hub = m.place[2] + (m.turn[2][:, None] * plant["act_place"]).sum(0) - level
    return plant["rotor_radius"] / (4.0 * np.maximum(hub, 0.02))


def ground_factor(plant: Plant, m: Motion, level: float) -> Array:
    """Thrust factor of each rotor (na, n) near the ground; the power of R/4h is not quite two."""
    ratio = ground_ratio(plant, m, level)
    gain = plant["ground_gain"] * 0.1 ** (2.0 - plant["ground_power"])
    return 1.0 / (1.0 - np.minimum(gain * ratio ** plant["ground_power"], 0.6))


def water_factor(plant: Plant, m: Motion, level: float) -> Array:
    """Thrust factor of each rotor (na, n), from air to water by an s-curve over the band."""
    hub = m.place[2] + (m.turn[2][:, None] * plant["act_place"]).sum(0) - level
    share = np.clip(0.5 - hub / HUB_BAND, 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    return 1.0 + (plant["water_ratio"] - 1.0) * share


def rotor_drag(plant: Plant, m: Motion, thrust: Array) -> tuple[Array, Array]:
    """In-plane force of each rotor against its hub's motion: total force and torque."""
    arm = plant["act_place"]
    spin = m.spin[:, None]
    hub_x = m.through_air[0] + spin[1] * arm[2] - spin[2] * arm[1]
    hub_y = m.through_air[1] + spin[2] * arm[0] - spin[0] * arm[2]
    normal = plant["hover_thrust"]
    size = (
        plant["rotor_drag"]
        * normal
        * (np.maximum(thrust, 0.0) / normal) ** plant["rotor_drag_power"]
    )
    fx, fy = -size * hub_x, -size * hub_y
    force = np.stack((fx.sum(0), fy.sum(0), np.zeros_like(m.wet)))
    torque = np.stack(
        (
            -(arm[2] * fy).sum(0),
            (arm[2] * fx).sum(0),
            (arm[0] * fy - arm[1] * fx).sum(0),
        )
    )
    return force, torque


def lift(plant: Plant, m: Motion) -> tuple[Array, Array]:
    """Buoyancy at the centroid of the wet cells: force and torque."""
    up = m.turn[2] * plant["density"] * plant["gravity"] * plant["volume"] * m.wet
    return up, cross(m.centroid, up)
