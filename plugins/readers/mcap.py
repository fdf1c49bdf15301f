"""Reader of MCAP recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.plugins.readers.mcap_file import messages
from seals.plugins.readers.recording import Recording, Source


@dataclass(kw_only=True)
class ReaderMcap(Recording):
    """Recordings in one MCAP file: ROS 2 messages and JSON topics.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``Imu``, ``JointState``, ``BatteryState``,
        ``MagneticField`` and ``Range``; others by ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships, and Protobuf, are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: the file.
    """

    source: ClassVar[Source] = staticmethod(messages)
    kind: ClassVar[str] = "MCAP"
