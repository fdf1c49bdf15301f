"""Model of a log's vehicle: stated effects, changes of them, and added effects."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from seals.arrays import Floats
from seals.config.overlay import Overlay
from seals.effects.binding import EffectSet, has_hook
from seals.effects.discrepancy import DragExponent, WaveMoment
from seals.effects.effect import Effect
from seals.environment.waves import Waves
from seals.errors import ConfigError, suggestion
from seals.registry import get, names
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.world.drivetrain import response_of, timing_of


@dataclass(frozen=True, kw_only=True)
class Model:
    """Model variant: the vehicle with its effects, and the waves.

    Args:
        name: of the variant.
        vehicle: its effects are those of this variant.
        waves: of the water surface; None for calm water.
    """

    name: str
    vehicle: Vehicle
    waves: Waves | None = None

    @property
    def bound(self) -> EffectSet:
        """Effects on their links."""
        return self.vehicle.bound

    @property
    def lag(self) -> Floats:
        """Time constants of the drives [s], shape (n,)."""
        lag: Floats = response_of(self.bound).lag
        return lag

    @property
    def command_delay(self) -> float:
        """Mean delay of commands on their way to the drives [s]."""
        late = self.vehicle.command_latency + float(timing_of(self.bound).command_delay)
        return max(late, 0.0)

    @property
    def sensor_delay(self) -> float:
        """Delay of the inertial sensors [s]."""
        return float(timing_of(self.bound).sensor_delay)

    def tangent(self, samples: Samples, *, parts: int) -> tuple[ExtendedModel, dict[str, float]]:
        """Return the batch dynamics of this model for linearisation, and its timing parameters.

        Effects too steep for explicit steps do not take part: they would make start states matter
        less than they do.

        Args:
            samples: the log.
            parts: integration steps per row.
        """
        effects = {n: e for n, e in self.vehicle.effects.items() if not e.stiff}
        response = response_of(self.bound)
        vehicle = replace(self.vehicle, effects=effects, lag=response.lag, fall=response.fall)
        plant = ExtendedModel(
            vehicle,
            CandidateSet(effects=dict(effects), parameters={}, candidates=()),
            samples,
            parts=parts,
        )
        if self.waves is not None:
            plant.waves = self.waves
        plant.command_delay = self.command_delay - self.vehicle.command_latency
        return plant, {}

    def changed(
        self, name: str, changes: Mapping[str, float], candidate_set: CandidateSet
    ) -> Model:
        """Return the model with parameters of a diagnosis changed.

        Args:
            name: of the new variant.
            changes: against the stated model, by parameter key.
            candidate_set: that knows the keys.

        Raises:
            ConfigError: a key is unknown, or its value is out of bounds.
        """
        effects, sea = dict(self.vehicle.effects), None
        for instance, values in by_instance(changes).items():
            if instance in candidate_set.waves:
                sea = candidate_set.waves[instance].law(**values)
                continue
            if not _known(instance, effects, candidate_set):
                continue
            effects[instance] = _moved(instance, values, effects, candidate_set)
        made = replace(self, name=name, vehicle=replace(self.vehicle, effects=effects))
        return made if sea is None else made.in_waves(sea)

    def with_overlay(self, name: str, overlay: Overlay) -> Model:
        """Return the model with the effects of an overlay.

        Args:
            name: of the new variant.
            overlay: whose nominal values are left out.

        Raises:
            ConfigError: the model has no effect to change, or a value is out of bounds.
        """
        effects = overlay.applied(self.vehicle.effects)
        made = replace(self, name=name, vehicle=replace(self.vehicle, effects=effects))
        return made if overlay.waves is None else made.in_waves(overlay.waves)

    def in_waves(self, waves: Waves) -> Model:
        """Return the model in waves; the wave force acts on the origin."""
        moment = WaveMoment(correction=True)
        effects = {**self.vehicle.effects, "wave_moment": moment}
        return replace(self, waves=waves, vehicle=replace(self.vehicle, effects=effects))


def nominal(vehicle: Vehicle) -> Model:
    """Return the model that a log states."""
    return Model(name="stated model", vehicle=vehicle)


def by_instance(changes: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Group parameter keys by instance.

    Example:
        >>> by_instance({"wind.velocity_x": 2.0, "mass.mass": 0.1})
        {'wind': {'velocity_x': 2.0}, 'mass': {'mass': 0.1}}
    """
    table: dict[str, dict[str, float]] = {}
    for key, value in changes.items():
        instance, _, parameter = key.partition(".")
        table.setdefault(instance, {})[parameter] = float(value)
    return table


def with_speeds(candidate_set: CandidateSet, speeds: Sequence[float]) -> CandidateSet:
    """Return the candidate set with drag exponents that refer to the speeds of another log.

    Args:
        candidate_set: of the present log.
        speeds: of the log in which the exponents were fitted [m/s], shape (3,).
    """
    effects = dict(candidate_set.effects)
    for name, effect in effects.items():
        if isinstance(effect, DragExponent):
            fixed = copy.copy(effect)
            fixed.speeds = (float(speeds[0]), float(speeds[1]), float(speeds[2]))
            effects[name] = fixed
    return replace(candidate_set, effects=effects)


def _known(instance: str, own: Mapping[str, Effect], candidate_set: CandidateSet) -> bool:
    """Return false for a turn of the pose on a log whose markers are stated to be level.

    It is a fault of the measurement in the log in which it was found, not of the model.
    """
    if instance in own or instance in candidate_set.effects or instance not in names("effect"):
        return True
    return not has_hook(get("effect", instance).load()(), "pose_turn")


def _moved(
    instance: str,
    values: Mapping[str, float],
    own: Mapping[str, Effect],
    candidate_set: CandidateSet,
) -> Effect:
    """Return an effect of the model, or of the candidates, with changed parameters.

    A change may be negative where the whole quantity may not: the bounds are those of the change.
    """
    for name, value in values.items():
        key = f"{instance}.{name}"
        parameter = candidate_set.parameters.get(key)
        if parameter is None:
            raise ConfigError(
                f"nominal: '{key}' is not a property that a diagnosis may change.\n"
                f"{suggestion(key, candidate_set.parameters)}"
            )
        low, high = parameter.bounds
        if not low <= value <= high:
            raise ConfigError(
                f"nominal.{key}={value:g} is not allowed.\nAllowed: {low:g} to {high:g}."
            )
    effect = own[instance] if instance in own else candidate_set.effects[instance]
    total: dict[str, Any] = {
        name: float(getattr(effect, name)) + value for name, value in values.items()
    }
    return replace(effect, **total)
