"""Metadata of a simulated run: robot, environment, effects, sensors."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from dataclasses import MISSING
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from seals.config.plugin_lookup import plugin_name
from seals.control.plant import Layout
from seals.effects.binding import has_hook
from seals.effects.effect import EffectOptions, number_lists
from seals.environment.sampler import WaterColumn
from seals.frames import matrix_of, quaternion_of, quaternion_of_rpy
from seals.logs.channels import CHANNELS
from seals.logs.run_folder import ROBOT
from seals.plugin_options import options_of
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.robot.whole_body import place_on_base
from seals.run.equipment_metadata import held
from seals.run.hidden import hide
from seals.run.settings import RunSettings
from seals.schema import parameters_of, plain, vars_of
from seals.sensors.options import SensorOptions

NOISE_FIELDS = {
    "specific_force": "accelerometer_noise",
    "angular_velocity": "gyroscope_noise",
}
"""Field of a sensor that holds the noise density of a channel."""

RESOLVED = {"position": 1e-3, "orientation": 1e-3, "joint_position": 1e-3}
"""How well another integration of the same motion agrees with a truth of the log [m, rad, rad].

Chosen: errors of steps of some milliseconds over a second; the truth itself has no noise.
"""


def describe_run(
    settings: RunSettings,
    robot: RobotModel,
    layout: Layout | None,
    sources: Mapping[str, str],
    initial: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the metadata of a log.

    Args:
        settings: of the run.
        robot: as simulated.
        layout: of its drives; None without a controller: they stand still.
        sources: sensor of each channel, ``""`` for the truth.
        initial: truth of the first row by channel.
    """
    acting = {n: e for n, e in settings.effects.items() if not _elsewhere(e, settings.sensors)}
    effects = [_effect(name, effect) for name, effect in acting.items()]
    e = settings.environment
    column = WaterColumn.of_profiles(e.water_temperature, e.salinity, e.water_density)
    environment = {
        "gravity": [0.0, 0.0, -e.gravity],
        "water_level": e.water_level,
        "tank_bottom": e.tank_bottom,
        "ground_level": e.ground_level,
        "air_density": e.air_density,
        "water_density": float(column.density[0]),
        "wave": None if settings.wave is None else _entry("wave", settings.wave),
        "fluid": None if settings.fluid is None else settings.fluid.name,
        **_solids(settings),
    }
    hidden, more = hide(settings.hide, effects, environment.get("wave"))
    effects = [entry for entry in effects if entry["instance"] not in hidden]
    step = settings.time.step
    early = "s, commands act at the time of their row, those of a vehicle 0.5 ms later"
    late = "s, an accelerometer reads the mean over a step"
    commands = {"command_delay": {"sigma": 5e-4, "meaning": early}} if layout is not None else {}
    laws = {k: _entry("effect", e) for k, e in settings.effects.items() if k not in hidden}
    actuators = {k: _entry("actuator", a) for k, a in settings.actuators.items()}
    return {
        ROBOT: {**_placed(settings.robot), "effects": laws, "actuators": actuators},
        "environment": environment | more,
        "baseline": [
            *effects,
            *([] if layout is None else held(settings.actuators, robot, layout)),
        ],
        "sensors": _sensors(settings, robot, sources),
        "tolerance": {**commands, "sensor_delay": {"sigma": 0.5 * step, "meaning": late}},
        "known_exactly": [channel for channel, sensor in sources.items() if not sensor],
        "initial_state": [{"segment": 0, **initial, "sigma": {}}],
        "simulated": {"seed": settings.seed, "step": settings.time.step, "run": settings.name},
    }


def _placed(robot: RobotSettings) -> dict[str, Any]:
    """Return a robot as plain data whose files lie in one folder: the URDF may be elsewhere."""
    stated: dict[str, Any] = plain(robot)
    home, urdf = Path(robot.folder).resolve(), robot.urdf_path.resolve()
    folder = Path(os.path.commonpath([home, urdf.parent]))
    for hull in stated["hulls"].values():
        for shape in hull["shapes"]:
            if shape.get("file"):
                shape["file"] = (home.relative_to(folder) / shape["file"]).as_posix()
    return {**stated, "folder": str(folder), "urdf": urdf.relative_to(folder).as_posix()}


def _entry(kind: str, plugin: Any) -> dict[str, Any]:
    """Return the plug-in and what is not its default."""
    own = plain(plugin)
    for field in dataclasses.fields(plugin):
        factory = field.default_factory
        if own[field.name] == plain(field.default if factory is MISSING else factory()):
            del own[field.name]
    return {kind: plugin_name(kind, type(plugin)), **own}


