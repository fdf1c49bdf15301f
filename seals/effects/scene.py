"""The scene of an effect beyond its own links: the fluid at any place, rotors of other robots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.effects.binding import EffectSet
from seals.effects.hooks import names_any, pick_of
from seals.environment.sampler import EnvironmentSampler
from seals.motion import Body, Inputs, Joints, Medium, MediumKind, Motion
from seals.pytree import mapped
from seals.scalar_compiler import CannotCompile


class Fluid(NamedTuple):
    """Water and air at K places of each of N bodies; velocities in world axes.

    Args:
        depth: below the water surface [m], shape (N, K, 1); None without water.
        water_velocity: of waves and currents, as if there were water [m/s], shape (N, K, 3).
        water_density: [kg/m^3], shape (N or 1, K or 1, 1).
        air_velocity: of the wind [m/s], shape (N, K, 3).
        air_density: [kg/m^3], shape (1, 1, 1).
        bottom: height of the level bottom [m]; None for none.
    """

    depth: Array | None
    water_velocity: Array
    water_density: Array
    air_velocity: Array
    air_density: Array
    bottom: float | None


class Rotors(NamedTuple):
    """Rotors of another robot, world axes.

    Args:
        position: of the n hubs [m], shape (n, 3).
        axis: direction of positive thrust [1], shape (n, 3).
        radius: of the discs [m], shape (n,).
        thrust: at the speed that the rotors had when the step began [N], shape (n,).
    """

    position: Floats
    axis: Floats
    radius: Floats
    thrust: Floats


class Scene:
    """The scene around an effect at one instant, for hooks that name ``scene``.

    A robot with such an effect is simulated without machine code.

    Args:
        surroundings: air, water and waves.
        effects: whose flows move them.
        motion: of the links.
        inputs: of the effects.
        rotors: returns those of the other robots of the run, actuator by actuator.
    """

    def __init__(
        self,
        surroundings: EnvironmentSampler,
        effects: EffectSet,
        motion: Motion,
        inputs: Inputs,
        rotors: Callable[[], Sequence[Rotors]] = tuple,
    ) -> None:
        self._surroundings, self._effects = surroundings, effects
        self._time, self._inputs, self.rotors = motion.time, inputs, rotors

    @property
    def air_density(self) -> Array:
        """Density of the air [kg/m^3], shape (1, 1)."""
        return self._surroundings.air_density

    def fluid(self, places: Array, medium: Medium) -> Fluid:
        """Return water and air at places beside the links, flows included.

        Flows that have a memory are left out.

        Args:
            places: world [m], shape (N, K, 3).
            medium: as the effect is given it, at its N rows.
        """
        xp, around = namespace(places), self._surroundings
        rows, count = places.shape[0], places.shape[1]
        flat = xp.reshape(places, (rows * count, 3))
        time = _beside(self._time, rows, count)
        depth, water, density = around.water_at(flat, time)
        flows = {MediumKind.water: water, MediumKind.air: 0.0 * flat}
        for b in self._effects.flows:
            if b.effect.memory_size:
                continue
            params = {k: _beside(p, rows, count) for k, p in b.params.items()}
            beside = mapped(medium, lambda x: _beside(x, rows, count))
            still = Joints(flat[:, :0], flat[:, :0])
            # points at rest in the world, whose axes are those of the world
            one = as_like(np.eye(3)[None], flat)
            none = 0.0 * flat
            zero = none[:1, :1]
            given = (
                Motion(time, flat, one, one[:, 2, :], none, none, Body(zero, none[:1], zero, zero)),
                beside,
                still,
                self._inputs,
                None,
                params,
                self,
            )
            velocity, _ = b.hooks.flow(*pick_of(b.effect, "flow")(given))
            for kind in [k for k in flows if b.kind in (k, None, MediumKind.any)]:
                flows[kind] = flows[kind] + velocity
        shape = (rows, count, -1)
        return Fluid(
            None if depth is None else xp.reshape(depth, shape),
            xp.reshape(flows[MediumKind.water], shape),
            xp.reshape(density, shape if density.shape[0] == rows * count else (1, 1, 1)),
            xp.reshape(flows[MediumKind.air], shape),
            xp.reshape(around.air_density, (1, 1, 1)),
            around.bottom,
        )


def asking(effects: EffectSet) -> str | None:
    """Return the name of an effect that asks for its scene; None for none."""
    hooks = {"flow": effects.flows, "loads": effects.loads}
    pairs = [(h, b) for h, some in hooks.items() for b in some if b.effect.surveying]
    found = (b.name for h, b in pairs if names_any(b.effect, h, ("scene",)))
    return next(found, None)


def refuse_asking(effects: EffectSet) -> None:
    """Refuse effects that ask for the scene around them, which code traced once does not have.

    Raises:
        CannotCompile: an effect names ``scene`` among the arguments of a hook.
    """
    name = asking(effects)
    if name is not None:
        raise CannotCompile(
            f"effects.{name} asks for its scene: the fluid beside the robot, or other robots."
        )


def _beside(values: Array, rows: int, count: int) -> Array:
    """Repeat each row for every place of it; a single row stays.

    Parameters of an effect on several links have rows link by link; those of the first links count.
    """
    if values.shape[0] == 1:
        return values
    xp = namespace(values)
    if values.shape[0] < rows:
        values = xp.concat([values] * (rows // values.shape[0]), axis=0)
    place = xp.asarray(np.repeat(np.arange(rows), count))
    return xp.take(values, place, axis=0)
