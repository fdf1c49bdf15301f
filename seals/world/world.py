"""World: time, random states, and the sequence of one step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Backend, Configuration
from seals.effects.scene import Rotors
from seals.environment.settings import EnvironmentSettings
from seals.errors import PhysicsError, naming
from seals.fluid import Fluid
from seals.rendering.camera_view import SceneView
from seals.state_records import state_record
from seals.world.actor import Actor
from seals.world.immersion import joined
from seals.world.stretch import Loops


@state_record
class Snapshot(NamedTuple):
    """An opaque copy of a world: time, random states by actor, scene, actors."""

    time: float
    steps: int
    random: Mapping[str, Any]
    scene: Any
    actors: tuple[Any, ...]
    fluid: Any = None


class Others(Mapping[str, Floats]):
    """Origins of the other bodies in the world [m], evaluated on demand.

    Args:
        actors: by name.
    """

    def __init__(self, actors: Mapping[str, Actor]) -> None:
        self._actors = actors

    def __getitem__(self, name: str) -> Floats:
        return self._actors[name].body.read().position

    def __iter__(self) -> Iterator[str]:
        return iter(self._actors)

    def __len__(self) -> int:
        return len(self._actors)


def _rotors_of(actors: Sequence[Actor]) -> list[Rotors]:
    """Rotors of some robots."""
    return [rotors for actor in actors for rotors in actor.rotors()]


class World:
    """Robots and objects with effects in one scene.

    One step: read the bodies, sample the medium, evaluate all effects into the ledger, hand the
    sums to the backend, advance, then take the sensor readings that are due. A fluid advances
    between effects and backend, see `seals.fluid`.

    Args:
        backend: open rigid-body scene.
        actors: robots by name.
        environment: air, water, ground.
        step: [s].
        seed: of the random states.
        seeds: of robots by name, in place of it, so that none measures what another does.
        fluid: open, that all robots are in, or None.
        watch: the scene as cameras see it, or None; closed with the world.

    Attributes:
        time: [s].
        rngs: random state of the sensors of each actor, by name.

    Example:
        >>> from seals import make
        >>> with make(["robot=ball", "initial.position=[0, 0, 1]"]) as world:
        ...     world.advance(5)
        ...     list(world.actors), round(world.time, 3)
        (['robot'], 0.02)
    """

    backend: Backend
    actors: dict[str, Actor]
    environment: EnvironmentSettings
    step_size: float
    fluid: Fluid | None
    watch: SceneView | None
    time: float
    rngs: dict[str, np.random.Generator]

    def __init__(
        self,
        backend: Backend,
        actors: Mapping[str, Actor],
        environment: EnvironmentSettings,
        *,
        step: float,
        seed: int,
        seeds: Mapping[str, Sequence[int]] = MappingProxyType({}),
        fluid: Fluid | None = None,
        watch: SceneView | None = None,
    ) -> None:
        self.backend, self.actors, self.environment = backend, dict(actors), environment
        self.step_size, self.fluid, self.watch = step, fluid, watch
        self.time, self._count = 0.0, 0
        self._seeds: Mapping[str, Any] = {name: seeds.get(name, seed) for name in self.actors}
        self._reseed()
        self._loops = Loops()
        for name, actor in self.actors.items():
            others = {n: a for n, a in self.actors.items() if n != name}
            actor.sensor_suite.meet(Others(others), [a.shapes for a in others.values()])
            actor.evaluator.rotors = partial(_rotors_of, tuple(others.values()))
            if actor.pilot is not None:
                actor.pilot.bodies = Others(others)

    def seed_noise(self, seed: int) -> None:
        """Give the sensors of all actors another seed, which counts from the next reset on."""
        self._seeds = dict.fromkeys(self.actors, seed)

    def _reseed(self) -> None:
        self.rngs = {name: np.random.default_rng(seed) for name, seed in self._seeds.items()}

    def reset(self, configurations: Mapping[str, Configuration]) -> None:
        """Reset all robots, set the time to zero and reseed the random states.

        The first reading of a sensor comes after one of its periods.

        Raises:
            PhysicsError: a configuration is not finite or faster than the backend can follow.
        """
        self.time, self._count = 0.0, 0
        self._reseed()
        for name, actor in self.actors.items():
            # refuse states that are not finite
            for field, values in configurations[name]._asdict().items():
                if not np.all(np.isfinite(values)):
                    raise PhysicsError(
                        f"initial {field} of '{name}' is {values}.\nAllowed: finite numbers."
                    )
            actor.reset(configurations[name], self.rngs[name])
        if self.fluid is not None:
            self.fluid.initialise(
                joined([a.immersed(self.step_size) for a in self.actors.values()])
            )

    def step(self) -> None:
        """Advance by one step."""
        self._advance(1)

    def advance(self, steps: int) -> None:
        """Advance by some steps, as by as many calls of `step`, but in fewer.

        Robots that are all compiled make them in machine code, up to the next instant at which a
        controller or a sensor is asked, or something touches; several while nothing can touch.

        Args:
            steps: how many.
        """
        while steps > 0:
            steps -= self._advance(steps)

    def stride(self, most: int) -> int:
        """Advance by one step or more, and return by how many.

        Those before the last one are told by `Actor.history` until the next step.

        Args:
            most: steps, at least one.
        """
        return self._advance(most, keep=True)

    def _advance(self, most: int, *, keep: bool = False) -> int:
        """Advance by one step or more; return by how many."""
        several = len(self.actors) > 1
        for name, actor in self.actors.items():
            if several:
                actor.note_drive()
            with naming(name) if several else nullcontext():
                actor.begin(self.time, self.step_size)
        made = 0 if self.fluid is not None else self._looped(most)
        if not made:
            for name, actor in self.actors.items():
                with naming(name) if several else nullcontext():
                    actor.load()
            if self.fluid is not None:
                self._exchange(self.fluid)
            self.backend.advance()
            made = 1
        self._count += made
        # a product, not a running sum: ten thousand steps stay on the grid
        self.time = self._count * self.step_size
        for name, actor in self.actors.items():
            actor.sense(self.time, self.step_size, self.rngs[name], keep=keep)
        return made

    def _looped(self, most: int) -> int:
        """Make steps of all robots by machine code; return how many, 0 where Python is asked."""
        actors = self.actors.values()
        for actor in actors:
            most = actor.quiet(most)
            if not most:
                return 0
        shares = [share for actor in actors if (share := actor.share(most)) is not None]
        made = self._loops.run(shares, self._count) if len(shares) == len(actors) else None
        if made is None:
            return 0
        return min(a.note(m, self._count) for a, m in zip(actors, made, strict=True))

    def _exchange(self, fluid: Fluid) -> None:
        """Advance the fluid and hand its impulses to the robots."""
        states = [actor.immersed(self.step_size) for actor in self.actors.values()]
        impulses, first = fluid.exchange(joined(states), self.time, self.step_size), 0
        for actor, own in zip(self.actors.values(), states, strict=True):
            last = first + len(own.inverse_mass)
            actor.push(impulses[first:last], self.step_size)
            first = last

    def snapshot(self) -> Snapshot:
        """Return a copy of the complete state, effects and sensors included."""
        actors = tuple(actor.snapshot() for actor in self.actors.values())
        return Snapshot(
            self.time,
            self._count,
            {name: rng.bit_generator.state for name, rng in self.rngs.items()},
            self.backend.snapshot(),
            actors,
            None if self.fluid is None else self.fluid.snapshot(),
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this world."""
        self.time, self._count = snapshot.time, snapshot.steps
        for name, rng in self.rngs.items():
            rng.bit_generator.state = snapshot.random[name]
        self.backend.restore(snapshot.scene)
        for actor, kept in zip(self.actors.values(), snapshot.actors, strict=True):
            actor.restore(kept)
        if self.fluid is not None:
            self.fluid.restore(snapshot.fluid)

    def __enter__(self) -> World:
        """Return the world: ``with`` closes it."""
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Release backend, fluid and renderer."""
        self.backend.close()
        if self.watch is not None:
            self.watch.close()
        if self.fluid is not None:
            self.fluid.close()
