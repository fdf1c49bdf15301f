"""Acoustic modem: messages with a position from another robot, late by the travel of sound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import refuse_unlisted
from seals.field_roles import roles
from seals.schema import param, setting, vector
from seals.sensors.acoustics import mirrored
from seals.sensors.mount import Mount, PlacedSensor
from seals.sensors.protocol import SensorInput
from seals.state_records import state_record

PATHS = 4
"""Reflected paths: surface; bottom; surface, then bottom; bottom, then surface."""
_WATERLINKED = "class of Water Linked M64: 200 m"


@state_record
class Message(NamedTuple):
    """A message that is under way.

    Args:
        time: at which it was sent [s].
        place: at which it was sent, world [m], shape (3,).
        content: position that it tells, world [m], shape (3,).
    """

    time: float
    place: Floats
    content: Floats


@roles(data="target multipath")
@dataclass(kw_only=True)
class SensorModem(PlacedSensor):
    """Receiver of an acoustic modem: another robot tells its position, at intervals.

    Equation:
        A message that leaves p_s at t_s arrives at t, where |p(t) - p_s| = c (t - t_s), c the speed
        of sound (Mackenzie 1981) half-way. Echoes have the paths from the images of p_s in the flat
        surface and bottom: sqrt(r^2 + (z_s + z)^2) by the surface, with depths z; their level is
        20 log10(R d / d_e), R the product of the reflection coefficients, d and d_e the lengths of
        the direct and of the reflected path (spherical spreading).

    Args:
        target: robot or object that sends; empty for a beacon at ``place``.
        place: of the beacon, world [m].
        rate: messages a second [Hz].
        farthest: range [m].
        loss: probability that a message is lost [1].
        error: standard deviation of each component of the position that the sender knows [m].
        multipath: whether echoes are told.
        surface_reflection: magnitude of the reflection coefficient of the surface [1].
        bottom_reflection: of the bottom [1].

    Assumptions:
        The clocks of both are equal, so that the delay of a message tells the distance; a message
        counts as received when its first sound arrives. The speed of sound is that half-way.

    Valid range:
        Speeds far below that of sound; echoes of a smooth surface and a level bottom.

    Limitations:
        Straight rays, no refraction. The length of a message, its energy and noise, and collisions
        of messages are not modelled: state ``loss``. Nothing is heard behind an obstacle, though an
        echo may get there. What is read is the arrival; guides and controllers do not answer it.

    References:
        Mackenzie 1981, J. Acoust. Soc. Am. 70, 807. Urick 1983, Principles of Underwater Sound, ch.
        5 (images of the source in surface and bottom).

    Example:
        >>> SensorModem(multipath=True).channels()
        {'modem_position': 3, 'modem_delay': 1, 'modem_echo_delay': 4, 'modem_echo_level': 4}
    """

    target: str = ""
    place: list[float] = vector((3.0, 0.0, -4.0), "m", bounds=(-1e5, 1e5), source="chosen")
    rate: float = setting(1.0, "Hz", bounds=(1e-3, 100.0), source="chosen")
    farthest: float = setting(200.0, "m", bounds=(0.1, 1e5), source=_WATERLINKED)
    loss: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen: none")
    error: float = param(0.0, "m", bounds=(0.0, 1e3), tolerance=0.1, source="chosen: none")
    multipath: bool = False
    surface_reflection: float = setting(1.0, "1", bounds=(0.0, 1.0), source="Urick: smooth water")
    bottom_reflection: float = setting(0.5, "1", bounds=(0.0, 1.0), source="chosen: sand")

    travels: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Turn the mounting into arrays."""
        self._mount = Mount("modem", self.position, self.rpy)

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        heard = {"modem_position": 3, "modem_delay": 1}
        echoes = {"modem_echo_delay": PATHS, "modem_echo_level": PATHS}
        return heard | (echoes if self.multipath else {})

    def start(self, rng: np.random.Generator) -> tuple[Message, ...]:
        """Return the messages under way: none."""
        return ()

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a message that arrives; one is sent when due.

        Raises:
            ConfigError: a target is named that is not in the scene.
        """
        felt, reading = self._mount.felt(felt), None
        under_way: list[Message] = list(memory)
        while under_way and reading is None:
            first = under_way[0]
            speed = felt.around.sound(felt.time, felt.position, first.place, self.farthest)
            way = float(np.linalg.norm(felt.position - first.place))
            if speed is not None and way > speed * (felt.time - first.time):
                break
            # what finds no way to the receiver now is gone
            reading = None if speed is None else self._read(felt, first, speed)
            del under_way[0]
        if due:
            if self.target:
                refuse_unlisted(
                    self.target,
                    felt.others,
                    f"modem needs the target '{self.target}', which is not in the scene",
                    label="Robots and objects",
                )
            place = np.array(felt.others[self.target] if self.target else self.place, dtype=float)
            # as many draws whatever becomes of it
            lost, noise = rng.random() < self.loss, rng.standard_normal(3)
            under_way += [] if lost else [Message(felt.time, place, place + self.error * noise)]
        return reading, tuple(under_way)

    def _read(self, felt: SensorInput, message: Message, speed: float) -> dict[str, Floats]:
        """Return the reading of a message that arrived in the last step.

        The receiver moves steadily in it: its distance was d - v (t - t'), v = dd/dt, when the
        sound came at t', so that t' - t_s = (d - v (t - t_s)) / (c - v).
        """
        offset = felt.position - message.place
        direct = float(np.linalg.norm(offset))
        away = float(felt.rotation @ felt.velocity @ offset) / direct
        delay = (direct - away * (felt.time - message.time)) / (speed - away)
        found = {"modem_position": message.content, "modem_delay": np.array([delay])}
        if self.multipath:
            reflection = (self.surface_reflection, self.bottom_reflection)
            middle = 0.5 * (felt.position + message.place)
            surface = float(felt.around.surface(felt.time, middle[None])[0])
            below = felt.around.ground_ahead(middle, np.array([[0.0, 0.0, -1.0]]))
            levels = surface, float(middle[2] - below[0])
            lengths, strength = mirrored(message.place, felt.position, reflection, levels)
            found["modem_echo_delay"] = (lengths - direct) / speed
            found["modem_echo_level"] = strength
        return found
