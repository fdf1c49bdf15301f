"""Policy that replays a script of keys, recorded in teleoperation or written by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from seals.control.key_events import Event, held_after, read_track
from seals.control.keymap import JOINTS, Stick, stick_of
from seals.errors import ConfigError, suggestion

if TYPE_CHECKING:
    from torch import Tensor


SUFFIXES = (".yaml", ".yml", ".csv")
"""Of files that are scripts of keys."""
_SHARES = {
    "velocity_x": "forward",
    "velocity_y": "left",
    "velocity_z": "up",
    "yaw_rate": "turn",
    "grip": "grip",
}
"""Parts of a stick by the name of an action."""


class PolicyKeys:
    """Policy that replays keys, the same in each environment.

    Args:
        events: of the keys, in the order of their time.
        names: of the numbers of an action, each one that a stick can give.
        rate: decisions a second [Hz].
        device: of the actions.

    Raises:
        ConfigError: an action is none that a stick can give.
    """

    def __init__(
        self, events: Sequence[Event], names: Sequence[str], *, rate: float, device: str
    ) -> None:
        known = [*_SHARES, *(f"joint_{k + 1}" for k in range(JOINTS))]
        strange = [name for name in names if name not in known]
        if strange or not names:
            raise ConfigError(
                f"keys cannot give the action '{', '.join(strange) or 'without a name'}'.\n"
                f"{suggestion(strange[0] if strange else '', known)}"
            )
        self.events, self.names, self.rate, self.device = list(events), list(names), rate, device
        self._count = self._step = 0

    def begin(self, seeds: Sequence[int]) -> None:
        """Restart the script."""
        self._count, self._step = len(seeds), 0

    def act(self, observation: Any) -> Tensor:
        """Return the action of the keys held now."""
        import torch

        now = self._step / self.rate
        held = held_after({}, [event for event in self.events if event.time <= now + 1e-9])
        self._step += 1
        row = _action_of(stick_of(held), self.names)
        return torch.tensor([row] * self._count, dtype=torch.float32, device=self.device)


def _action_of(stick: Stick, names: Sequence[str]) -> list[float]:
    """Return the action of a stick input.

    Example:
        >>> _action_of(Stick(forward=0.5, joints=(0, -1, 0, 0, 0, 0)), ["velocity_x", "joint_2"])
        [0.5, -1.0]
    """
    joints = {f"joint_{k + 1}": share for k, share in enumerate(stick.joints)}
    shares = {name: getattr(stick, part) for name, part in _SHARES.items()} | joints
    return [float(shares[name]) for name in names]


def policy_of_keys(path: Path, environment: Any) -> PolicyKeys:
    """Return the policy of a script of keys.

    Raises:
        ConfigError: the script cannot be read, or keys cannot give the task's actions.
    """
    task = environment.task
    return PolicyKeys(
        read_track(path), list(task.action_names), rate=task.rate, device=environment.device
    )
