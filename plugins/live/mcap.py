"""Recording of a run as ROS 2 messages in an MCAP file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.errors import optional_import
from seals.plugins.live.ros_messages import Message, Messages
from seals.run.live_output import Beat
from seals.run.settings import RunSettings
from seals.schema import param
from seals.world import World

FILE = "ros2.mcap"
"""Name of the file in the run folder."""


class Recording:
    """MCAP file with messages of ROS 2 and their definitions.

    Args:
        path: of the file.
        store: message types.

    Raises:
        MissingExtra: mcap is not installed.
    """

    def __init__(self, path: Path, store: Any) -> None:
        with optional_import("MCAP needs mcap", "Install it: pip install 'aam-seals[ros2]'"):
            from mcap.writer import Writer
        self._file, self._store = path.open("wb"), store
        self._writer: Any = Writer(self._file)
        self._writer.start(profile="ros2", library="seals")
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def write(self, time: float, message: Message) -> None:
        """Write a message at a simulated time [s]."""
        topic, kind, value = message
        if topic not in self._channels:
            if kind not in self._schemas:
                text, _ = self._store.generate_msgdef(kind)
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", text.encode())
            self._channels[topic] = self._writer.register_channel(
                f"/{topic}", "cdr", self._schemas[kind]
            )
        stamp, raw = round(time * 1e9), bytes(self._store.serialize_cdr(value, kind))
        self._writer.add_message(self._channels[topic], stamp, raw, stamp)

    def close(self) -> None:
        """End the file."""
        self._writer.finish()
        self._file.close()


@dataclass(kw_only=True)
class LiveMcap:
    """Records a run as messages of ROS 2 in `ros2.mcap` of its folder.

    Args:
        rate: of pose, frames and joints [Hz]; readings come at the rates of their sensors.
    """

    rate: float = param(100.0, "Hz", bounds=(0.1, 1e4), tolerance=0.0, source="chosen", fit=False)

    def open(self, settings: RunSettings, folder: Path) -> None:
        """Begin the file."""
        self._messages, self._beat = Messages(), Beat(self.rate)
        folder.mkdir(parents=True, exist_ok=True)
        self._recording = Recording(folder / FILE, self._messages.store)

    def tick(self, world: World) -> None:
        """Write new rows."""
        found = list(self._messages.readings(world))
        if self._beat.due(world.time):
            found += [self._messages.clock(world.time), *self._messages.state(world)]
        for message in found:
            self._recording.write(world.time, message)

    def close(self) -> None:
        """End the file."""
        self._recording.close()
