"""Which effects may be missing on a vehicle, with tolerances and plausible sizes."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import Effect, MediumKind
from seals.registry import get
from seals.sysid.discrepancy import AddedMassCentre, DragExponent, SurfaceForce, WaveMoment
from seals.sysid.factors import Collector, Library
from seals.sysid.vehicle import Vehicle

_AXES = ("x", "y", "z")
_EXPONENT = 0.05
"""1-sigma of the exponents of drag laws."""
_SURFACE = 0.04
"""1-sigma of the hydrostatic force while the hull pierces the surface, as a share."""

_CENTRE = 0.03
"""1-sigma of the added mass's centre, as a share of the hull's size."""


def library_of(vehicle: Vehicle, *, speeds: Floats) -> Library:
    """Collect tolerances and candidates of a vehicle.

    Args:
        vehicle: nominal model.
        speeds: typical speeds along the body axes [m/s], shape (3,).
    """
    made = Collector(vehicle.effects)
    _rigid(made, vehicle)
    if len(vehicle.lag):
        _actuators(made, vehicle)
    media = [MediumKind.air] if vehicle.environment.water_level is None else [MediumKind.water]
    if vehicle.has_water and vehicle.commands == "rotor_speed_cmd":
        media = [MediumKind.water, MediumKind.air]
    for medium in media:
        _drag(made, vehicle, medium, speeds)
    if vehicle.has_water:
        _water(made, vehicle)
        _waves(made)
    if vehicle.servo:
        _arm(made, vehicle)
    _place(made, vehicle)
    _sensors(made, vehicle)
    return made.library()


def _effect(name: str, **options: Any) -> Effect:
    made: Effect = get("effect", name).load()(**options)
    return made


def _axes(stem: str, tolerance: Any, scale: Any) -> dict[str, tuple[float, float]]:
    sizes = np.broadcast_to(np.asarray(scale, dtype=float), 3)
    spread = np.broadcast_to(np.asarray(tolerance, dtype=float), 3)
    return {f"{stem}_{a}": (float(spread[i]), float(sizes[i])) for i, a in enumerate(_AXES)}


def _rigid(made: Collector, vehicle: Vehicle) -> None:
    tol, robot = vehicle.tolerance, vehicle.robot
    mass, centre = float(robot.mass[0]), robot.centre[0]
    at = {f"position_{a}": float(centre[i]) for i, a in enumerate(_AXES)}
    made.add("mass", _effect("payload", **at), {"mass": (tol.get("mass", 0.0) * mass, mass)})
    diagonal = np.diag(robot.inertia[0])
    sizes = {
        f"delta_{a}{a}": (tol.get("inertia", 0.0) * diagonal[i], 0.3 * diagonal[i])
        for i, a in enumerate(_AXES)
    }
    low = {n: (-0.8 * diagonal[i], np.inf) for i, n in enumerate(sizes)}
    made.candidate("inertia", made.add("inertia", _effect("inertia"), sizes, bounds=low))
    offset = _axes("offset", tol.get("centre_of_gravity", 0.0), 0.01)
    keys = made.add("centre_of_gravity", _effect("centre_of_gravity"), offset)
    made.candidate("centre_of_gravity", keys)
    # a load is added: what a robot lacks against its datasheet is an error of the mass
    bounds = {"mass": (0.0, 2.0 * vehicle.mass)}
    size = {"mass": (0.0, 0.1 * vehicle.mass)}
    for k, link in enumerate(robot.links):
        if k and k < len(robot.links) - 1:
            continue
        options: dict[str, Any] = {"links": [link]}
        free: dict[str, tuple[float, float]] = {}
        if k:
            # the gripper sits at the tip: the link's centre lies half way
            options["position_z"] = 2.0 * float(robot.centre[k][2])
            free = {"position_z": (0.0, 0.03)}
        else:
            free = {f"position_{a}": (0.0, 0.03) for a in _AXES}
        name = f"payload_{link}"
        keys = made.add(name, _effect("payload", **options), {**size, **free}, bounds=bounds)
        starts = [(s * vehicle.mass, 0.0) for s in (0.03, 0.06, 0.12)] if k else []
        made.candidate("payload", keys[:1], variant={"link": k}, free=keys[1:], starts=starts)


def _actuators(made: Collector, vehicle: Vehicle) -> None:
    tol = vehicle.tolerance
    rotors = vehicle.commands == "rotor_speed_cmd"
    common = (tol.get("thrust_coefficient", 0.0), 0.1)
    keys = made.add(
        "thrust_coefficient", _effect("thrust_coefficient"), {"relative_change": common}
    )
    made.candidate("thrust_coefficient", keys)
    for k in range(len(vehicle.lag)):
        each = (tol.get("thrust_coefficient_each", 0.0), 0.1)
        effect = _effect("weak_rotor", rotor=k + 1)
        keys = made.add(f"weak_rotor_{k + 1}", effect, {"relative_loss": each})
        made.candidate("weak_rotor", keys, variant={"rotor": k + 1})
    if rotors and tol.get("torque_coefficient"):
        made.add("rotors", None, {"torque_change": (tol["torque_coefficient"], 0.1)})
    lag = tol.get("rotor_time_constant", tol.get("thruster_time_constant", 0.0))
    low = {"time_constant_change": (-0.9 * float(vehicle.lag.min()), np.inf)}
    size = {"time_constant_change": (lag, float(vehicle.lag.mean()))}
    made.candidate("rotor_lag", made.add("rotor_lag", _effect("rotor_lag"), size, bounds=low))
    delay = {"delay": (tol.get("command_delay", 0.0), 0.02)}
    low = {"delay": (-1e-3, np.inf)}
    keys = made.add("command_delay", _effect("command_delay"), delay, bounds=low)
    made.candidate("command_delay", keys, starts=[(0.0,), (0.02,)])
    if vehicle.full_voltage:
        effect = _effect("battery_sag", full_voltage=float(vehicle.full_voltage))
        low = {"sensitivity": (0.0, np.inf)}
        keys = made.add("battery_sag", effect, {"sensitivity": (0.0, 1.0)}, bounds=low)
        made.candidate("battery_sag", keys)
    if not rotors:
        return
    low = {"coefficient": (0.0, np.inf)}
    size = {"coefficient": (0.0, 0.03)}
    keys = made.add("rotor_drag", _effect("rotor_drag"), size, bounds=low)
    made.candidate("rotor_drag", keys)
    if vehicle.environment.ground_level is not None:
        effect = _effect("ground_effect", ground_level=vehicle.environment.ground_level)
        keys = made.add("ground_effect", effect, {"coefficient": (0.0, 1.0)}, bounds=low)
        made.candidate("ground_effect", keys)
    if "thrust_in_water" in vehicle.effects:
        ratio = {"ratio_change": (tol.get("water_thrust_ratio", 0.0), 0.15)}
        made.candidate("thrust_in_water", made.add("thrust_in_water", None, ratio))


def _drag(made: Collector, vehicle: Vehicle, medium: MediumKind, speeds: Floats) -> None:
    """Drag of one medium: tolerances of the nominal one, changes, exponents, wind or current."""
    tol, kind = vehicle.tolerance, medium.value
    water = medium is MediumKind.water
    weight = vehicle.mass * vehicle.environment.gravity
    for name, power, size in (
        ("linear_drag", 1, (2.0 if water else 0.03) * weight),
        ("quadratic_drag", 2, (3.0 if water else 0.01) * weight),
    ):
        nominal = _numbers(vehicle, f"{name}_{kind}", "coefficient")
        scale = np.maximum(0.5 * nominal, 0.25 * size if power == 1 and water else 0.3 * size)
        drawn = tol.get("drag_coefficient", 0.0) * nominal
        bounds = {f"coefficient_{a}": (-float(nominal[i]), np.inf) for i, a in enumerate(_AXES)}
        effect = _effect(name, medium=medium)
        keys = made.add(
            f"{name}_{kind}_change", effect, _axes("coefficient", drawn, scale), bounds=bounds
        )
        made.candidate(name, keys, variant={"medium": int(water)})
        if nominal.any():
            shape = DragExponent(
                power=power, coefficients=tuple(nominal), speeds=tuple(speeds), medium=medium
            )
            made.add(f"{name}_{kind}_shape", shape, {"exponent": (_EXPONENT, 0.1)})
    nominal = _numbers(vehicle, f"angular_drag_{kind}", "coefficient")
    squared = _numbers(vehicle, f"angular_drag_{kind}", "quadratic")
    spread = tol.get("angular_drag_coefficient", 0.0)
    inertia = np.diag(vehicle.robot.inertia[0])
    table = _axes("coefficient", spread * nominal, np.maximum(0.5 * nominal, 2.0 * inertia))
    effect = _effect("angular_drag", medium=medium)
    instance = f"angular_drag_{kind}_change"
    low = {f"coefficient_{a}": (-float(nominal[i]), np.inf) for i, a in enumerate(_AXES)}
    keys = made.add(instance, effect, table, bounds=low)
    made.add(instance, None, _axes("quadratic", spread * squared, np.maximum(squared, inertia)))
    made.candidate("angular_drag", keys, variant={"medium": int(water)})
    flow = "current" if water else "wind"
    made.candidate(
        flow, made.add(flow, _effect(flow), _axes("velocity", 0.0, 0.3 if water else 2.0))
    )


def _numbers(vehicle: Vehicle, instance: str, stem: str) -> Floats:
    """Three parameters of a nominal effect, zeros without it."""
    effect = vehicle.effects.get(instance)
    return np.array([float(getattr(effect, f"{stem}_{a}", 0.0)) for a in _AXES])


def _water(made: Collector, vehicle: Vehicle) -> None:
    tol, hull = vehicle.tolerance, vehicle.hull
    assert hull is not None
    size = (tol.get("displaced_volume", 0.0) * hull.volume, 0.05 * hull.volume)
    keys = made.add("buoyancy", None, {"volume_change": size})
    made.candidate("buoyancy", keys, reported=("volume",))
    offset = _axes("offset", tol.get("centre_of_buoyancy", 0.0), 0.01)
    keys = made.add("centre_of_buoyancy", _effect("centre_of_buoyancy"), offset)
    made.candidate("centre_of_buoyancy", keys)
    mass = _numbers(vehicle, "added_mass_water", "mass")
    turn = _numbers(vehicle, "added_mass_water", "inertia")
    share = tol.get("added_mass", 0.0)
    displaced = 998.0 * hull.volume
    length = (hull.volume) ** (1.0 / 3.0)
    table = _axes("mass", share * mass, np.maximum(0.5 * mass, 0.3 * displaced))
    table |= _axes("inertia", share * turn, np.maximum(0.5 * turn, 0.03 * displaced * length**2))
    keys = made.add("added_mass_change", _effect("added_mass"), table)
    made.candidate("added_mass", keys)
    if mass.any():
        centre = AddedMassCentre(mass=tuple(mass))
        made.add("added_mass_centre", centre, _axes("offset", _CENTRE * length, 0.1 * length))
    made.add("surface", SurfaceForce(), {"share": (_SURFACE, 0.1)})
    low = {"coefficient": (0.0, np.inf)}
    keys = made.add("slamming_change", _effect("slamming"), {"coefficient": (0.0, 1.0)}, bounds=low)
    made.candidate("slamming", keys)


def _waves(made: Collector) -> None:
    """Waves belong to the water, not to the effects: they have a name but no instance."""
    table = {"amplitude": 0.03, "period": 1.0, "direction": 2.0, "phase": 2.0}
    bounds = {"period": (0.3, 20.0), "amplitude": (0.0, 2.0)}
    keys = made.add("waves", None, {k: (0.0, v) for k, v in table.items()}, bounds=bounds)
    made.effects["wave_moment"] = WaveMoment(correction=True)
    made.candidate("waves", keys)


_GREASE = 0.3
"""Viscous friction that goes with dry friction [s/rad]: a joint that rubs is a greased one."""
_CREEP = 0.015
"""How well the rate is known at which dry friction turns over [rad/s]."""


def _arm(made: Collector, vehicle: Vehicle) -> None:
    tol, robot = vehicle.tolerance, vehicle.robot
    kp, kd = vehicle.servo["kp"], vehicle.servo["kd"]
    if all(np.ptp(gain) == 0.0 for gain in (kp, kd)):
        # gains that differ from joint to joint are taken as stated
        loose = {"kp": (tol.get("joint_kp", 0.0), kp), "kd": (tol.get("joint_kd", 0.0), kd)}
        gains = {name: (share * float(g[0]), float(g[0])) for name, (share, g) in loose.items()}
        made.add("servos", None, gains)
    for k, link in enumerate(robot.links[1:], start=1):
        at = {f"position_{a}": float(robot.centre[k][i]) for i, a in enumerate(_AXES)}
        effect = _effect("payload", links=[link], **at)
        spread = tol.get("link_mass", 0.0) * float(robot.mass[k])
        made.add(f"mass_{link}", effect, {"mass": (spread, float(robot.mass[k]))})
        friction = _effect("joint_friction", joint=k)
        dry = tol.get("joint_friction", 0.0)
        table = {"coulomb": (dry, 0.05), "viscous": (_GREASE * dry, 0.05)}
        table["threshold"] = (_CREEP, _CREEP)
        low = {"coulomb": (0.0, np.inf), "viscous": (0.0, np.inf), "threshold": (-0.045, np.inf)}
        keys = made.add(f"joint_friction_{k}", friction, table, bounds=low)[:2]
        made.candidate("joint_friction", keys, variant={"joint": k})
        slack = _effect("joint_backlash", joint=k, kp=float(kp[k - 1]), kd=float(kd[k - 1]))
        keys = made.add(
            f"joint_backlash_{k}", slack, {"width": (0.0, 0.04)}, bounds={"width": (0.0, 1.0)}
        )
        made.candidate("joint_backlash", keys, variant={"joint": k}, starts=[(0.02,), (0.06,)])


def _place(made: Collector, vehicle: Vehicle) -> None:
    """The tether; its starting values come from the log."""
    table = _axes("anchor", 0.0, 1.0) | {"length": (0.0, 1.0), "stiffness": (0.0, 3.0)}
    bounds = {"length": (0.0, 1e3), "stiffness": (0.0, 1e4)}
    effect = _effect("tether", length=0.0)
    made.candidate("tether", made.add("tether", effect, table, bounds=bounds))


def _sensors(made: Collector, vehicle: Vehicle) -> None:
    tol = vehicle.tolerance
    for name, stem, key, scale in (
        ("accelerometer_bias", "bias", "accelerometer_bias", 0.3),
        ("accelerometer_scale", "scale", "accelerometer_scale", 0.05),
        ("gyroscope_bias", "bias", "gyroscope_bias", 0.05),
        ("sensor_misalignment", "rotation", "sensor_misalignment", 0.05),
    ):
        if name.startswith("accelerometer") and "specific_force" not in vehicle.sigma:
            continue
        keys = made.add(name, _effect(name), _axes(stem, tol.get(key, 0.0), scale))
        made.candidate(name, keys)
    delay = {"delay": (tol.get("sensor_delay", 0.0), 0.02)}
    keys = made.add("sensor_delay", _effect("sensor_delay"), delay)
    made.candidate("sensor_delay", keys, starts=[(0.008,), (0.02,), (0.035,)])
