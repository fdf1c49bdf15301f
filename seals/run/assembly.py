"""Construction of a world or batch dynamics from the settings of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Array
from seals.backend import Configuration
from seals.batch import BatchDynamics, TwinState
from seals.config.plugin_lookup import plugin_name
from seals.control.estimate import check_sense
from seals.control.plant import build_plant
from seals.control.protocols import GuideOptions
from seals.effects.binding import EffectSet, bind_effects
from seals.errors import ConfigError, naming, suggestion
from seals.plugin_options import options_of
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.run.fleet import ROBOT as ROBOT  # noqa: PLC0414  offered beside `build_world`
from seals.run.fleet import fleet_of, key_of
from seals.run.hover_trim import carrying
from seals.run.immersed import (
    owners,
    plant_effects,
    refuse_fluid,
    resting_effects,
    sink,
    stated_drag,
    surroundings,
    without,
)
from seals.run.objects import add_objects, stated_configuration
from seals.run.settings import DriveStart, RunSettings
from seals.run.sight import open_cameras
from seals.world import Actor, World
from seals.world.pilot import Pilot
from seals.world.servos import check_gains


def build_model(settings: RunSettings) -> tuple[RobotModel, EffectSet]:
    """Build the robot and bind its effects and actuators.

    What a fluid accounts for rests, see `seals.run.immersed`.

    Raises:
        SealsError: one of them cannot be used, or an effect and an actuator share a name.
    """
    robot = build_robot(settings.robot)
    effects = without(acting(settings), resting_effects(settings))
    return robot, bind_effects(effects, robot.links, owners(settings.fluid))


def acting(settings: RunSettings) -> dict[str, Any]:
    """Return effects and actuators of a run by name.

    Raises:
        ConfigError: an effect and an actuator share a name.
    """
    effects, actuators = settings.effects, settings.actuators
    both = [name for name in actuators if effects.get(name, actuators[name]) is not actuators[name]]
    if both:
        raise ConfigError(
            f"'{both[0]}' is the name of an effect and of an actuator.\nGive one another name."
        )
    return {**effects, **actuators}


def build_world(settings: RunSettings, *, repeats: int = 1) -> World:
    """Build a world with the robots and the objects of a run in their initial configurations.

    Args:
        settings: of the run.
        repeats: times that the run is made, from a reset each.

    Raises:
        SealsError: a robot, an effect or an initial state cannot be used.
    """
    fleet, step = fleet_of(settings), settings.time.step
    models = {}
    for name, own in fleet.items():
        with naming(key_of(name)):
            models[name] = robot, effects = build_model(own)
            check_gains(robot, effects, step)
            _check_step(own, robot)
    steps = step_count(settings)
    settings.backend.open(surroundings(settings), step)
    actors, places = {}, {}
    for name, own in fleet.items():
        with naming(key_of(name)):
            actors[name] = _add_robot(own, *models[name], steps=steps, repeats=repeats)
            places[name] = start = initial_configuration(own, actors[name].robot)
            pilot = actors[name].pilot
            if pilot is not None and own.initial.drives is DriveStart.carrying:
                actors[name].drive_at_start = carrying(pilot.plant, start)
    objects = add_objects(settings, steps=steps, repeats=repeats)
    for name, thing in objects.items():
        stated = settings.objects[name]
        places[name] = stated_configuration(f"objects.{name}", stated, thing.robot)
    actors |= objects
    watch = open_cameras(settings, actors)
    sink(settings, list(actors.values()))
    world = World(
        settings.backend,
        actors,
        settings.environment,
        step=step,
        seed=settings.seed,
        seeds={name: (settings.seed, *name.encode()) for name in settings.robots},
        fluid=settings.fluid,
        watch=watch,
    )
    world.reset(places)
    return world


def _add_robot(
    settings: RunSettings, robot: RobotModel, effects: EffectSet, *, steps: int, repeats: int
) -> Actor:
    """Add a robot to the open scene, with guide and controller."""
    resting = {name: settings.effects[name] for name in resting_effects(settings)}
    actor = Actor(
        robot,
        effects,
        settings.sensors,
        settings.backend,
        settings.environment,
        waves=settings.wave,
        steps=steps,
        fluid=settings.fluid,
        repeats=repeats,
        stated=stated_drag(settings, resting, robot.links),
    )
    actor.pilot = _build_pilot(settings, actor)
    return actor


def _build_pilot(settings: RunSettings, actor: Actor) -> Pilot | None:
    """Build guide and controller of a run; None without a guide.

    Raises:
        SealsError: guide or controller cannot work with this robot, or its sensor is missing.
    """
    if settings.guide is None:
        return None
    # refuse a guide without the sensors that it names
    asked = options_of(settings.guide, GuideOptions).sensors
    missing = [name for name in asked if name not in settings.sensors]
    if missing:
        name = plugin_name("guide", type(settings.guide))
        raise ConfigError(
            f"guide={name} needs the sensor '{missing[0]}', which the robot does not have: "
            "without it "
            "objects are not detected.\n"
            f"Add object and sensors, as experiment=grasp_lift does.  "
            f"{suggestion(missing[0], settings.sensors, label='Sensors')}"
        )
    check_sense(settings.controller.sense, {n: s.channels() for n, s in actor.sensors.items()})
    return Pilot(
        build_plant(actor.robot, plant_effects(settings, actor), settings.environment),
        settings.controller,
        settings.guide,
        volume=actor.evaluator.surroundings.volume,
        step=settings.time.step,
    )


def build_twin(
    settings: RunSettings,
    *,
    batch: int = 1,
    like: Array | None = None,
    values: Mapping[str, Any] | None = None,
) -> tuple[BatchDynamics, TwinState]:
    """Build the batch dynamics of a run, and its initial state repeated over the batch.

    Args:
        settings: of the run.
        batch: number of robots.
        like: array whose library, type and device to use.
        values: parameters in place of the configured ones, see `seals.batch.BatchDynamics`.
    """
    refuse_fluid(settings, "the batch dynamics")
    if settings.robots:
        raise ConfigError(
            f"robots.{next(iter(settings.robots))}: the batch dynamics are many of one robot.\n"
            "Choose it: robot=NAME; several kinds are for build_world."
        )
    robot, effects = build_model(settings)
    twin = BatchDynamics(
        robot,
        effects,
        settings.environment,
        settings.wave,
        batch=batch,
        like=like,
        values=values,
    )
    from seals.frames import matrix_of

    c = initial_configuration(settings, robot)
    turn = matrix_of(np.asarray(c.quaternion)[None])[0]
    return twin, (
        twin.start(
            position=c.position,
            quaternion=c.quaternion,
            velocity=c.velocity @ turn,
            angular_velocity=c.angular_velocity @ turn,
            joints=c.joints,
            joint_velocity=c.joint_velocity,
        )
    )


def initial_configuration(settings: RunSettings, robot: RobotModel) -> Configuration:
    """Return the initial configuration of a run.

    Raises:
        ConfigError: the numbers of joint values and of joints differ.
    """
    initial = settings.initial
    return stated_configuration("initial", initial, robot, initial.joint_velocity)


def step_count(settings: RunSettings) -> int:
    """Return the number of steps of a run."""
    return max(1, round(settings.time.duration / settings.time.step))


PERIODS = 2.0
"""Longest step, in periods of the controller.

