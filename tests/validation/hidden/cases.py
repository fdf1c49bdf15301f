"""One case: its vehicle, its true plant with and without the hidden effect, its reference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.validation.hidden import (
    catalogue,
    levels,
    links,
    onsets,
    outsiders,
    plant,
    references,
    vehicles,
)
from tests.validation.hidden.catalogue import Hidden
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array, from_angles
from tests.validation.hidden.vehicles import Vehicle, six

SECONDS = {"quad": 18.0, "auv": 18.0, "crossing": 18.0, "aam": 16.0, "drop": 2.5}
VERDICT = {
    "null": "nothing_missing",
    "out_of_library": "none_of_these",
    "confounded": "ambiguous",
    "poor_excitation": "cannot_tell",
}


@dataclass
class Spec:
    """What a case is asked to be."""

    kind: str
    level: str
    pattern: str
    effects: list[str]
    seed: tuple[int, ...]
    twin: str | None = None
    size: float = 1.0

    @property
    def body(self) -> str:
        """Kind of vehicle that is simulated."""
        return "drop" if self.kind == "drop_imu_only" else self.kind


@dataclass
class Case:
    """A case ready to run, and later what the run found."""

    spec: Spec
    vehicle: Vehicle
    with_it: Plant
    without: Plant
    hidden: list[Hidden]
    wanted: references.Wanted
    dither: float
    starts: list[dict[str, Array]] = field(default_factory=list)
    rng: np.random.Generator = field(default_factory=np.random.default_rng)
    found: dict[str, Any] = field(default_factory=dict)
    active: onsets.Span = (None, None)

    @property
    def runs(self) -> int:
        """Number of separate runs (segments)."""
        return max(len(self.starts), 1)


def build(spec: Spec) -> Case:
    """Draw a case; the same spec gives the same case."""
    rng = np.random.default_rng(spec.seed)
    vehicle = _vehicle(spec, rng)
    seconds = SECONDS[spec.body]
    if spec.body == "drop":
        wanted, speed = {}, np.array([0.5, 0.5, 1.0])
    else:
        wanted = references.draw(spec.body, spec.pattern, rng, seconds)
        batch = {k: a[..., None] for k, a in wanted.items()}
        speed = references.typical_speed(batch, seconds)[:, 0]
    without = plant.draw(vehicle, rng)
    without["speed"] = speed
    if vehicle.arm is not None:
        batch = {k: a[..., None] for k, a in wanted.items()}
        without["joint_start"] = references.joints(batch, 0.0)[:, 0]
    with_it = dict(without)
    hidden = [_effect(name, spec, vehicle, rng, wanted) for name in spec.effects]
    if spec.level == "out_of_library":
        outsiders.draw(spec.effects[0], spec.body, rng, with_it)
    else:
        for effect in hidden:
            effect.set_in(with_it)
    onset = spec.level == "onset"
    active = onsets.draw(rng, spec.effects[0], seconds) if onset else (None, None)
    lively = spec.pattern not in {"hover", "hold", "line", "slow"}
    dither = 0.4 if spec.body == "auv" else 8.0
    return Case(
        spec=spec,
        vehicle=vehicle,
        with_it=with_it,
        without=without,
        hidden=hidden,
        wanted=wanted,
        dither=dither if lively else 0.0,
        starts=_releases(rng) if spec.body == "drop" else [],
        rng=rng,
        active=active,
    )


def _vehicle(spec: Spec, rng: np.random.Generator) -> Vehicle:
    if spec.body == "drop":
        bare = "slamming" in spec.effects or (spec.level == "null" and rng.random() < 0.25)
        return vehicles.drop(rng, with_added_mass=not bare)
    if spec.body == "aam":
        return links.wading(rng) if spec.pattern == "wading" else links.aam(rng)
    return getattr(vehicles, spec.body)(rng)


def _effect(
    name: str, spec: Spec, vehicle: Vehicle, rng: np.random.Generator, wanted: references.Wanted
) -> Hidden:
    """Draw one hidden effect in the size of the level."""
    if spec.level == "out_of_library":
        return Hidden(name, {}, [], lambda _: None)
    size = spec.size
    if spec.level == "weak":
        size *= levels.WEAK[name]
    elif spec.level == "sensor_only":
        size *= rng.uniform(0.65, 1.0)
    elif spec.level == "poor_excitation":
        size *= 0.6
    if name == "tether":
        return catalogue.tether(vehicle, rng, size, wanted)
    if name == "payload" and spec.level == "confounded":
        return catalogue.payload(vehicle, rng, size, np.zeros(3))
    made: Hidden = getattr(catalogue, name)(vehicle, rng, size)
    if name == "accelerometer_scale" and spec.level == "confounded":
        only = six(np.array([0.0, 0.0, made.values["scale_z"]]))
        return catalogue.accelerometer_scale_of(only)
    return made


def _releases(rng: np.random.Generator) -> list[dict[str, Array]]:
    """Stated release of each drop and the true one, which misses it within its sigma."""
    out = []
    for _ in range(int(rng.integers(3, 5))):
        roll, pitch = np.clip(0.13 * rng.standard_normal(2), -0.3, 0.3)
        q = from_angles(roll, pitch, rng.uniform(-np.pi, np.pi))
        spot = np.append(rng.uniform(-0.1, 0.1, 2), rng.uniform(0.22, 0.6))
        spin = rng.uniform(-0.4, 0.4, 3)
        out.append(
            {
                "position": six(spot),
                "orientation": six(q),
                "angular_velocity": six(spin),
                "position_miss": 0.005 * _cut(rng),
                "orientation_miss": 0.01 * _cut(rng),
                "velocity_miss": 0.02 * _cut(rng),
                "angular_velocity_miss": 0.02 * _cut(rng),
            }
        )
    return out


def _cut(rng: np.random.Generator) -> Array:
    return np.clip(rng.standard_normal(3), -2.5, 2.5)
