"""Sensor suite of one robot: sampling, faults and delivery of readings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from seals.arrays import Floats
from seals.backend import RigidBody
from seals.effects.binding import EffectSet
from seals.errors import ConfigError, suggestion
from seals.plugin_options import options_of
from seals.rendering.camera_view import CameraView, SceneView
from seals.robot.model import RobotModel
from seals.sensors.delivery import INSTANT, NEW, Delivery, Line, Values
from seals.sensors.options import SensorOptions
from seals.sensors.protocol import NOBODY, OnboardState, RobotEquipment, Sensor, SensorInput
from seals.sensors.rays import Shape
from seals.sensors.surroundings import Surroundings
from seals.world.readings import Faults, Past

_STILL = np.zeros(3)
MANY = 1_000_000
"""Steps that are as good as endless."""


class Instant(NamedTuple):
    """Instant at which readings are taken.

    Args:
        time: [s].
        step: since the last one [s].
        seen: origins (L, 3), rotations (L, 3, 3) and twists (L, 6) of the links.
        felt: gives specific forces and angular accelerations of all links in the last step, see
            `seals.world.felt.felt_by_links`.
    """

    time: float
    step: float
    seen: tuple[Floats, Floats, Floats]
    felt: Callable[[], Sequence[Floats]]


class SensorSuite:
    """Sensors of one robot.

    Args:
        robot: that carries them.
        effects: of the robot; those with ``timing`` and ``measure`` are faults of sensors.
        sensors: by instance name.
        body: of the robot, for contacts.
        around: surroundings.
        board: the robot's own state.
        gravity: [m/s^2].

    Attributes:
        readings: what every sensor reported at the last instant, None for nothing.
        arrived: readings that came in then, with the time each was taken [s], by sensor.
        cameras: views of the scene, by name of the camera; without a renderer only those of sensors
            that make their images themselves.
        inertial: whether any of them needs what the links feel.

    Raises:
        ConfigError: the robot lacks a link, or what a sensor reads.
    """

    def __init__(
        self,
        robot: RobotModel,
        effects: EffectSet,
        sensors: Mapping[str, Sensor],
        *,
        body: RigidBody,
        around: Surroundings,
        board: OnboardState,
        gravity: float,
    ) -> None:
        self.sensors, self.body, self.gravity = dict(sensors), body, gravity
        self.around, self.board = around, board
        self.meet(NOBODY, ())
        outfit = RobotEquipment.of(robot, effects)
        options = {n: options_of(s, SensorOptions) for n, s in self.sensors.items()}
        for sensor in options.values():
            sensor.bind(outfit)
        self._carriers = {n: carrier_of(n, s, robot) for n, s in self.sensors.items()}
        # accelerations are found for those that do not say they need none
        self._inertial = {n: o.inertial for n, o in options.items()}
        self.inertial = any(self._inertial.values())
        self._idles = {n: o.idles for n, o in options.items()}
        self.cameras = {n: CameraView(None) for n, o in options.items() if o.records}
        faults = Faults(effects, self.sensors)
        self._askew = faults.turns
        self._chains = {n: c for n, c in faults.chains.items() if c.errors or c.delay}
        self._ways = {n: Delivery(s, delay=faults.delays[n]) for n, s in self.sensors.items()}
        # those that are asked at once, and whether nothing happens while none of them is due
        self._prompt = [n for n, o in options.items() if not o.late]
        self._silent = all(self._idles[n] and self._ways[n].plain for n in self._prompt)
        # periods and numbers drawn of sensors whose readings may be skipped, if all may
        draws = {n: o.draws() for n, o in options.items() if o.late and self._ways[n].plain}
        plain = {n: d for n, d in draws.items() if d is not None and n not in self._chains}
        rates = {n: max(1.0 / s.rate, 1e-9) for n, s in self.sensors.items()}
        every = len(plain) == len(self.sensors)
        self._skipped = {n: (rates[n], d) for n, d in plain.items()} if every else {}
        self._drawn = sum(plain.values())
        kinds: list[Any] = [type(self.sensors[n]) for n in self._skipped]
        self._told = all(hasattr(k, "taken") and k.taken is not SensorOptions.taken for k in kinds)
        self._forget()

    def meet(
        self, others: Mapping[str, Floats], shapes: Sequence[Callable[[], Sequence[Shape]]]
    ) -> None:
        """Register the scene's other bodies.

        Args:
            others: their origins, world [m], by name.
            shapes: of each, as they stand when asked.
        """
        self.others = others
        self.around.bodies = lambda: [shape for body in shapes for shape in body()]

    def open_cameras(self, scene: SceneView) -> None:
        """Give every camera its view of the scene."""
        with_cameras = (n for n, s in self.sensors.items() if options_of(s, SensorOptions).sees)
        self.cameras |= {n: CameraView(scene) for n in with_cameras}

    def _forget(self) -> None:
        for view in self.cameras.values():
            view.shot = None
        self.readings: dict[str, Any] = dict.fromkeys(self.sensors)
        self.arrived: list[tuple[float, str, Values]] = []
        self._memory: dict[str, Any] = {}
        self._past: dict[str, Past] = {}
        self._lines: dict[str, Line] = {}
        self._next: dict[str, float] = {}

    def reset(self, rng: np.random.Generator) -> None:
        """Clear all memory."""
        self._forget()
        self._memory = {name: sensor.start(rng) for name, sensor in self.sensors.items()}
        # the first reading comes after one period: before it, nothing was felt
        self._next = {name: 1.0 / sensor.rate for name, sensor in self.sensors.items()}

    def quiet(self, time: float, step: float) -> int:
        """Return in how many steps after ``time`` a sensor must be asked, at the earliest.

        Sensors that can be asked `late` need not be.

        Args:
            time: [s].
            step: h [s].
        """
        if not self._prompt:
            return MANY
        if not self._silent:
            return 1
        # less a millionth of a step: rather too early than too late
        wait = (min(self._next[name] for name in self._prompt) - INSTANT - time) / step - 1e-6
        return max(1, math.ceil(min(wait, MANY)))

    def catch_up(
        self,
        times: Sequence[float],
        rng: np.random.Generator,
        step: float,
        links: Callable[[str], Floats] | None,
    ) -> Mapping[str, Mapping[str, Floats]] | None:
        """Take readings of steps that lie behind, all at once, by sensor and channel, a row each.

        None, and nothing is done, where they have to be taken one by one. Nothing touches the robot
        at these times, and all sensors are to read once more after them.

        Args:
            times: of the readings, one after the other [s].
            rng: random state.
            step: h [s].
            links: gives arrays of `seals.world.compiled_links.Layout`, a row each; None where
                nobody looks at the readings: they are empty.
        """
        if not self._skipped or not (links is None or self._told):
            return None
        following = {}
        for name, (period, _) in self._skipped.items():
            after = self._next[name]
            for time in times:
                if time < after - INSTANT:
                    return None
                after += period
            following[name] = after
        self._next.update(following)
        noise, first = rng.standard_normal((len(times), self._drawn)), 0
        found: dict[str, Mapping[str, Floats]] = {}
        for name, (_, draws) in self._skipped.items():
            own, sensor = noise[:, first : first + draws], cast("SensorOptions", self.sensors[name])
            if links is None:
                self._memory[name] = sensor.passed(self._memory[name], own)
            else:
                # motion of one link at many instants, a row each; nothing touches it
                link = self._carriers[name]
                twists = links("twists")[:, 0, link]
                force, rate, turning = (links(x)[:, link] for x in ("force", "rate", "turning"))
                felt = SensorInput(
                    np.array(times),  # type: ignore[arg-type]
                    step,
                    links("origins")[:, 0, link],
                    links("rotations")[:, 0, link],
                    *(twists[:, :3], twists[:, 3:], force, rate),
                    others=self.others,
                    around=self.around,
                    board=self.board,
                    axis_misalignment=self._askew[name],
                    turning=turning,
                )
                found[name], self._memory[name] = sensor.taken(felt, self._memory[name], own)
            first += draws
        return found

    def take(self, now: Instant, rng: np.random.Generator) -> None:
        """Take the readings that are due."""
        self.readings, self.arrived = dict.fromkeys(self.sensors), []
        time, seen = now.time, None
        for name, sensor in self.sensors.items():
            due = time >= self._next[name] - INSTANT
            if not due and self._idles[name] and self._ways[name].plain:
                continue
            reading, felt = None, None
            if due or not self._idles[name]:
                if seen is None:
                    outside = self.body.contact_wrenches(), self.body.contact_normals()
                    seen = *now.seen, *outside
                felt = self._felt(name, now, seen)
                reading, self._memory[name] = sensor.sense(felt, self._memory[name], rng, due=due)
            if felt is not None and reading is not None and name in self._chains:
                past = self._past.get(name, ())
                reading, self._past[name] = self._chains[name].report(felt, reading, past)
            if due:
                self._next[name] += max(1.0 / sensor.rate, 1e-9)
            self._hand_on(name, now, reading, rng)

    def _hand_on(
        self, name: str, now: Instant, reading: Values | None, rng: np.random.Generator
    ) -> None:
        """Log a reading, and collect arriving readings."""
        way = self._ways[name]
        if way.plain:
            if reading is not None:
                self.readings[name] = reading
                self.arrived.append((now.time, name, reading))
            return
        line = self._lines.get(name, NEW)
        reading, line = way.report(now.time, now.step, reading, line, rng)
        arrived, self._lines[name] = way.arrivals(now.time, reading, line)
        self.readings[name] = reading
        self.arrived += [(taken, name, values) for taken, values in arrived]

    def heard(self) -> dict[float, dict[str, Values]]:
        """Return the readings that arrived last, by sample time [s], oldest first."""
        out: dict[float, dict[str, Values]] = {}
        if len(self.arrived) < 2:
            return {taken: {name: values} for taken, name, values in self.arrived}
        for taken, name, values in sorted(self.arrived, key=lambda entry: entry[0]):
            out.setdefault(taken, {})[name] = values
        return out

    def _felt(self, name: str, now: Instant, seen: Sequence[Floats]) -> SensorInput:
        """Motion of one link, for inertial sensors with its mean acceleration over the step.

        Args:
            name: of the sensor.
            now: the instant.
            seen: origins, rotations, twists, contact wrenches and normal forces of all links.
        """
        origins, rotations, twists, contact, pressing = seen
        link = self._carriers[name]
        twist, force, rate, turning = twists[link], _STILL, _STILL, None
        if self._inertial[name]:
            forces, rates, spins = now.felt()
            force, rate, turning = forces[link], rates[link], spins[link]
        # in the order of the fields: keywords cost as much as the arithmetic
        return SensorInput(
            now.time,
            now.step,
            origins[link],
            rotations[link],
            twist[:3],
            twist[3:],
            force,
            rate,
            contact[link],
            pressing.item(link),
            self.others,
            self.around,
            self.board,
            self._askew[name],
            self.cameras.get(name),
            turning,
        )

    def snapshot(self) -> Any:
        """Return the complete state."""
        parts = (self._memory, self._next, self.readings, self._past, self._lines)
        shots = {name: view.shot for name, view in self.cameras.items()}
        return tuple(dict(part) for part in parts), list(self.arrived), shots

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        parts, arrived, shots = kept
        self._memory, self._next, self.readings, self._past, self._lines = (dict(x) for x in parts)
        self.arrived = list(arrived)
        for name, view in self.cameras.items():
            view.shot = shots.get(name)


def carrier_of(name: str, sensor: Sensor, robot: RobotModel) -> int:
    """Return the index of the link that carries a sensor.

    Raises:
        ConfigError: the robot has no such link.
    """
    if sensor.link == "root":
        return 0
    if sensor.link not in robot.links:
        raise ConfigError(
            f"sensors.{name}.link: there is no link '{sensor.link}'.\n"
            f"{suggestion(sensor.link, [*robot.links, 'root'])}"
        )
    return robot.links.index(sensor.link)
