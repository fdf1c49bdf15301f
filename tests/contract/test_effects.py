"""Every installed effect keeps the contract, and the contract finds what it is there to find."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import pytest

import seals
from seals import registry
from seals.arrays import Array
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.motion import (
    AddedInertia,
    Drives,
    Inputs,
    JointDrive,
    Joints,
    Medium,
    Motion,
    Wrench,
)
from seals.plugins.actuators.servos import Servos
from seals.plugins.effects.joint_friction import JointFriction
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.sensor_misalignment import SensorMisalignment
from seals.schema import param
from seals.testing import ContractError, check_effect
from seals.testing.effect import MEMORY_ORDER, EffectReport, material_effect
from seals.testing.scenes import Case

EFFECTS = registry.names("effect")
BESIDE = ("downwash",)
"""Effects of other robots, which do nothing to one alone: tests/verification/test_downwash.py."""
DURATION = {"ground_effect": 1.0}
"""Compared time where half a second is too short for the order of the steps to show [s]."""
COARSE = {"steps": (0.004,), "duration": 0.5}
HEADINGS = """

    Equation:
        See the test.

    Args:
        push: size [N].

    Assumptions:
        None.

    Valid range:
        Tests.

    Limitations:
        All.

    References:
        None.

    Example:
        >>> 1
        1
    """


MOVING = ("loads", "inertia", "inertia_change", "flow", "joint_loads", "actuation", "drive_loads")


def hook_of(cls: type[Effect]) -> str | None:
    """Return the first hook by which an effect moves a body; None for what moves none."""
    return next((h for h in MOVING if hasattr(cls, h)), None)


ALONE = [name for name in EFFECTS if name not in BESIDE]
MOVERS = [name for name in ALONE if hook_of(registry.get("effect", name).load())]
ACTUATORS: dict[str, dict[str, float]] = {
    "rotors": {},
    "thrusters": {},
    "servos": {"kp": 0.2, "kd": 0.004},
    "wheels": {"gain": 0.01, "stall_torque": 50.0, "no_load_speed": 1e4},
}


def flipped(cls: type[Effect]) -> type[Effect]:
    """Return a copy of an effect whose first hook has the other sign."""
    hook = hook_of(cls) or "drives"
    law: Callable[..., Any] = getattr(cls, hook)

    def turned(*given: Any) -> Any:
        found = law(*given)
        if hook == "inertia_change":
            return -found
        if isinstance(found, Drives):
            free = given[0].thrust if hook == "actuation" else found.thrust * 0.0
            return found._replace(thrust=2.0 * free - found.thrust)
        output, memory = found
        if isinstance(output, Wrench):
            return Wrench(*(None if part is None else -part for part in output)), memory
        if isinstance(output, AddedInertia):
            return output._replace(weight=-output.weight), memory
        return -output, memory

    return type(f"Flipped{cls.__name__}", (cls,), {hook: staticmethod(turned)})


@pytest.mark.thorough
@pytest.mark.parametrize("name", ALONE)
def test_an_installed_effect_keeps_the_contract(name: str) -> None:
    """Declaration, libraries, purity, power, and twin = simulator at 4 and 1 ms, second order.

    Memory is held over a step in the twin: effects that have some are of first order there.
    """
    report = check_effect(name, steps=(0.004, 0.001), duration=DURATION.get(name, 0.5))
    assert isinstance(report, EffectReport)
    assert {"numpy", "array-api-strict"} <= set(report.libraries)
    assert bool(report.scenes) == (name in MOVERS)
    remembers = material_effect(registry.get("effect", name).load()).memory_size > 0
    assert_order(report, MEMORY_ORDER if remembers else 1.5)


@pytest.mark.parametrize("name", registry.names("actuator"))
def test_an_installed_actuator_keeps_the_contract(name: str) -> None:
    """An actuator is an effect: the same checks, with its drives or joints held at a command."""
    cls = registry.get("actuator", name).load()
    report = check_effect(cls, steps=(0.004, 0.001), duration=0.5, values=ACTUATORS.get(name))
    assert report.scenes
    assert_order(report, 1.5)


def assert_order(report: EffectReport, least: float) -> None:
    """Errors fall by more than this power of the step, or are tiny."""
    worst = [max(max(e) for e in scene.errors) for scene in report.scenes]
    small = [error < 1e-7 for error in worst]
    orders = [scene.orders[0] for scene in report.scenes]
    assert all(order > least or tiny for order, tiny in zip(orders, small, strict=True)), (
        report.table()
    )


@pytest.mark.thorough
@pytest.mark.parametrize("name", MOVERS)
def test_a_sign_flipped_in_one_engine_is_found(name: str) -> None:
    """With the effect's sign turned in the twin alone, the check fails at 4 ms already."""
    cls = registry.get("effect", name).load()
    kind = getattr(cls(), "medium", MediumKind.any)
    scene = "air" if kind is MediumKind.air else "surface"
    case = Case(("air",), True) if hasattr(cls, "joint_loads") else Case((scene,), False)
    with pytest.raises(
        ContractError, match=r"simulator and batch dynamics differ|the batch simulation diverges"
    ):
        check_effect(name, cases=[case], in_twin=flipped(cls), **COARSE)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", registry.names("actuator"))
