"""Calls of each hook of an effect at one instant."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace
from seals.effects.binding import EffectSet
from seals.effects.effect import Effect, Parameters
from seals.effects.hooks import pick_of
from seals.effects.scene import Scene
from seals.environment.sampler import EnvironmentSampler, WaterColumn
from seals.environment.waves import Sea
from seals.environment.wetting import WettingNone
from seals.motion import Drives, JointDrive, Joints, Reading, Timing
from seals.pytree import mapped
from seals.testing.instants import JOINTS, Instant

DRIVEN = ("actuation", "drive_loads", "command")
"""Hooks that need actuators on the link."""

QUIET = ("measure", "pose_turn", "axis_misalignment", "timing")
"""Hooks that do not move the body."""

WIDTHS: dict[str, tuple[tuple[int, ...], ...]] = {
    "loads": ((3,), (3,)),
    "drive_loads": ((3,), (3,)),
    "inertia": ((6, 6), (1,), (6, 6), (1,)),
    "inertia_change": ((6, 6),),
    "flow": ((3,),),
    "measure": ((3,), (3,), (3,), (3,)),
    "pose_turn": ((3,),),
    "axis_misalignment": ((3, 3),),
    "timing": ((1,), (1,), (1,), (1,)),
}
"""Shape of each output for one row; other hooks have that of the joints or drives."""


def call_hook(
    effect: Effect, hook: str, instant: Instant, memory: Array | None, params: Parameters
) -> tuple[Any, Any]:
    """Return output and new memory of one hook; without memory hooks, the memory as given.

    A battery gets the sum of the drives' thrusts as the power in watts.
    """
    law, now = getattr(effect, hook), instant
    plain = {
        "actuation": (now.drives, now.motion, now.medium, now.inputs),
        "drives": (now.inputs,),
        "measure": (now.reading,),
        "inertia_change": (now.motion.body,),
        "joint_drive": (now.joints, now.inputs),
        "joint_resistance": (now.joints, now.inputs),
        "pose_turn": (),
        "axis_misalignment": (),
        "timing": (),
        "command": (now.drives.thrust, now.drives.radius),
    }
    if hook == "battery_update":
        thrust = now.drives.thrust
        kept = law(
            namespace(thrust).sum(abs(thrust), axis=1, keepdims=True), now.inputs, memory, params
        )
        return kept, kept
    if hook in plain:
        return law(*plain[hook], params), memory
    motion, medium = now.motion, now.medium
    if hook == "joint_loads":
        motion, medium = (_by_joints(x, now.joints) for x in (motion, medium))
    given: tuple[Any, ...] = (motion, medium, now.joints, now.inputs, memory, params)
    given = (now.drives, *given) if hook == "drive_loads" else (*given, _scene(now))
    output, kept = law(*pick_of(effect, hook)(given))
    return output, kept


class _Calm:
    """Water at rest."""

    @staticmethod
    def at(position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points."""
        return Sea(level + 0.0 * position[:, 0:1], None, None, None, None, None)


def _scene(now: Instant) -> Scene:
    """A scene of calm water up to the height zero, without flows."""
    volume = now.motion.body.volume
    column = WaterColumn.of_profiles([[0.0, 20.0]], [[0.0, 0.0]], None)
    around = EnvironmentSampler(
        gravity=9.81,
        air_density=1.2,
        air_viscosity=1.8e-5,
        water_level=0.0,
        column=column,
        waves=_Calm(),
        wetting=WettingNone(),
        volume=volume,
    )
    return Scene(around, EffectSet(()), now.motion, now.inputs)


def _by_joints(bundle: Any, joints: Joints) -> Any:
    """Repeat the rows of a bundle for every joint; fields of a single row stay."""
    count = joints.velocity.shape[1]
    return mapped(
        bundle, lambda x: x if x.shape[0] == 1 else namespace(x).concat([x] * count, axis=0)
    )


def nothing(hook: str, instant: Instant) -> Any:
    """Return the neutral output of a hook; None if it is not known."""
    return {
        "actuation": instant.drives,
        "command": instant.drives.thrust,
        "measure": instant.reading,
        "pose_turn": instant.reading.angular_velocity * 0.0,
        "axis_misalignment": instant.motion.rotation * 0.0 + np.eye(3),
        "inertia_change": instant.motion.body.mass[:, :, None] * 0.0,
        "timing": Timing(*(instant.motion.body.mass[:1] * 0.0,) * 4),
    }.get(hook)


def expected_shapes(hook: str, output: Any, rows: int) -> list[tuple[tuple[int, ...], ...]]:
    """Return the allowed shapes of every array in an output, in order."""
    if isinstance(output, Drives):
        count = output.thrust.shape[-1]
        per_row: tuple[tuple[int, ...], ...] = ((1, count), (rows, count))
        return [((count, 3),), ((count, 3),), ((count,),), per_row, per_row, per_row]
    parts = tuple(output) if isinstance(output, tuple) else (output,)
    arrays = [x for x in parts if not isinstance(x, int | float)]
    if hook in ("joint_loads", "joint_drive", "joint_resistance"):
        return [((1, 1), (rows, 1), (1, JOINTS), (rows, JOINTS))] * len(arrays)
    widths = WIDTHS.get(hook)
    if widths is None:
        return [((1, *x.shape[1:]), (rows, *x.shape[1:])) for x in arrays]
    used = [w for x, w in zip(parts, widths, strict=True) if not isinstance(x, int | float)]
    return [((1, *width), (rows, *width)) for width in used]


def is_bundle(hook: str, output: Any) -> bool:
    """Return whether an output has the type that its hook requires."""
    promised: dict[str, type] = {
        "actuation": Drives,
        "drives": Drives,
        "joint_drive": JointDrive,
        "measure": Reading,
        "timing": Timing,
    }
    return hook not in promised or isinstance(output, promised[hook])
