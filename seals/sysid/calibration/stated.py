"""Parameters of a model that can be calibrated, by their names in `robot.yaml`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from seals.effects.binding import has_hook
from seals.effects.effect import ActuatorOptions, Effect
from seals.effects.identification import Property
from seals.plugin_options import options_of
from seals.schema import parameters_of
from seals.sysid.candidates.activity import ACTIVE
from seals.sysid.candidates.parameters import CandidateSet, Parameter
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.vehicle import Vehicle

ACTUATORS, EFFECTS, HULLS, SENSORS = "actuators", "effects", "hulls", "sensors"
"""Sections of `robot.yaml`; faults of sensors are named after the last."""
_LEAST = 0.02
"""Least share of a stated mass, moment of inertia, volume or time constant that may be found."""


@dataclass(frozen=True, kw_only=True)
class StatedNumber:
    """Number of a robot that can be calibrated.

    Equation:
        number = value + slope x parameter, where the parameter is a change of the model.

    Args:
        name: as in ``robot.yaml``, or of the whole vehicle: ``mass``, ``inertia_xx``.
        key: of the parameter in the extended model.
        value: as stated; the mean of a list with one number a drive.
        unit: of the value.
        slope: change of the number with the parameter.
        bounds: of the number.
        offered: whether a name with a wildcard means it; a zero that only switches a law off is
            meant by its own name alone.
        directions: of the drives with whose signs that of the number changes, as stated; empty for
            none.
        turned_by: their name in ``robot.yaml``.
    """

    name: str
    key: str
    value: float
    unit: str
    slope: float = 1.0
    bounds: tuple[float, float] = (-math.inf, math.inf)
    offered: bool = True
    directions: tuple[float, ...] = ()
    turned_by: str = ""

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest change of the model's parameter."""
        low, high = sorted(map(self.change, self.bounds))
        return low, high

    def allowed(self, number: float) -> bool:
        """Return whether a value lies within the bounds."""
        return self.bounds[0] <= number <= self.bounds[1]

    def number(self, change: float) -> float:
        """Convert a change of the model's parameter to the stated number."""
        return self.value + self.slope * change

    def change(self, number: float) -> float:
        """Convert a stated number to the change of the model's parameter."""
        return (number - self.value) / self.slope


def stated_numbers(
    vehicle: Vehicle, candidate_set: CandidateSet, *, hull: str = ""
) -> dict[str, StatedNumber]:
    """Return all numbers of a vehicle that can be calibrated, by name.

    Args:
        vehicle: stated model.
        candidate_set: its parameters.
        hull: name of the link whose hull lifts the base; that of the base when empty.
    """
    found = [*_properties(vehicle, candidate_set, hull or vehicle.robot.links[0])]
    for instance, effect in vehicle.effects.items():
        # what a field itself states comes later, and rules
        found += _fields(_head(vehicle, instance), instance, effect)
    found += _sensors(vehicle, candidate_set)
    return {number.name: number for number in found}


def hull_of(robot: RobotDescription | None) -> str:
    """Return the name of the one link of a robot that has a hull; empty for none or several."""
    if robot is None:
        return ""
    model = robot.robot
    wet = [n for n, h in zip(model.links, model.hulls, strict=True) if h is not None]
    return wet[0] if len(wet) == 1 else ""


def _properties(vehicle: Vehicle, candidate_set: CandidateSet, hull: str) -> Iterator[StatedNumber]:
    """Numbers of the vehicle, its hull and its actuators that have a tolerance."""
    drives = [n for n, e in vehicle.effects.items() if has_hook(e, "drives")]
    for key, parameter in candidate_set.parameters.items():
        changes = parameter.changes
        if changes is None or key.endswith(ACTIVE):
            continue
        if changes.section != ACTUATORS:
            head = f"{HULLS}.{hull}." if changes.section == HULLS else ""
            yield _property(f"{head}{changes.name}", key, changes, parameter)
        elif len(drives) == 1 and changes.name in {
            f.name for f in fields(vehicle.effects[drives[0]])
        }:
            # drives of two kinds share a tolerance: its number is that of neither
            yield _property(f"{_head(vehicle, drives[0])}.{changes.name}", key, changes, parameter)


def _property(name: str, key: str, changes: Property, parameter: Parameter) -> StatedNumber:
    low, high = (changes.value + changes.slope * b for b in parameter.bounds)
    return StatedNumber(
        name=name,
        key=key,
        value=changes.value,
        unit=changes.unit,
        slope=changes.slope,
        bounds=(max(low, _LEAST * changes.value), high),
    )


def _head(vehicle: Vehicle, instance: str) -> str:
    """Section and name of an instance, as in `robot.yaml`."""
    if instance in vehicle.written:
        return vehicle.written[instance]
    effect = vehicle.effects[instance]
    drives = has_hook(effect, "drives") or has_hook(effect, "joint_drive")
    return f"{ACTUATORS if drives else EFFECTS}.{instance}"


def _fields(head: str, instance: str, effect: Effect) -> Iterator[StatedNumber]:
    """Fields of one effect or actuator of the stated model."""
    drives = has_hook(effect, "drives")
    scaled = options_of(effect, ActuatorOptions).scaled_by if drives else {}
    turned = options_of(effect, ActuatorOptions).turned_by if drives else {}
    metas = parameters_of(effect)
    changes = {parameter for parameter, _ in scaled.values()}
    for name, meta in metas.items():
        # a list with one number a joint rules over the number for all of them
        if name in changes or getattr(effect, f"{name}_each", None):
            continue
        value = float(getattr(effect, name))
        yield StatedNumber(
            name=f"{head}.{name}",
            key=f"{instance}.{name}",
            value=value,
            unit=meta.unit,
            bounds=meta.bounds,
            offered=meta.fit and value != 0.0,
        )
    for name, (parameter, unit) in scaled.items():
        value = float(np.mean(getattr(effect, name)))
        low, high = metas[parameter].bounds
        yield StatedNumber(
            name=f"{head}.{name}",
            key=f"{instance}.{parameter}",
            value=value,
            unit=unit,
            slope=value,
            bounds=(value * (1.0 + low), value * (1.0 + high)),
            directions=tuple(getattr(effect, turned[name])) if name in turned else (),
            turned_by=f"{head}.{turned[name]}" if name in turned else "",
        )


def _sensors(vehicle: Vehicle, candidate_set: CandidateSet) -> Iterator[StatedNumber]:
    """Faults of the inertial sensors: biases, scales, misalignment, delay; stated as none."""
    late = candidate_set.sensor_delay
    for key, parameter in candidate_set.parameters.items():
        effect = candidate_set.effects.get(parameter.instance)
        own = effect is not None and parameter.instance not in vehicle.effects
        if effect is None or not own or key.endswith(ACTIVE):
            continue
        if key == late or has_hook(effect, "measure") or has_hook(effect, "pose_turn"):
            meta = parameters_of(effect)[parameter.parameter]
            yield StatedNumber(
                name=f"{SENSORS}.{key}", key=key, value=0.0, unit=meta.unit, bounds=parameter.bounds
            )
