"""Reader of rosbag2 recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.plugins.readers.recording import Recording, Source
from seals.plugins.readers.rosbag2_file import messages


@dataclass(kw_only=True)
class ReaderRosbag2(Recording):
    """Recordings of ROS 2: a folder with ``metadata.yaml``, or one file ``.db3`` or ``.mcap``.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``Imu``, ``JointState``, ``BatteryState``,
        ``MagneticField`` and ``Range``; others by ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: folder or file.
    """

    source: ClassVar[Source] = staticmethod(messages)
    kind: ClassVar[str] = "rosbag2"
