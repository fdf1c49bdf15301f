"""Worlds with contacts in one batch, on Warp's processor device, against MuJoCo's own worlds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.arrays import namespace
from seals.backend import Configuration
from seals.config.compose import compose
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.learn.environments.batch import Environments
from seals.learn.environments.build import build_learning
from seals.learn.environments.warp_worlds import WalkingWorlds
from seals.learn.environments.world import FullWorld, WorldsInTurn
from seals.motion import Inputs, Joints
from seals.plugins.backends.mujoco_warp.laws import kernel_of
from seals.pytree import leaves
from seals.run.assembly import ROBOT
from seals.scalar_compiler import followed, statements_of

torch = pytest.importorskip("torch")
pytest.importorskip("mujoco_warp")

SEA = (
    "env=crab_walk",
    "water=fossen",
    "environment.ground_level=null",
    "environment.tank_bottom=-1.0",
    "environment.water_density=1000.0",
    "task.height=-0.971",
    "task.rate=25",
)
SEEDS = (5, 6)


def batch(*words: str, count: int = 2) -> Environments:
    """Return a batch of worlds of a crab on the sea bed."""
    settings, task = build_learning(compose([*SEA, "backend=mujoco_warp", *words], root="learn"))
    worlds = WalkingWorlds(settings, task, count=count, device="cpu")
    return Environments(worlds, task, count=count, device="cpu", seed=1)


def world(*words: str) -> Environments:
    """Return the same crab in a world of MuJoCo."""
    own = ("backend=mujoco", "backend.compiled=false", "backend.second_order=false")
    settings, task = build_learning(compose([*SEA, *own, *words], root="learn"))
    one = WorldsInTurn([FullWorld(settings, task)])
    return Environments(one, task, count=1, device="cpu", renew=False)


@pytest.fixture(scope="module")
def crabs() -> Environments:
    """Return one batch for all tests: it is compiled once."""
    return batch()


def test_a_crab_at_rest_weighs_on_the_ground_what_it_weighs_in_water(crabs: Environments) -> None:
    """The sum of all contact forces is weight less buoyancy, within 1e-3 of it, in every world."""
    crabs.reset(SEEDS)
    for _ in range(120):
        crabs.simulator.worlds.advance()
    robot = crabs.robot
    volume = sum(hull.volume for hull in robot.hulls if hull is not None)
    weight = 9.81 * (float(robot.mass.sum()) - 1000.0 * volume)
    found = crabs.simulator.worlds.first.views.normals().sum(1).numpy()
    np.testing.assert_allclose(found, weight, rtol=1e-3)
    np.testing.assert_allclose(crabs.simulator.worlds.first.submersion.numpy(), 1.0, atol=1e-6)


def test_free_motion_with_added_mass_is_that_of_mujoco(crabs: Environments) -> None:
    """Thrown through the water, tilted, legs loose: the place after 0.2 s within 20 um."""
    place, velocity = np.array([0.1, -0.2, -0.5]), np.array([0.4, -0.3, 0.2])
    quaternion = quaternion_of_rpy(np.array([[0.5, -0.4, 1.0]]))
    crabs.reset(SEEDS)
    start = (torch.as_tensor(np.repeat(x, 2, 0)).float() for x in (place[None], quaternion))
    speed = torch.as_tensor(np.repeat(velocity[None], 2, 0)).float()
    posture = torch.as_tensor(crabs.task.posture).float()
    crabs.simulator.worlds.place(torch.ones(2, dtype=torch.bool), *start, speed, posture)
    for _ in range(50):
        crabs.simulator.worlds.advance()
    other = world()
    other.reset([5])
    alone = other.simulator.worlds[0]
    joints = np.asarray(other.task.posture)
    still = np.zeros_like(joints)
    alone.world.backend.restore(alone._fresh)
    alone.world.reset(
        {ROBOT: Configuration(place, quaternion[0], velocity, np.zeros(3), joints, still)}
    )
    for _ in range(50):
        alone.world.step()
    body = alone.actor.body.read()
    turn = matrix_of(body.quaternion[None])[0]
    there = (body.position, turn, body.velocity)
    first = crabs.simulator.worlds.first
    for found, told in zip(first.base()[:3], there, strict=True):
        np.testing.assert_allclose(found[0].numpy(), told, atol=1e-4)
    np.testing.assert_allclose(first.base()[0][0].numpy(), body.position, atol=2e-5)
    np.testing.assert_allclose(first.joints()[0].numpy(), body.joints, atol=5e-4)
    assert np.abs(body.position - place).max() > 0.02
    assert np.abs(body.joints).max() > 1e-4
    other.close()


def test_laws_as_one_kernel_are_the_laws_launch_by_launch(crabs: Environments) -> None:
    """Crabs that the surface cuts, tilted and moving: loads agree to single precision."""
    plain = batch("backend.compiled=false")
    found = []
    for many in (crabs, plain):
        many.reset(SEEDS)
        place = torch.tensor([[0.1, -0.2, 0.01], [0.0, 0.3, -0.005]])
        turn = torch.as_tensor(quaternion_of_rpy(np.array([[0.5, -0.4, 1.0], [-0.3, 0.7, 2.0]])))
        speed = torch.tensor([[0.4, -0.3, 0.2], [-0.1, 0.6, -0.5]])
        posture = torch.as_tensor(many.task.posture).float()
        everyone = torch.ones(2, dtype=torch.bool)
        many.simulator.worlds.place(everyone, place, turn.float(), speed, posture)
        worlds, robot, e = (
            many.simulator.worlds,
            many.simulator.worlds.first,
            many.simulator.worlds.engine,
        )
        e.velocity[:, 3:] = torch.linspace(-2.0, 2.0, 2 * e.velocity[:, 3:].shape[1]).reshape(2, -1)
        worlds._begin()
        v = robot.views
        joints = Joints(e.position[:, v.joints], e.velocity[:, v.dofs])
        inputs = Inputs(worlds.step, robot.none, joint_command=robot.held + 0.1)
        law, states = robot.laws.evaluate, v.states()
        found.append(law(states, joints, worlds.time, inputs, robot.memory))
    assert type(crabs.simulator.worlds.first.laws) is not type(plain.simulator.worlds.first.laws)
    one, other = (list(leaves(loads)) for loads in found)
    for a, b in zip(one, other, strict=True):
        largest = float(b.abs().max())
        np.testing.assert_allclose(*np.broadcast_arrays(a, b), rtol=0.0, atol=3e-6 * largest)
    wet = found[0].submersion
    assert 0.05 < float(wet.min()) < float(wet.max()) < 0.95
    assert float(found[0].force.abs().max()) > 0.1
    assert float(found[0].drive.force.abs().max()) > 1e-3


@pytest.mark.slow
def test_scripted_walks_are_those_of_mujoco_within_the_spread_of_two_steps() -> None:
    """After 1 s eight crabs are as near to MuJoCo's as MuJoCo's are with half its step.

    So is the work of their joints; the phases of the legs are the same.
    """
    crabs = batch(count=8)
    crabs.reset(range(8))
    actions, work = [], np.zeros(8)
    for _ in range(25):
        actions.append(crabs.scripted_policy())
        crabs.step(actions[-1])
        work += crabs.now.facts["power"][:, 0].numpy()
    found = crabs.now.position.numpy()
    places, done = np.zeros((2, 8, 3)), np.zeros((2, 8))
    for k, step in enumerate((0.004, 0.002)):
        own = world(f"time.step={step}")
        for row in range(8):
            own.reset([row])
            for action in actions:
                own.step(action[row : row + 1])
                done[k, row] += own.now.facts["power"].item()
            places[k, row] = own.now.position[0]
            phase = own.now.facts["phase"][0]
            np.testing.assert_allclose(crabs.now.facts["phase"][row].numpy(), phase, atol=1e-3)
        own.close()
    off = np.linalg.norm(found - places[0], axis=1)
    spread = np.linalg.norm(places[1] - places[0], axis=1)
    assert off.mean() < spread.mean(), f"{1e3 * off} mm against {1e3 * spread} mm"
    assert np.abs(work - done[0]).mean() < np.abs(done[1] - done[0]).mean()
    assert np.linalg.norm(crabs.now.target.numpy() - found, axis=1).max() < 0.36


def test_steps_repeat_bit_for_bit_and_go_on_from_a_snapshot(crabs: Environments) -> None:
    """The same seeds and actions give the same numbers; so does a restored snapshot."""
    action = torch.linspace(-1.0, 1.0, 14).reshape(2, 7)

    def course() -> list[Any]:
        return [crabs.step(action).observation for _ in range(3)]

    crabs.reset(SEEDS)
    first = course()
    crabs.reset(SEEDS)
    crabs.step(action)
    kept = crabs.snapshot()
    second = course()
    crabs.restore(kept)
    third = course()
    for a, b in zip(first[1:], second, strict=False):
        assert torch.equal(a, b)
    for a, b in zip(second, third, strict=True):
        assert torch.equal(a, b)


def test_an_episode_that_ends_begins_anew_and_leaves_the_others_alone(crabs: Environments) -> None:
    """A robot that is nowhere any more loses its episode, and stands at a start after it."""
    crabs.reset(SEEDS)
    still = torch.zeros(2, 7)
    crabs.step(still)
    crabs.simulator.worlds.engine.position[0, 0] = float("nan")
    result = crabs.step(still)
    assert result.terminated.tolist() == [True, False]
    assert result.success.tolist() == [False, False]
    assert torch.isfinite(result.observation).all()
    assert crabs.now.time[:, 0].tolist() == pytest.approx([0.0, 0.08])
    far = torch.linalg.norm(crabs.now.position[0, :2])
    assert float(far) == pytest.approx(0.4, abs=1e-5)
    assert torch.isfinite(crabs.step(still).observation).all()


def test_on_a_slope_every_crab_starts_and_stands_square_to_its_own_ground() -> None:
    """The steepest slope is kept, no two are alike, and the feet carry the crab on both."""
    crabs = batch("backend.slope=0.17")
    crabs.reset(SEEDS)
    up = crabs.now.rotation[:, 2, 2].acos()
    assert float(up.max()) <= 0.17
    assert float((up[0] - up[1]).abs()) > 1e-3
    for _ in range(60):
        crabs.simulator.worlds.advance()
    robot = crabs.robot
    volume = sum(hull.volume for hull in robot.hulls if hull is not None)
    weight = 9.81 * (float(robot.mass.sum()) - 1000.0 * volume)
    found = crabs.simulator.worlds.first.views.normals().sum(1)
    np.testing.assert_allclose(found.numpy(), weight * up.cos().numpy(), rtol=0.02)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("controller.turn_gain=3.0",), "turn_gain=3"),
        (("env=hover",), "the run has sensors"),
        (("+effect@effects.late=command_delay", "effects.late.delay=0.02"), "0.02 s late"),
    ],
)
def test_what_has_no_form_in_a_batch_is_refused(words: tuple[str, ...], said: str) -> None:
    """The words name what is wrong and what to say in its place."""
    base = () if words[0].startswith("env=") else SEA
    settings, task = build_learning(compose([*base, "backend=mujoco_warp", *words], root="learn"))
    with pytest.raises(ConfigError, match=said):
        WalkingWorlds(settings, task, count=1, device="cpu")


def test_on_a_processor_the_worlds_are_those_of_mujoco() -> None:
    """``backend=mujoco_warp device=cpu`` steps MuJoCo's worlds one by one."""
    from seals.learn.environments import batched_of

    found = batched_of(compose([*SEA, "backend=mujoco_warp"], root="learn"), count=1)
    assert [type(w) for w in found.simulator.worlds] == [FullWorld]  # type: ignore[attr-defined]
    found.close()