A controller that is called half as often as its gains were made for still holds the robot; called a
third as often, it no longer does (the manipulator's at 125 Hz: 16 ms is calm, 30 ms swings).
"""


def _check_step(settings: RunSettings, robot: RobotModel) -> None:
    """Refuse a step that is too long for the controller or for a spring.

    What these bounds do not see, such as steep drag, is refused while it runs, when the motion
    leaves what a backend can follow.

    Raises:
        ConfigError: the step is beyond a bound; the bound is printed.
    """
    step = settings.time.step
    if settings.guide is not None:
        rate = float(settings.controller.rate)
        longest = PERIODS / rate
        # a step that was computed may miss the bound by a rounding
        if step > longest * (1.0 + 1e-9):
            raise ConfigError(
                f"time.step={step:g} is too long for controller.rate={rate:g}: at this low rate "
                "the "
                "controller does not stabilise the robot.\n"
                f"Allowed: time.step up to {longest:.3g}; or controller.rate={1.0 / step:.3g} with "
                "gains for this rate."
            )
    _check_springs(settings, robot)


def _check_springs(settings: RunSettings, robot: RobotModel) -> None:
    """Refuse springs to the world that are too stiff for the step: h sqrt(K / m) > 2."""
    step, mass = settings.time.step, float(robot.mass.sum())
    for name, effect in settings.effects.items():
        stiffness = float(effect.spring())
        if stiffness <= 0.0 or step * math.sqrt(stiffness / mass) <= 2.0:
            continue
        longest = 2.0 * math.sqrt(mass / stiffness)
        raise ConfigError(
            f"effects.{name}: a spring of {stiffness:.4g} N/m on {mass:.4g} kg is too stiff for "
            f"time.step={step:g}.\n"
            f"Allowed: time.step up to {longest:.3g}, or up to {4.0 * mass / step**2:.3g} N/m."
        )
