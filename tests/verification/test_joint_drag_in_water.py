"""Joints that a hook sees with motion and medium, and links that see the joints: closed forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.arrays import Array, columns, namespace
from seals.batch import BatchDynamics
from seals.batch.holding import hold
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.errors import PhysicsError
from seals.motion import Joints, Medium, Wrench, by_joint
from seals.plugins.backends.free import BackendFree
from seals.plugins.backends.pybullet import BackendPybullet
from seals.run import build_twin
from seals.run.assembly import build_model
from seals.schema import param

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

MASS, LENGTH, MOMENT, RADIUS = 0.1, 0.4, 0.002, 0.05
INERTIA = MOMENT + MASS * LENGTH**2
SPEED, VISCOUS = 1.5, 0.036
ENGINES = ("pybullet", "free", "twin")


@dataclass(kw_only=True)
class JointDrag(Effect):
    """Drag on a joint, linear in its speed and in the immersion of the link that it moves.

    Args:
        viscous: coefficient [N m s/rad].
        medium: in which it acts.
    """

    viscous: float = param(VISCOUS, "N m s/rad", bounds=(0.0, 1.0), tolerance=0.0, source="chosen")
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("joint drag",)

    @staticmethod
    def joint_loads(
        medium: Medium, joints: Joints, params: Parameters, memory: Array
    ) -> tuple[Array, Array]:
        """Generalised force against the joint velocity [N m]; arguments in an order of its own."""
        return -params["viscous"] * by_joint(
            medium.medium_fraction, joints
        ) * joints.velocity, memory


@dataclass(kw_only=True)
class Wobble(Effect):
    """Force on a link along x that goes with the cosine of the first joint.

    Args:
        size: largest force [N].
    """

    size: float = param(0.5, "N", bounds=(-10.0, 10.0), tolerance=0.0, source="chosen")
    accounts_for: ClassVar[tuple[str, ...]] = ("wobble",)

    @staticmethod
    def loads(joints: Joints, params: Parameters, memory: Array) -> tuple[Wrench, Array]:
        """Force of the joint's angle."""
        force = params["size"] * namespace(joints.position).cos(joints.position[:, 0:1])
        return Wrench(columns(force[:, 0], force[:, 0] * 0.0, force[:, 0] * 0.0), None), memory


def three_arms(bench: Bench) -> Any:
    """Return a fixed base with arms that swing level: half immersed, dry and deep."""
    parts, hulls = [bench.link("base", 1.0, (1.0,) * 3)], {}
    for name, height in (("half", 0.0), ("dry", 1.0), ("deep", -1.0)):
        parts += [
            bench.link(name, MASS, (MOMENT,) * 3, centre=(LENGTH, 0, 0)),
            f'<joint name="{name}" type="continuous"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="0 0 {height}"/><axis xyz="0 0 1"/></joint>',
        ]
        hulls[name] = [("sphere", [RADIUS], [LENGTH, 0.0, 0.0])]
    return bench.robot(*parts, hulls=hulls, fixed_base=True)


def run_in(bench: Bench, engine: str, settings: Any) -> Any:
    """Run settings in an engine of `ENGINES`."""
    settings.backend = BackendFree(passable=True) if engine == "free" else BackendPybullet()
    return bench.run("twin" if engine == "twin" else "world", settings)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_joint_of_an_immersed_arm_decays(bench: Bench, engine: str) -> None:
    """I q'' = -c s q': q' = w exp(-c s t / I), with s = 1/2, 0 and 1 for the three arms."""
    step = 0.004
    run = run_in(
        bench,
        engine,
        bench.settings(
            three_arms(bench),
            {"drag": JointDrag()},
            step=step,
            duration=1.0,
            weight=False,
            environment={"water_level": 0.0},
            joint_velocity=[SPEED] * 3,
        ),
    )
    rate = VISCOUS / INERTIA * np.array([0.5, 0.0, 1.0])
    decay = np.exp(-rate * run.time[:, None])
    # second order of the leapfrog, fourth of the twin: (rate h)^p of the decay's exponent
    error = rate.max() * step
    tolerance = {"twin": error**4}.get(engine, error**2)
    print(engine, np.abs(run.joint_velocity / SPEED - decay).max(), tolerance)
    assert_allclose(run.joint_velocity / SPEED, decay, atol=tolerance)
    swept = np.where(rate > 0.0, (1.0 - decay) / np.maximum(rate, 1e-9), run.time[:, None])
    assert_allclose(run.joints / SPEED, swept, atol=tolerance)