def test_memory_of_effects_goes_through_the_kernel() -> None:
    """Waves that two links of a floating crab make are remembered link by link, world by world."""
    radiation = (
        "+effect@effects.radiation=radiation_memory",
        "effects.radiation.frequency=[3.0, 6.0]",
        "effects.radiation.damping=[[4.0, 1.0], [1.0, 6.0]]",
        "effects.radiation.coupling=[[2, 1, 3, 0.1, 0.2, 0], [0.5, 2, 1, -0.1, 0.1, 0.1]]",
        "effects.radiation.floating_fraction=0.99",
        "effects.radiation.strength=0.01",
        "effects.radiation.links=[body, left_1_merus]",
    )
    found = []
    for own in ((), ("backend.compiled=false",)):
        many = batch(*radiation, *own)
        many.reset(SEEDS)
        many.simulator.worlds.engine.position[:, 2] += torch.tensor([0.97, 0.98])
        for _ in range(10):
            many.simulator.worlds.advance()
        found.append(many.simulator.worlds.first.memory["radiation"].numpy())
    assert found[0].shape == (4, 4)
    np.testing.assert_allclose(*found, rtol=0.0, atol=1e-5 * np.abs(found[1]).max())
    assert np.abs(found[0]).max(axis=1).min() > 1e-6
    assert np.abs(np.diff(found[0], axis=0)).max(axis=1).min() > 1e-6


