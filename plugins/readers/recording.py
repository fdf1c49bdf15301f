"""Readers of recorded messages: MCAP, rosbag2 and bags of ROS 1."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seals.field_roles import roles
from seals.logs.log import Log
from seals.plugins.readers.mcap_file import messages as mcap_messages
from seals.plugins.readers.ros_streams import Choice, Message, gather
from seals.plugins.readers.rosbag1_file import messages as rosbag1_messages
from seals.plugins.readers.rosbag2_file import messages as rosbag2_messages
from seals.plugins.readers.streams import ReaderTopics, by_topic, finished

Source = Callable[[Path, Callable[[str, str, str], bool], dict[str, str]], Iterator[Message]]
"""Yields the wanted messages of a path, and fills in which topics it has."""


@roles(data="clock")
@dataclass(kw_only=True)
class Recording(ReaderTopics):
    """Base of readers of recorded messages; subclasses interpret the messages.

    Args:
        topics: known topics to read; empty for all.
        columns: ``TOPIC/FIELD`` (``/tank/level/data``, ``/wheels/speed[2]``) -> column of the log.
        clock: ``header`` takes the stamp inside a message, ``record`` the time of recording.
    """

    source: ClassVar[Source]
    clock: str = "header"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the recording.

        Raises:
            LogError: nothing was given, or the recording cannot be used.
            MissingExtra: the packages of the extra ``logs`` are absent.
        """
        path, chosen, present = self.given(source), self.chosen(), dict[str, str]()
        choice = Choice(topics=self.topics, fields=by_topic(chosen), map=chosen, clock=self.clock)
        streams = gather(
            type(self).source(path, choice.wants, present), present, choice, where=str(path)
        )
        return [finished(streams, path, meta=self.meta, name=self.name, licence=self.licence)]


@dataclass(kw_only=True)
class ReaderMcap(Recording):
    """Recordings in one MCAP file: ROS 2 messages and JSON topics.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships, and Protobuf, are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: the file.
    """

    source: ClassVar[Source] = staticmethod(mcap_messages)
    kind: ClassVar[str] = "MCAP"


@dataclass(kw_only=True)
class ReaderRosbag2(Recording):
    """Recordings of ROS 2: a folder with ``metadata.yaml``, or one file ``.db3`` or ``.mcap``.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: folder or file.
    """

    source: ClassVar[Source] = staticmethod(rosbag2_messages)
    kind: ClassVar[str] = "rosbag2"


@dataclass(kw_only=True)
class ReaderRosbag1(Recording):
    """Recordings of ROS 1 (``.bag``, format 2.0), packed or not.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 1 ships (Noetic) are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: the file.
    """

    source: ClassVar[Source] = staticmethod(rosbag1_messages)
    kind: ClassVar[str] = "bag"
