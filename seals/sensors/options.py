"""Optional attributes of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from seals.arrays import Floats

if TYPE_CHECKING:
    from seals.sensors.protocol import SensorInput


class SensorOptions:
    """Optional attributes of a sensor and their defaults; see `options_of`."""

    inertial: ClassVar[bool] = True
    """Whether it reads ``specific_force`` or ``angular_acceleration``; else these are zero."""

    idles: ClassVar[bool] = False
    """Whether it does nothing while no reading is due; it is not called then."""

    late: ClassVar[bool] = False
    """Whether it can be asked for an earlier instant: it asks ``board`` and ``camera`` nothing.

    A robot that is alone in its scene makes several steps at once where all its sensors can.
    """

    sees: ClassVar[bool] = False
    """Whether it is a camera, which gets a view of the scene where the run has a renderer."""

    travels: ClassVar[bool] = False
    """Whether a reading arrives some steps after it was due, as a message by sound does."""

    records: ClassVar[bool] = False
    """Whether it makes images itself, without a renderer, to be kept next to the log."""

    latency: float = 0.0
    """Time from the taking of a reading to its arrival at guide and controller [s]."""

    dropout: float = 0.0
    """Share of the readings that are lost [1]."""

    outage: float = 0.0
    """Mean length of a loss, at least one reading; 0 loses each by itself [s]."""

    position: Sequence[float] | None = None
    """Place in its link [m]; None for a sensor without one."""

    rpy: Sequence[float] | None = None
    """Roll, pitch and yaw of its axes in its link [rad]; None for a sensor without axes."""

    def bind(self, outfit: Any) -> None:
        """Receive the robot's equipment; called once, before ``channels``."""

    def draws(self) -> int | None:
        """Return how many standard normal numbers a reading takes; None without `passed`."""
        return None

    def passed(self, memory: Any, noise: Floats) -> Any:
        """Return the memory after readings that nobody looks at, each at the end of a step.

        Nothing touched in these steps, and nothing is late or lost.

        Args:
            memory: before.
            noise: what the readings would have drawn, shape (N, `draws`).
        """
        raise NotImplementedError

    def taken(self, felt: SensorInput, memory: Any, noise: Floats) -> tuple[dict[str, Floats], Any]:
        """Return the same readings, a row each, and the memory after them.

        Needed where `draws` tells a number.

        Args:
            felt: motion of the sensor's link at their instants, arrays of a row each.
            memory: before.
            noise: what the readings would have drawn, shape (N, `draws`).
        """
        raise NotImplementedError

    def described(self) -> dict[str, Any]:
        """Return the metadata of the images of ``sees`` or ``records``."""
        return {}
