"""True parameters of one case, drawn about the nominal vehicle, and their stacking into arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.validation.hidden.hull import cells
from tests.validation.hidden.outsiders import absent
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import GRAVITY, WATER, Vehicle

Plant = dict[str, Array]
FULL_VOLTAGE = 16.4
THICK = 0.012  # height over which a cell of a hull fills [m]

TOLERANCE = {
    "mass": (0.005, "relative"),
    "inertia": (0.03, "relative, each axis"),
    "thrust_coefficient": (0.006, "relative, common to all actuators"),
    "thrust_coefficient_each": (0.004, "relative, each actuator"),
    "torque_coefficient": (0.05, "relative"),
    "rotor_time_constant": (0.002, "s"),
    "thruster_time_constant": (0.006, "s"),
    "centre_of_gravity": (0.0006, "m, each axis"),
    "displaced_volume": (0.005, "relative"),
    "centre_of_buoyancy": (0.001, "m, each axis"),
    "drag_coefficient": (
        0.08,
        "relative, each axis and each coefficient (linear and quadratic) by itself",
    ),
    "angular_drag_coefficient": (
        0.15,
        "relative, each axis and each coefficient (linear and quadratic) by itself",
    ),
    "added_mass": (0.08, "relative, each axis"),
    "command_delay": (0.0005, "s"),
    "water_thrust_ratio": (0.02, "absolute"),
    "joint_friction": (0.01, "N m, coulomb, each joint"),
    "accelerometer_bias": (0.03, "m/s^2, each axis"),
    "accelerometer_scale": (0.003, "relative, each axis"),
    "gyroscope_bias": (0.003, "rad/s, each axis"),
    "sensor_misalignment": (0.003, "rad, each axis"),
    "sensor_delay": (0.0005, "s"),
    "link_mass": (0.01, "relative, each link and the gripper"),
    "joint_kp": (0.01, "relative"),
    "joint_kd": (0.03, "relative"),
    "tether_stiffness": (0.04, "relative"),
    "tether_length": (0.008, "m"),
}


def stated(vehicle: Vehicle) -> list[str]:
    """Names of the tolerances that apply to a vehicle, in the order of the description."""
    off: set[str] = set()
    if not vehicle.count:
        off |= {"thrust_coefficient", "thrust_coefficient_each", "command_delay"}
    if not vehicle.rotor:
        off |= {"torque_coefficient", "rotor_time_constant"}
    if vehicle.rotor or not vehicle.count:
        off.add("thruster_time_constant")
    if vehicle.mooring is None:
        off |= {"tether_stiffness", "tether_length"}
    if not vehicle.water:
        off |= {"displaced_volume", "centre_of_buoyancy", "added_mass"}
    if vehicle.kind != "crossing":
        off.add("water_thrust_ratio")
    if vehicle.arm is None:
        off |= {"joint_friction", "link_mass", "joint_kp", "joint_kd"}
    return [name for name in TOLERANCE if name not in off]


class Deviations:
    """Draws of the tolerances: gaussians cut at 2.5 sigma."""

    def __init__(self, rng: np.random.Generator, *, exact: bool = False) -> None:
        self._rng = rng
        self._exact = exact

    def __call__(self, name: str, *shape: int) -> Array:
        """Deviations in the unit of the named tolerance."""
        drawn = np.clip(self._rng.standard_normal(shape), -2.5, 2.5)
        return np.zeros(shape) if self._exact else TOLERANCE[name][0] * drawn


def draw(vehicle: Vehicle, rng: np.random.Generator, *, exact: bool = False) -> Plant:
    """True parameters within the tolerances, nothing hidden; keys name physical quantities."""
    off = Deviations(rng, exact=exact)
    plant: Plant = {}
    _body(plant, vehicle, off)
    if vehicle.arm is not None:
        vehicle.arm.truth(plant, off, rng)
    _actuators(plant, vehicle, off, rng, exact)
    _media(plant, vehicle, off, rng, exact)
    _hull(plant, vehicle, off, rng, exact)
    _disturbance(plant, vehicle, rng, exact)
    plant.update(absent(vehicle.count))
    plant["imu_bias"] = off("accelerometer_bias", 3)
    plant["imu_scale"] = off("accelerometer_scale", 3)
    plant["gyro_bias"] = off("gyroscope_bias", 3)
    plant["imu_turn"] = off("sensor_misalignment", 3)
    plant["imu_delay"] = np.abs(off("sensor_delay"))
    return plant


def _body(plant: Plant, vehicle: Vehicle, off: Deviations) -> None:
    plant["mass"] = vehicle.mass * (1.0 + off("mass"))
    plant["com"] = vehicle.centre + off("centre_of_gravity", 3)
    plant["products"], plant["imu_place"] = vehicle.products, vehicle.imu
    plant["inertia"] = vehicle.inertia * (1.0 + off("inertia", 3))
    plant["payload_mass"] = np.zeros(())
    plant["payload_place"] = np.zeros(3)
    plant["gravity"] = np.array(GRAVITY)


def _actuators(
    plant: Plant, vehicle: Vehicle, off: Deviations, rng: np.random.Generator, exact: bool
) -> None:
    n = vehicle.count
    plant["act_place"], plant["act_axis"] = vehicle.positions, vehicle.axes
    plant["act_gain"] = vehicle.thrust * (1.0 + off("thrust_coefficient_each", n))
    plant["act_common"] = 1.0 + off("thrust_coefficient")
    plant["act_torque"] = vehicle.torque * vehicle.directions * (1.0 + off("torque_coefficient"))
    lag = vehicle.lag + off("rotor_time_constant" if vehicle.rotor else "thruster_time_constant")
    lean = 0.0 if exact else rng.uniform(0.0, 0.015)
    plant["lag_up"], plant["lag_down"] = lag * (1.0 - lean), lag * (1.0 + lean)
    plant["act_delay"] = np.abs(off("command_delay"))
    plant["act_weak"] = np.ones(n)
    plant["full_voltage"] = np.array(FULL_VOLTAGE)
    plant["discharge"] = np.array(rng.uniform(0.11, 0.16))
    plant["resistance"] = np.array(rng.uniform(0.15, 0.35))
    plant["sag"], plant["sag_power"] = np.zeros(()), np.array(rng.uniform(0.9, 1.1))
    plant["ground_gain"], plant["ground_power"] = np.zeros(()), np.array(rng.uniform(1.9, 2.1))
    plant["rotor_radius"] = np.array(vehicle.radius)
    plant["rotor_drag"], plant["rotor_drag_power"] = np.zeros(()), np.array(rng.uniform(0.8, 1.0))
    plant["hover_thrust"] = np.array(vehicle.mass * GRAVITY / max(n, 1))
    ratio = vehicle.water_ratio + off("water_thrust_ratio")
    plant["water_ratio"] = ratio if vehicle.kind == "crossing" else np.ones(())


def _media(
    plant: Plant, vehicle: Vehicle, off: Deviations, rng: np.random.Generator, exact: bool
) -> None:
    power = 0.0 if exact else 0.05
    for name in ("air_linear", "air_quadratic", "water_quadratic"):
        plant[name] = getattr(vehicle, name) * (1.0 + off("drag_coefficient", 3))
    for name in ("angular_linear", "angular_quadratic"):
        plant[name] = getattr(vehicle, name) * (1.0 + off("angular_drag_coefficient", 3))
    for name in ("air_power", "water_power", "spin_power"):
        plant[name] = 2.0 + power * np.clip(rng.standard_normal(), -2.0, 2.0)
    plant["speed"] = np.full(3, 1.0)
    plant["spin_speed"] = np.array(0.5)
    plant["spin_in_water"] = np.array(float(vehicle.water))
    plant["added"] = vehicle.added * (1.0 + off("added_mass", 6))
    for name in ("wind", "current"):
        plant[name] = np.zeros(3)
    for name in ("hidden_linear", "hidden_quadratic", "hidden_spin"):
        plant[name] = np.zeros(3)
    plant["hidden_power"] = np.array(rng.uniform(1.92, 2.08))
    plant["hidden_first"] = np.array(rng.uniform(0.96, 1.04))
    plant["hidden_in_water"] = np.array(float(vehicle.water))
    reach = 0.12 if vehicle.kind == "auv" else 0.08
    plant["hidden_span"] = reach * np.linspace(-1.0, 1.0, 5)
    plant["wave"] = np.array([0.0, 1.0, 0.0, rng.uniform(0.0, 6.28), rng.uniform(0.0, 0.1)])
    plant["tether_anchor"], plant["tether_length"] = np.zeros(3), np.array(1.0)
    plant["tether_gain"], plant["tether_hardening"] = np.zeros(()), np.array(rng.uniform(0.0, 0.25))
    if vehicle.mooring is not None:
        _moor(plant, vehicle.mooring, off)
    plant["slam"], plant["slam_shape"] = np.zeros(()), np.array(rng.uniform(0.85, 1.15))
    plant["slam_area"] = np.array(vehicle.plan_area)


def _moor(plant: Plant, mooring: dict[str, float], off: Deviations) -> None:
    plant["tether_anchor"] = np.array([mooring[f"anchor_{a}"] for a in "xyz"])
    plant["tether_length"] = mooring["length"] + off("tether_length")
    plant["tether_gain"] = mooring["stiffness"] * (1.0 + off("tether_stiffness"))
    plant["tether_hardening"] = np.zeros(())


def _hull(
    plant: Plant, vehicle: Vehicle, off: Deviations, rng: np.random.Generator, exact: bool
) -> None:
    plant["density"] = np.array(WATER)
    plant["volume"] = vehicle.volume * (1.0 + off("displaced_volume"))
    if not vehicle.primitives:
        return
    place, share = cells(vehicle.primitives, coarse=vehicle.coarse)
    # the stated volume and centroid rule: scale and shift of the shape
    centre = vehicle.centre_of_buoyancy + off("centre_of_buoyancy", 3)
    plant["cob_shift"], plant["centroid_whole"] = centre - place @ share, centre
    plant["cell_place"], plant["cell_share"] = place, share
    plant["cell_thick"] = np.array(THICK * vehicle.coarse)
    plant["wet_power"] = np.array(1.0 if exact else rng.uniform(0.94, 1.06))


def _disturbance(plant: Plant, vehicle: Vehicle, rng: np.random.Generator, exact: bool) -> None:
    level = 0.0 if exact else 2.0 ** rng.uniform(-0.8, 0.8)
    plant["gust_force"] = np.array(vehicle.gust_force * level)
    plant["gust_torque"] = np.array(vehicle.gust_torque * level)
    plant["gust_time"] = np.array(0.35 * 2.0 ** rng.uniform(-0.8, 0.8))
    length = rng.uniform(0.05, 0.15, 3)
    heading = rng.uniform(0.0, 2.0 * np.pi, 3)
    k = 2.0 * np.pi / length
    height = 0.0 if exact or vehicle.kind == "auv" else rng.uniform(0.001, 0.002)
    # gravity waves with surface tension: 0.074 N/m
    omega = np.sqrt(GRAVITY * k + 0.074 / WATER * k**3)
    plant["ripple"] = np.stack(
        (
            np.full(3, height * np.sqrt(2.0 / 3.0)),
            k * np.cos(heading),
            k * np.sin(heading),
            omega,
            rng.uniform(0.0, 2.0 * np.pi, 3),
        )
    )


def stack(plants: list[Plant]) -> Plant:
    """One dictionary of arrays with the batch as the last axis; cell lists are padded."""
    out: Plant = {}
    for key in plants[0]:
        values = [p[key] for p in plants]
        if key in {"cell_place", "cell_share"}:
            longest = max(v.shape[-1] for v in values)
            values = [
                np.concatenate((v, np.zeros((*v.shape[:-1], longest - v.shape[-1]))), axis=-1)
                for v in values
            ]
        out[key] = np.stack([np.asarray(v, dtype=float) for v in values], axis=-1)
    return out


def take(plant: Plant, index: NDArray[np.intp]) -> Plant:
    """The same arrays for chosen members of the batch, in that order."""
    return {key: value[..., index] for key, value in plant.items()}