def operations(a: Any, b: Any) -> list[Any]:
    """Every operation that a law may ask for, of numbers between 0 and 1."""
    xp = namespace(a)
    names = ("exp", "log", "sin", "cos", "tan", "tanh", "floor", "asin", "acos", "atan")
    found = [getattr(xp, name)(a) for name in (*names, "log1p", "expm1", "sqrt", "abs")]
    less, same = a < b, a == b
    chosen = xp.where(less & ~same, xp.where(a != b, less, same), b <= a)
    return [
        *found,
        xp.where(chosen | (a > 5.0), -a, a**3.0),
        xp.minimum(a, b) / xp.maximum(a, -1e-300) - xp.atan2(a, b),
        xp.sign(a - b) + b**a,
    ]


def test_statements_of_c_give_the_numbers_of_numpy() -> None:
    """Every operation of the laws agrees to single precision, in a kernel with a thread a row."""
    import warp as wp

    rng = np.random.default_rng(1)
    given = rng.uniform(1e-4, 0.99, (2, 5, 40)).astype(np.float32)
    given[1, :, 0] = given[0, :, 0]
    results = followed(operations, [(5,), (5,)])
    entries = [entry for x in results for entry in x.entries.flat]
    lines = statements_of(entries, "given.data[tid + {} * count]", "out.data[tid + {} * count]")
    wp.init()
    out = wp.zeros(len(entries) * 40, dtype=float, device="cpu")
    inputs = [wp.array(given.ravel(), dtype=float, device="cpu"), out, 40]
    wp.launch(kernel_of(lines), dim=40, inputs=inputs, device="cpu")
    wanted = np.concatenate(operations(*given.astype(float)))
    np.testing.assert_allclose(out.numpy().reshape(-1, 40), wanted, rtol=2e-7, atol=1e-7)