def test_a_sign_flipped_in_an_actuator_is_found(name: str) -> None:
    """With the actuator's sign turned in the twin alone, the check fails at 4 ms already."""
    cls, values = registry.get("actuator", name).load(), ACTUATORS.get(name)
    with pytest.raises(
        ContractError, match=r"simulator and batch dynamics differ|the batch simulation diverges"
    ):
        check_effect(cls, values=values, in_twin=flipped(cls), **COARSE)  # type: ignore[arg-type]


@dataclass(kw_only=True)
class Push(Effect):  # noqa: D101  the docstring is put together
    __doc__ = "A constant push." + HEADINGS
    push: float = param(1.0, "N", bounds=(-10.0, 10.0), tolerance=0.1, source="test")
    links: list[str] = field(default_factory=lambda: ["*"])

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """A force along x."""
        return Wrench(motion.velocity * 0.0 + params["push"], None), memory


@dataclass(kw_only=True)
class DragLagging(Effect):
    """A drag that follows the velocity after a while.

    Equation:
        F = -c m, m' = (v - m) / tau.

    Args:
        slope: c [N s/m].
        lag: tau [s].

    Assumptions:
        None.

    Valid range:
        Tests.

    Limitations:
        It may drive a body that turns back quickly.

    References:
        None.

    Example:
        >>> DragLagging().lag
        0.2
    """

    slope: float = param(2.0, "N s/m", bounds=(0.0, 100.0), tolerance=0.1, source="test")
    lag: float = param(0.2, "s", bounds=(0.01, 1.0), tolerance=0.1, source="test")
    memory_size: ClassVar[int] = 3

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """The late force now, and the velocity believed in after the step."""
        following = memory + (motion.velocity - memory) * (inputs.step / params["lag"])
        return Wrench(-params["slope"] * memory, None), following


def test_an_effect_with_memory_keeps_the_contract() -> None:
    """Memory advances alike in both engines, to first order in the step."""
    steps, case = (0.004, 0.002, 0.001), Case(("air",), False)
    report = check_effect(DragLagging, steps=steps, duration=1.0, cases=[case])
    assert report.scenes[0].moved > 0.1
    assert all(0.8 < order < 1.3 for order in report.scenes[0].orders)


def hook(law: Callable[..., Any], **more: Any) -> type[Effect]:
    """Return the push with another law."""
    return type("Wrong", (Push,), {"loads": staticmethod(law), **more})


