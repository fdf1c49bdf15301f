"""Key map of teleoperation: keys, axes and buttons."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

JOINTS = 6
"""Joints of one arm that have keys."""


class Stick(NamedTuple):
    """Stick input of a pilot, as fractions of full deflection.

    Args:
        forward: along the heading [1].
        left: across it [1].
        up: [1].
        turn: anticlockwise seen from above [1].
        joints: of the chosen arm, `JOINTS` of them [1].
        grip: closing, of all grippers [1].
        stow: whether the arms shall go to rest.
        end: whether the session shall end.
    """

    forward: float = 0.0
    left: float = 0.0
    up: float = 0.0
    turn: float = 0.0
    joints: tuple[float, ...] = (0.0,) * JOINTS
    grip: float = 0.0
    stow: bool = False
    end: bool = False

    @property
    def moves(self) -> bool:
        """Return whether the input moves the robot's body."""
        return any((self.forward, self.left, self.up, self.turn))


KEYS: Mapping[str, tuple[str, float]] = {
    "w": ("forward", 1.0),
    "s": ("forward", -1.0),
    "a": ("left", 1.0),
    "d": ("left", -1.0),
    "r": ("up", 1.0),
    "f": ("up", -1.0),
    "q": ("turn", 1.0),
    "e": ("turn", -1.0),
    "u": ("joint_1", 1.0),
    "j": ("joint_1", -1.0),
    "i": ("joint_2", 1.0),
    "k": ("joint_2", -1.0),
    "o": ("joint_3", 1.0),
    "l": ("joint_3", -1.0),
    "y": ("joint_4", 1.0),
    "h": ("joint_4", -1.0),
    "t": ("joint_5", 1.0),
    "g": ("joint_5", -1.0),
    "n": ("joint_6", 1.0),
    "b": ("joint_6", -1.0),
    "c": ("grip", 1.0),
    "v": ("grip", -1.0),
    "x": ("stow", 1.0),
    "tab": ("next arm", 1.0),
    "escape": ("end", 1.0),
}
"""Keys: what each acts on, and how much of full."""
PAD: Mapping[str, tuple[str, float]] = {
    # sticks of the usual pads count positive to the right and towards the person
    "axis_0": ("turn", -1.0),
    "axis_1": ("up", -1.0),
    "axis_2": ("left", -1.0),
    "axis_3": ("forward", -1.0),
    "button_0": ("grip", 1.0),
    "button_1": ("grip", -1.0),
    "button_2": ("joint_1", 1.0),
    "button_3": ("joint_1", -1.0),
    "button_4": ("joint_2", -1.0),
    "button_5": ("joint_2", 1.0),
    "button_6": ("stow", 1.0),
    "button_7": ("end", 1.0),
}
"""Axes and buttons of a gamepad."""
NEXT_ARM = "tab"
CONTROLS = (*KEYS, *PAD)
"""Names of all controls that do something."""
_WORDS = {
    "forward": "forward, back",
    "left": "left, right",
    "up": "up, down",
    "turn": "turn left, right",
    "grip": "close, open the grippers",
    "stow": "arms to rest",
    "next arm": "choose the next arm",
    "end": "end the session",
}


def is_control(name: str) -> bool:
    """Return whether a name is that of a key, axis or button of a script."""
    return name in CONTROLS or bool(re.fullmatch(r"(axis|button)_\d+", name))


def stick_of(held: Mapping[str, float]) -> Stick:
    """Return the stick input of the held controls.

    Example:
        >>> stick_of({"w": 1.0, "q": 1.0}).forward, stick_of({"axis_3": -0.5}).forward
        (1.0, 0.5)
    """
    sums: dict[str, float] = {}
    for table in (KEYS, PAD):
        for control, (action, amount) in table.items():
            if control in held:
                sums[action] = sums.get(action, 0.0) + amount * held[control]

    def share(action: str) -> float:
        return min(max(sums.get(action, 0.0), -1.0), 1.0)

    return Stick(
        forward=share("forward"),
        left=share("left"),
        up=share("up"),
        turn=share("turn"),
        joints=tuple(share(f"joint_{k + 1}") for k in range(JOINTS)),
        grip=share("grip"),
        stow=share("stow") > 0.5,
        end=share("end") > 0.5,
    )


def table() -> str:
    """Return the keys as text, one line for each pair."""
    lines = []
    for name, controls in (("keyboard", KEYS), ("gamepad", PAD)):
        pairs: dict[str, list[str]] = {}
        for control, (action, _) in controls.items():
            pairs.setdefault(action, []).append(control)
        lines.append(f"  {name}")
        for action, keys in pairs.items():
            words = _WORDS.get(action, action.replace("_", " ") + " of the arm, there and back")
            lines.append(f"    {' '.join(keys):<22}{words}")
    return "\n".join(lines)