def test_a_batch_of_arms_decays_each_at_its_own_rate(bench: Bench) -> None:
    """Rows joint by joint are those of the right body: each has a coefficient of its own."""
    settings = bench.settings(
        three_arms(bench),
        {"drag": JointDrag()},
        weight=False,
        environment={"water_level": 0.0},
        joint_velocity=[SPEED] * 3,
    )
    given = np.array([0.0, 0.02, 0.04, 0.08])
    twin, state = build_twin(settings, batch=4, values={"drag.viscous": given})
    step, count = 0.01, 50
    for k in range(count):
        state, _ = twin.step(state, k * step, step)
    rate = given[:, None] / INERTIA * np.array([0.5, 0.0, 1.0])
    expected = SPEED * np.exp(-rate * step * count)
    assert_allclose(state.joint_velocity, expected, atol=SPEED * (rate.max() * step) ** 4)


@dataclass(kw_only=True)
class Unturned(JointDrag):
    """The same drag without `by_joint`: three joints make three rows of three forces."""

    @staticmethod
    def joint_loads(
        medium: Medium, joints: Joints, params: Parameters, memory: Array
    ) -> tuple[Array, Array]:
        """Force of the wrong shape."""
        return -params["viscous"] * medium.medium_fraction * joints.velocity, memory


@pytest.mark.parametrize("engine", ENGINES)
def test_a_force_of_the_wrong_shape_is_refused(bench: Bench, engine: str) -> None:
    """The refusal names the effect and its class, both shapes and what to call."""
    settings = bench.settings(
        three_arms(bench),
        {"drag": Unturned()},
        duration=0.02,
        weight=False,
        environment={"water_level": 0.0},
    )
    words = r"effects\.drag: joint_loads of Unturned .*\(3, 3\) for 1 x 3(.|\n)*seals\.by_joint"
    with pytest.raises(PhysicsError, match=words):
        run_in(bench, engine, settings)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_force_on_a_link_follows_a_joint(bench: Bench, engine: str) -> None:
    """A balanced wheel turns at w and F = f cos(w t): x = f / (m w^2) (1 - cos(w t))."""
    spin, mass, step = 4.0, 2.0, 0.002
    robot = bench.robot(
        bench.link("base", mass - 0.5, (0.02,) * 3),
        bench.link("wheel", 0.5, (0.01,) * 3),
        '<joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/>'
        '<origin xyz="0 0 0"/><axis xyz="0 0 1"/></joint>',
    )
    run = run_in(
        bench,
        engine,
        bench.settings(
            robot,
            {"wobble": Wobble()},
            step=step,
            duration=2.0,
            weight=False,
            position=[0, 0, 5],
            joint_velocity=[spin],
        ),
    )
    reach = 0.5 / (mass * spin**2)
    expected = reach * (1.0 - np.cos(spin * run.time))
    print(engine, np.abs(run.position[:, 0] - expected).max() / reach)
    order = 4 if engine == "twin" else 2
    # errors of the phase grow with the number of radians
    bound = spin * run.time[-1] * (spin * step) ** order
    assert_allclose(run.position[:, 0], expected, atol=reach * bound)


def test_a_force_on_a_link_follows_a_held_joint(bench: Bench) -> None:
    """With the joints held, a law is given their places: F = f cos(q), a = F / m."""
    angle = 0.7
    robot = bench.robot(
        bench.link("base", 1.5, (0.02,) * 3),
        bench.link("wheel", 0.5, (0.01,) * 3),
        '<joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/>'
        '<origin xyz="0 0 0"/><axis xyz="0 0 1"/></joint>',
    )
    settings = bench.settings(robot, {"wobble": Wobble()}, weight=False)
    whole, effects = hold(*build_model(settings), [angle])
    twin = BatchDynamics(whole, effects, settings.environment, settings.wave, batch=3)
    assert_allclose(
        twin.rates(twin.start(), 0.0).velocity, [[0.5 * np.cos(angle) / 2.0, 0.0, 0.0]] * 3
    )