def _solids(settings: RunSettings) -> dict[str, Any]:
    """Shore and obstacles, where there are any."""
    e, out = settings.environment, {}
    if e.shore.slope is not None:
        out["shore"] = vars_of(e.shore)
    if e.obstacles:
        out["obstacles"] = {
            name: {key: value for key, value in vars_of(o).items() if value is not None}
            | {"type": o.type.value}
            for name, o in e.obstacles.items()
        }
    return out


def _elsewhere(effect: Any, sensors: Mapping[str, Any]) -> bool:
    """Return whether an effect is a fault of what a run does not record: other sensors, poses."""
    if has_hook(effect, "pose_turn"):
        return True
    named = [n for n in options_of(effect, EffectOptions).sensors if n in sensors]
    return bool(named) and not any("specific_force" in sensors[n].channels() for n in named)


def _effect(name: str, effect: Any) -> dict[str, Any]:
    options = options_of(effect, EffectOptions)
    kind = options.medium
    medium = "any" if kind is None else kind.value
    found = _plugin("effect", effect)
    words = {k: v for k, v in vars(effect).items() if isinstance(v, Enum) and k != "medium"}
    default = {f.name: f.default for f in dataclasses.fields(effect)}
    usual = {**default, **options.log_words}
    choices: dict[str, Any] = {k: v.value for k, v in words.items() if v is not usual[k]}
    choices |= {k: getattr(effect, k) for k in number_lists(effect) if getattr(effect, k)}
    if "parameters" in found:
        # sizes and places at their default say nothing
        known, values = parameters_of(effect), found["parameters"].items()
        kept = {k: v for k, v in values if known[k].fit or v != default.get(k)}
        found = {**found, "parameters": kept}
    return {
        "name": found["name"],
        "medium": medium,
        "instance": name,
        "links": list(effect.links),
        **found,
        **({"options": choices} if choices else {}),
    }


def _plugin(kind: str, plugin: Any) -> dict[str, Any]:
    values = {key: getattr(plugin, key) for key in parameters_of(plugin)}
    name = plugin_name(kind, type(plugin))
    return {"name": name, "parameters": values} if values else {"name": name}


def _noise(sensor: Any, channel: str) -> dict[str, float]:
    """White noise (standard deviation) of a channel and latency of its sensor, where stated."""
    density = getattr(sensor, NOISE_FIELDS.get(channel, ""), None)
    sigma = float(density) * math.sqrt(sensor.rate) if density else None
    stated: Mapping[str, float] = sensor.sigmas() if hasattr(sensor, "sigmas") else {}
    sigma = stated.get(channel, sigma) or RESOLVED.get(channel)
    late = float(options_of(sensor, SensorOptions).latency)
    out = {"sigma": sigma} if sigma else {}
    return {**out, "latency": late} if late else out


def _sensors(
    settings: RunSettings, robot: RobotModel, sources: Mapping[str, str]
) -> dict[str, Any]:
    """Mounting of the inertial sensor, noise and rate of every channel that a sensor read."""
    channels: dict[str, Any] = {}
    out: dict[str, Any] = {}
    for name, source in sources.items():
        if not source:
            if name in RESOLVED:
                rate = 1.0 / settings.time.step
                channels[name] = {
                    "rate": rate,
                    "sigma": RESOLVED[name],
                    "unit": CHANNELS[name].unit,
                }
            continue
        sensor = settings.sensors[source]
        # a sensor 'gps' reads the channel 'gps_position': the prefix is not always the sensor's
        own = name in sensor.channels()
        channel = name if own else name.removeprefix(f"{source}_")
        entry = {"rate": sensor.rate, "sensor": source}
        if channel in CHANNELS:
            entry["unit"] = CHANNELS[channel].unit
        entry |= _noise(sensor, channel)
        channels[name] = entry
        if channel == "specific_force" and "imu" not in out:
            out["imu"] = _mounting(sensor, robot)
    return {**out, "channels": channels}


def _mounting(sensor: Any, robot: RobotModel) -> dict[str, Any]:
    """Position [m] and axes (w, x, y, z) of an inertial sensor in its body."""
    options = options_of(sensor, SensorOptions)
    own = quaternion_of_rpy(np.asarray([options.rpy or (0.0, 0.0, 0.0)], dtype=float))
    place = np.asarray(options.position or (0.0, 0.0, 0.0), dtype=float)
    origin, turn = place_on_base(robot, sensor.link) or (np.zeros(3), np.eye(3))
    axes = quaternion_of(turn @ matrix_of(own)[0])
    return {"position": (origin + turn @ place).tolist(), "orientation": np.roll(axes, 1)}
