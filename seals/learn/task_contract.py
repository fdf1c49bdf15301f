"""Promises that a task keeps, checked on a batch of states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.contract import call_twice, require
from seals.learn.task import ActionMode, Draw, Instant, Task, WorldTask
from seals.robot.model import RobotModel

COUNT = 5
_LAWS = (
    "bind",
    "draw",
    "target",
    "observation",
    "reward",
    "distance",
    "ended",
    "effort",
    "scripted_policy",
)
"""Methods that a field of the same name would hide."""


def require_laws(name: str, made: Any) -> None:
    """Refuse a task with values in the place of laws.

    Raises:
        ContractError: a field hides a law.
    """
    for law in _LAWS:
        good = callable(getattr(made, law, None))
        require(
            good, name, f"has a value instead of the function {law}", "Name the field otherwise."
        )


def require_task(name: str, made: Task, model: RobotModel) -> None:
    """Refuse a task that breaks a promise: draws, shapes, finite numbers, laws without a memory.

    Args:
        name: of the task, for the words of a refusal.
        made: bound to the robot.
        model: of the robot.

    Raises:
        ContractError: a promise does not hold.
    """
    require_laws(name, made)
    actions, seen = len(made.action_names), len(made.observation_names)
    require(
        made.rate > 0.0 and made.duration > 0.0,
        name,
        f"has a rate of {made.rate} Hz and episodes of {made.duration} s",
        "Give it both, above zero.",
    )
    posture = np.asarray(made.posture)
    require(
        posture.shape == (model.tree.joints,),
        name,
        f"holds {posture.shape} joint positions",
        f"Return one per joint: {model.tree.joints}.",
    )
    draw = made.draw(np.random.default_rng(7), COUNT)
    _require_draw(name, draw, made.draw(np.random.default_rng(7), COUNT))
    # quantities of full worlds that the task asks for, all alike
    hands = len(model.grippers)
    tips = sum(len(hand.tips) for hand in model.grippers.values())
    wide = {"phase": 2 * len(model.legs), "grip": hands, "closed": hands, "touch": tips}
    asked = made.knows if isinstance(made, WorldTask) else ()
    facts = {fact: np.full((COUNT, wide.get(fact, 1)), 0.25) for fact in asked}
    before, now = (_instant(made, draw, facts, actions, time) for time in (0.0, 0.1))
    laws: dict[str, tuple[Any, tuple[Any, ...], list[tuple[int, ...]]]] = {
        "target": (made.target, (draw.goal, now.time), [(COUNT, 3), (COUNT, 3)]),
        "observation": (made.observation, (now,), [(COUNT, seen)]),
        "reward": (made.reward, (now, before, np.zeros((COUNT, 2))), [(COUNT,), (COUNT, 2)]),
        "distance": (made.distance, (now,), [(COUNT,)]),
        "ended": (made.ended, (now, np.zeros((COUNT, 2))), [(COUNT,)]),
        "scripted_policy": (made.scripted_policy, (now,), [(COUNT, actions)]),
    }
    if made.actions is not ActionMode.velocity:
        # only scripts that command a velocity are written
        del laws["scripted_policy"]
    elif not hasattr(made, "aim"):
        laws["command"] = (made.command, (now.action, now), [(COUNT, 3), (COUNT, 1)])
    if made.effort(now) is not None:
        laws["effort"] = (made.effort, (now,), [(COUNT,)])
    for law, (call, given, shapes) in laws.items():
        found = _arrays(call_twice(name, law, call, *given))
        got = [array.shape for array in found]
        require(got == shapes, name, f"{law} returns shapes {got}", f"Return {shapes}.")
        finite = all(bool(np.isfinite(array).all()) for array in found)
        require(
            finite, name, f"{law} returns numbers that are not finite", "Return finite numbers."
        )
        if law == "scripted_policy":
            size = float(np.abs(found[0]).max())
            require(
                size <= 1.0,
                name,
                f"its scripted policy returns actions of size {size:.3g}",
                "Hold it to 1.",
            )


def _require_draw(name: str, first: Draw, second: Draw) -> None:
    same = all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    require(
        same,
        name,
        "draws different starts for the same seed",
        "Draw only from the given generator.",
    )
    shapes = {"position": (COUNT, 3), "yaw": (COUNT, 1), "velocity": (COUNT, 3)}
    for key, shape in shapes.items():
        values = np.asarray(getattr(first, key))
        good = values.shape == shape and bool(np.isfinite(values).all())
        require(good, name, f"draws {key} of shape {values.shape}", f"Return finite {shape}.")
    rows = np.shape(first.goal)[:1]
    require(rows == (COUNT,), name, f"draws goals of {rows} rows", f"Return {COUNT} rows.")


def _instant(
    task: Task, draw: Draw, facts: Mapping[str, Floats], actions: int, time: float
) -> Instant:
    """States a little after the start of every episode, each turned by its heading."""
    c, s = np.cos(draw.yaw[:, 0]), np.sin(draw.yaw[:, 0])
    turn = np.zeros((COUNT, 3, 3))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
    turn[:, 2, 2] = 1.0
    clock = np.full((COUNT, 1), time)
    target, velocity = task.target(draw.goal, clock)
    place = draw.position + time * draw.velocity + time * np.array([0.3, -0.2, 0.1])
    return Instant(
        time=clock,
        position=place,
        rotation=turn,
        velocity=draw.velocity,
        angular_velocity=np.full((COUNT, 3), 0.1),
        tool=place - np.array([0.0, 0.0, 0.2]),
        target=np.asarray(target),
        target_velocity=np.asarray(velocity),
        submersion=np.linspace(0.0, 1.0, COUNT)[:, None],
        action=np.full((COUNT, actions), time),
        start=np.ones((COUNT, 1)),
        facts=facts,
    )


def _arrays(thing: Any) -> list[Floats]:
    if isinstance(thing, Mapping):
        return [array for part in thing.values() for array in _arrays(part)]
    if isinstance(thing, tuple | list):
        return [array for part in thing for array in _arrays(part)]
    return [np.asarray(thing)]