def in_place(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
    """Write into what was given."""
    motion.velocity[:, 0] += 1.0
    return Wrench(motion.velocity * params["push"], None), memory


def mixing(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
    """Let rows see each other."""
    return Wrench(motion.velocity - motion.velocity.mean(axis=0, keepdims=True), None), memory


def numpy_only(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
    """Call NumPy by name."""
    return Wrench(motion.velocity * np.ones((1, 3)) * params["push"], None), memory


def driving(motion: Motion, medium: Medium, inputs: Any, memory: Any, params: Any) -> Any:
    """Push along the motion."""
    return Wrench((motion.velocity - medium.velocity) * params["push"], None), memory


def forgetful(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
    """Hand back memory of another shape."""
    return Wrench(motion.velocity * params["push"], None), memory[:, :1]


def reading_all_rows(motion: Motion, medium: Medium, inputs: Any, memory: Any, params: Any) -> Any:
    """Index a medium of one row."""
    return Wrench(motion.velocity * medium.density[motion.velocity.shape[0] - 1, 0], None), memory


@pytest.mark.parametrize(
    ("law", "more", "words"),
    [
        (in_place, {}, "changes its inputs"),
        (mixing, {}, "of row 0 alone differs from the batch"),
        (numpy_only, {}, "fails under array-api-strict"),
        (driving, {"accounts_for": ("form drag",)}, "W to the body"),
        (forgetful, {"memory_size": 2}, "memory of shape"),
    ],
)
def test_a_wrong_hook_is_refused(law: Callable[..., Any], more: dict[str, Any], words: str) -> None:
    """Each breach of the rules for hooks is refused in words that name it."""
    with pytest.raises(ContractError, match=words):
        check_effect(hook(law, **more), **COARSE)  # type: ignore[arg-type]


def unturned(joints: Joints, medium: Medium, memory: Any, params: Any) -> Any:
    """Multiply rows joint by joint with rows body by body."""
    return -params["push"] * medium.medium_fraction * joints.velocity, memory


def unmoved(joints: Joints, medium: Medium, memory: Any, params: Any) -> Any:
    """Return rows joint by joint instead of one row a body."""
    return medium.medium_fraction * 1.0, memory


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (unturned, r"Wrong: joint_loads fails on arrays of 7 rows(.|\n)*seals\.by_joint"),
        (unmoved, r"Wrong: joint_loads returns an array of shape \(21, 1\)(.|\n)*seals\.by_joint"),
    ],
)
def test_rows_of_the_joints_links_are_refused_as_joints(law: Any, words: str) -> None:
    """A column of the medium at the joints must go through ``by_joint``: the refusal says so."""
    wrong: Any = type("Wrong", (Push,), {"joint_loads": staticmethod(law)})
    with pytest.raises(ContractError, match=words):
        check_effect(wrong, **COARSE)  # type: ignore[arg-type]


def served(joints: Joints, inputs: Any, params: Any) -> JointDrive:
    """Twice the drive of the servos whose law it is."""
    drive = Servos.joint_drive(joints, inputs, params)
    return drive._replace(force=2.0 * drive.force)


def springy(joints: Joints, inputs: Any, params: Any) -> JointDrive:
    """A drive that grows with its joint's position."""
    drive = Servos.joint_drive(joints, inputs, params)
    return drive._replace(stiffness=-drive.stiffness)


def pushing(joints: Joints, inputs: Any, params: Any) -> Array:
    """A resistance along the joint velocity."""
    return -JointFriction.joint_resistance(joints, inputs, params)


@pytest.mark.parametrize(
    ("base", "name", "law", "words"),
    [
        (Servos, "joint_drive", served, "joint_drive within its limit differs by"),
        (Servos, "joint_drive", springy, "joint_drive returns a slope of -"),
        (JointFriction, "joint_resistance", pushing, "joint_resistance returns a slope of -"),
    ],
)
def test_a_law_that_steps_take_implicitly_is_checked(
    base: type[Effect], name: str, law: Any, words: str
) -> None:
    """The implicit form is the law of ``joint_loads``, with slopes that no step lets grow."""
    wrong: Any = type("Wrong", (base,), {name: staticmethod(law)})
    with pytest.raises(ContractError, match=words):
        check_effect(wrong, values=ACTUATORS["servos"] if base is Servos else None, **COARSE)


def askew(params: Any) -> Array:
    """Axes of one row too few numbers."""
    return SensorMisalignment.axis_misalignment(params)[:, :2]


def test_axes_of_another_shape_are_refused() -> None:
    """A turn of sensor axes is a matrix, shape (N, 3, 3)."""
    wrong: Any = type("Wrong", (SensorMisalignment,), {"axis_misalignment": staticmethod(askew)})
    with pytest.raises(ContractError, match=r"axis_misalignment returns an array of shape"):
        check_effect(wrong)


@pytest.mark.parametrize("backend", ["free", "mujoco", "pybullet"])
def test_friction_of_joints_spares_a_body_without_joints(backend: str) -> None:
    """A robot that has none falls as it does without the effect."""
    if backend not in registry.names("backend"):
        pytest.skip(f"{backend} is not installed")
    words = ["robot=ball", "water=none", f"backend={backend}"]
    falls = []
    for more in ([], ["+effect@effects.worn=joint_friction", "effects.worn.coulomb=0.1"]):
        world = seals.make([*words, *more])
        for _ in range(20):
            world.step()
        (actor,) = world.actors.values()
        falls.append(np.array(actor.body.read().position))
    assert falls[0].tolist() == falls[1].tolist()


def test_a_medium_of_one_row_must_stand_for_all() -> None:
    """A law that indexes rows of the medium fails on calm air, where one row stands for all."""
    with pytest.raises((ContractError, IndexError)):
        check_effect(hook(reading_all_rows), **COARSE)  # type: ignore[arg-type]


def test_a_state_kept_outside_memory_is_refused() -> None:
    """A law that counts its calls gives another result the second time."""
    calls: list[int] = []

    def counting(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
        calls.append(1)
        return Wrench(motion.velocity * 0.0 + float(len(calls)), None), memory

    with pytest.raises(ContractError, match="different result when called again"):
        check_effect(hook(counting), **COARSE)  # type: ignore[arg-type]


def test_an_effect_that_does_nothing_is_refused() -> None:
    """Agreement of two engines about nothing is no agreement."""

    def idle(motion: Motion, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
        return Wrench(motion.velocity * 0.0, None), memory

    with pytest.raises(ContractError, match="not meaningful"):
        check_effect(hook(idle), cases=[Case(("air",), False)], **COARSE)  # type: ignore[arg-type]


def test_a_jump_in_the_law_is_refused() -> None:
    """A force that depends on the step converges to nothing."""

    def stepping(motion: Motion, medium: Any, inputs: Inputs, memory: Any, params: Any) -> Any:
        return Wrench(motion.velocity * 0.0 + 50.0 * inputs.step, None), memory

    with pytest.raises(ContractError, match="simulator and batch dynamics differ"):
        check_effect(hook(stepping), cases=[Case(("air",), False)], **COARSE)  # type: ignore[arg-type]


def test_a_bare_float_and_a_missing_heading_are_refused() -> None:
    """Fields without unit and docstrings without headings are named."""

    @dataclass(kw_only=True)
    class Bare(Push):
        size: float = 1.0

    @dataclass(kw_only=True)
    class Silent(Push):
        """Nothing."""

        accounts_for: ClassVar[tuple[str, ...]] = ()

    with pytest.raises(ContractError, match="size have no unit and bounds"):
        check_effect(Bare)
    with pytest.raises(ContractError, match=r"headings \(none\)"):
        check_effect(Silent)


def test_a_class_can_be_checked_before_it_is_installed() -> None:
    """A class stands for a name, and the caller's values rule."""
    case = Case(("air",), False)
    report = check_effect(
        DragLinear,
        values={"coefficient_x": 2.0, "coefficient_y": 2.0, "coefficient_z": 2.0},
        cases=[case],
        **COARSE,  # type: ignore[arg-type]
    )
    assert report.name == "DragLinear"
    assert report.scenes[0].moved > 0.1
    assert "air" in report.table()
