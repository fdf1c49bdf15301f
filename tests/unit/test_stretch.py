"""Steps made in one call of machine code are those made one by one, bit for bit."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.control import Reference
from seals.errors import PhysicsError
from seals.plugins.sensors.imu import SensorImu
from seals.run import initial_configuration
from seals.run.assembly import build_world
from seals.run.build import build_run
from seals.run.recorder import Moment, Recorder
from seals.run.simulation import Record, simulate
from seals.scalar_compiler import Program, compiled
from seals.world import World

pytest.importorskip("llvmlite")
pytest.importorskip("mujoco")

HOVER = ("robot=hexacopter", "guide=hover", "initial.drives=carrying")
WET = ("robot=box", "water=fossen", "initial.velocity=[0.3,0,-1]", "initial.rpy=[0.3,0.2,0]")
LAND = ("environment.water_level=null", "environment.ground_level=0")
AAM = ("robot=aam", "water=fossen", "guide=hover")
CASES = {
    "waves": ((*WET, "wave=airy", "initial.position=[0,0,0.2]"), 60),
    "current": ((*WET, "+effect@effects.flow=current", "effects.flow.velocity_y=0.4"), 60),
    "ground": (("robot=box", "initial.position=[0,0,0.4]", *LAND), 90),
    "touch": (
        (
            *("robot=box", "initial.position=[0,0,0.2]", "initial.velocity=[1.5,0.2,0]"),
            *("initial.rpy=[0.1,0.2,0]", *LAND),
            *("+sensor@sensors.touch=contact", "sensors.touch.rate=50"),
        ),
        200,
    ),
    "search": (("robot=hexacopter", "guide=hover"), 90),
    "wind": ((*HOVER, "+effect@effects.wind=wind", "effects.wind.velocity_x=3"), 60),
    "late": ((*HOVER, "+effect@effects.late=command_delay", "effects.late.delay=0.017"), 60),
    "guided": (("robot=hexacopter", "guide=oval", "guide.rate=25"), 60),
    "swing": (("experiment=swing",), 40),
    "sensors": (
        (
            *(*HOVER, "+sensor@sensors.gps=gps", "+sensor@sensors.battery=battery_meter"),
            *("+sensor@sensors.slow=imu", "sensors.slow.rate=100", "sensors.slow.latency=0.02"),
        ),
        60,
    ),
    "told": (
        (*HOVER, "+sensor@sensors.odometry=odometry", "controller.sense=odometry"),
        60,
    ),
}
PRESSING = (
    *(*LAND, "initial.position=[0,0,0.4]", "guide.position=[0,0,-0.5]"),
    *("+sensor@sensors.touch=contact", "sensors.touch.link=tip_1"),
)
"""The manipulator is led into the ground."""
CRAB = ("experiment=crab_seabed",)
SLOW = {
    "crab": ((*CRAB, "+sensor@sensors.touch=contact", "sensors.touch.link=left_1_dactyl"), 260),
    "pressing": ((*AAM, *PRESSING), 120),
    "aam in air": ((*AAM, "initial.position=[0,0,5]"), 90),
    "aam crossing": ((*AAM, "initial.position=[0,0,0]"), 90),
}


def built(words: tuple[str, ...]) -> World:
    """A world with compiled laws."""
    run = build_run(compose([*words, "backend=mujoco", "backend.compiled=true"]))
    return build_world(run)


def advanced(world: World, steps: int, seed: int) -> None:
    """Advance in parts of random lengths."""
    rng = np.random.default_rng(seed)
    while steps:
        part = min(steps, int(rng.integers(1, 24)))
        world.advance(part)
        steps -= part


def looped(world: World, robot: str = "robot") -> bool:
    """Whether any step was made in a loop."""
    laws: Any = world.actors[robot].compiled
    return any(form.stretches for form in laws._forms.values())


def same(one: World, other: World, robot: str = "robot") -> None:
    """All that a world knows is equal, the state of its random numbers included."""
    a, b = (w.actors[robot] for w in (one, other))
    assert one.time == other.time
    np.testing.assert_array_equal(a.ledger.wrenches, b.ledger.wrenches)
    np.testing.assert_array_equal(a.ledger.time, b.ledger.time)
    for x, y in zip(a.body.poses(), b.body.poses(), strict=True):
        np.testing.assert_array_equal(x, y)
    np.testing.assert_equal(b.readings, a.readings)
    for name in ("command", "joint_command", "drive", "voltage"):
        np.testing.assert_equal(getattr(b, name), getattr(a, name))
    kept, again = one.snapshot(), other.snapshot()
    assert kept.random == again.random
    np.testing.assert_equal(_scene(again), _scene(kept))
    np.testing.assert_equal(_plain(again.actors), _plain(kept.actors))


def _scene(snapshot: Any) -> Any:
    """Of a scene, without the links at its end: after a contact not every step has found them."""
    state, bodies = snapshot.scene
    return _plain((state, [(motion[:2], *more) for motion, *more in bodies]))


def _plain(value: Any) -> Any:
    """Nests as lists: records differ in nothing but their numbers."""
    if isinstance(value, dict):
        return {str(name): _plain(part) for name, part in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    return value


def agree(words: tuple[str, ...], steps: int) -> None:
    """One by one, and in parts."""
    one, other = built(words), built(words)
    for _ in range(steps):
        one.step()
    advanced(other, steps, seed=3)
    assert looped(other)
    same(one, other)
    for world in (one, other):
        world.close()


@pytest.mark.parametrize("case", CASES)
def test_steps_at_once_are_those_one_by_one(case: str) -> None:
    """Through surface and ground, with late commands, and sensors that tell where the robot is."""
    agree(*CASES[case])


RUNS = {
    "touch": (*HOVER, "+sensor@sensors.touch=contact", "sensors.imu.position=[0.1,0,0]"),
    "gps": (*HOVER, "+sensor@sensors.gps=gps"),
    "guided": CASES["guided"][0],
    "seldom": (*HOVER, "controller.rate=50", "guide.rate=50"),
    "told": (*CASES["told"][0], "controller.rate=50", "guide.rate=50"),
    "ground": CASES["ground"][0],
    "aam": SLOW["aam crossing"][0],
    "sliding": (*CASES["touch"][0], "initial.position=[0,0,0.1]"),
}
ROWS = 60
"""Steps of a run that is recorded."""


def recorded(words: tuple[str, ...]) -> Record:
    """Run some steps, and return the record."""
    time = f"time.duration={0.004 * ROWS}"
    run = build_run(compose([*words, time, "backend=mujoco", "backend.compiled=true"]))
    found = simulate(run)
    assert found.error is None
    return found


@pytest.mark.parametrize("case", RUNS)
def test_a_log_of_steps_at_once(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """States, readings, commands, aims and battery are those of steps one by one, bit for bit."""
    strides: list[int] = []
    stride = World.stride

    def counted(world: World, most: int) -> int:
        strides.append(stride(world, most))
        return strides[-1]

    monkeypatch.setattr(World, "stride", counted)
    fast = recorded(RUNS[case])
    monkeypatch.setattr(World, "stride", lambda world, most: stride(world, 1))
    slow = recorded(RUNS[case])
    assert sum(strides) == ROWS
    assert len(strides) < ROWS
    np.testing.assert_equal(fast.log.columns, slow.log.columns)
    np.testing.assert_array_equal(fast.ledger.wrenches, slow.ledger.wrenches)
    np.testing.assert_array_equal(fast.ledger.time, slow.ledger.time)
    np.testing.assert_equal(fast.log.meta, slow.log.meta)


class EveryStep(Recorder):
    """Recorder that wants to be called after every step."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def record(self, moment: Moment) -> None:
        """Note the time."""
        self.times.append(moment.world.time)


def test_who_records_every_step_is_called_after_every_step() -> None:
    """A live view, say: the run makes one step at a time."""
    run = build_run(compose([*HOVER, "time.duration=0.08", "backend=mujoco"]))
    recorder = EveryStep()
    simulate(run, recorders=[recorder])
    np.testing.assert_allclose(recorder.times, 0.004 * np.arange(1, 21), rtol=1e-12)


def one_of(name: str, robot: str, place: str, more: str = "") -> str:
    """Words of one of several robots."""
    return f"robots.{name}={{robot: {robot}, initial: {{position: {place}}}{more}}}"


HOVERS = ", guide: hover"
FLEETS = {
    "own guides": (
        (
            *("water=fossen", one_of("high", "hexacopter", "[0,0,2]", HOVERS)),
            *(one_of("low", "rov", "[3,0,-2]", HOVERS), one_of("wet", "box", "[6,0,0.1]")),
            one_of("led", "rov", "[9,0,-2]", ", guide: {guide: waypoints, delay: 0.1}"),
        ),
        60,
    ),
    "collision": (
        (*LAND, one_of("low", "box", "[0,0,0.5]"), one_of("high", "cube", "[0.02,0,1.2]")),
        150,
    ),
}
"""Several robots, each far from the others, and two that fall onto each other and the ground."""


@pytest.mark.parametrize("case", FLEETS)
def test_several_robots_at_once(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of all robots in one loop are those of each robot's laws called by Python."""
    words, steps = FLEETS[case]
    at_once, one_by_one = built(words), built(words)
    strides, left = [], steps
    while left:
        strides.append(at_once.stride(min(left, 24)))
        left -= strides[-1]
    monkeypatch.setattr(World, "_looped", lambda world, most: 0)
    one_by_one.advance(steps)
    assert all(looped(at_once, name) for name in at_once.actors)
    assert not any(looped(one_by_one, name) for name in one_by_one.actors)
    assert max(strides) > (10 if case == "collision" else 0)
    for name in at_once.actors:
        same(one_by_one, at_once, name)
    assert one_by_one.time == at_once.time
    for world in (at_once, one_by_one):
        world.close()


@pytest.mark.parametrize("more", [(), ("objects.cube={robot: cube, position: [20,0,5]}",)])
def test_logs_of_several_robots_at_once(
    more: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each robot's rows are those of steps one by one, without and with an object."""
    words = (*FLEETS["own guides"][0][:3], *more)
    fast = recorded(words)
    stride = World.stride
    monkeypatch.setattr(World, "stride", lambda world, most: stride(world, 1))
    slow = recorded(words)
    assert len(fast.fleet) == 2
    for name, own in fast.fleet.items():
        np.testing.assert_equal(own.log.columns, slow.fleet[name].log.columns)
        np.testing.assert_array_equal(own.ledger.wrenches, slow.fleet[name].ledger.wrenches)


def test_robots_that_nobody_leads_anew_go_on_together() -> None:
    """Strides of a hexacopter and an ROV that hover are as long as of one alone."""
    words = (one_of("a", "hexacopter", "[0,0,2]", HOVERS), one_of("b", "rov", "[3,0,-2]", HOVERS))
    world = built(("water=fossen", *words))
    strides = [world.stride(40) for _ in range(30)]
    assert strides[-5:] == [40] * 5
    # a loop is compiled when its forms have come together some times
    assert strides[0] == 1
    world.close()


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOW)
def test_the_manipulator_at_once(case: str) -> None:
    """In air and at the surface, its controller every second step."""
    agree(*SLOW[case])


def test_the_loop_follows_numpy() -> None:
    """A hover in wind that is stepped at once is the interpreted one."""
    words, steps = CASES["wind"]
    fast = built(words)
    slow = build_world(build_run(compose([*words, "backend=mujoco", "backend.compiled=false"])))
    advanced(fast, steps, seed=1)
    slow.advance(steps)
    one, other = (w.actors["robot"].ledger.wrenches for w in (slow, fast))
    np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-12 * np.abs(one).max())


def test_a_snapshot_amid_a_control_period_continues() -> None:
    """Bit for bit, also where the way after it is cut into other parts."""
    world, straight = built(SLOW["aam in air"][0]), built(SLOW["aam in air"][0])
    world.advance(31)
    kept = world.snapshot()
    world.advance(40)
    world.restore(kept)
    advanced(world, 40, seed=5)
    straight.advance(71)
    same(straight, world)


UNDESCRIBED = {
    "waves": (CASES["waves"][0], 40, False),
    "sliding": (RUNS["sliding"], 60, True),
    "crab": (CRAB, 40, True),
    "arm": (SLOW["pressing"][0], 60, True),
}


@pytest.mark.parametrize("case", UNDESCRIBED)
def test_an_engine_that_does_not_describe_itself(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps are made one by one, and are the same, those in which something touches among them."""
    words, steps, touching = UNDESCRIBED[case]
    at_once = built(words)
    at_once.advance(steps)
    monkeypatch.setattr("seals.plugins.backends.mujoco.body.library", lambda engine: None)
    plain = built(words)
    plain.advance(steps)
    laws: Any = at_once.actors["robot"].compiled
    assert looped(at_once)
    assert touching == any(touches for f in laws._forms.values() for _, touches in f.stretches)
    assert not looped(plain)
    same(plain, at_once)


def test_worlds_in_alternation_and_one_closed() -> None:
    """Two worlds of one process know nothing of each other, and one outlives the other."""
    words = CASES["waves"][0]
    worlds = [built(words) for _ in range(3)]
    for _ in range(6):
        for world in worlds[:2]:
            world.advance(7)
    worlds[0].close()
    del worlds[0]
    worlds[0].advance(18)
    worlds[1].advance(60)
    same(worlds[1], worlds[0])


def test_worlds_in_threads() -> None:
    """Two threads step a world each, once its laws are compiled: following a law is for one."""
    words = CASES["search"][0]
    worlds = [built(words) for _ in range(3)]
    for world in worlds:
        world.advance(40)
    threads = [threading.Thread(target=w.advance, args=(80,)) for w in worlds[:2]]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    worlds[2].advance(80)
    for world in worlds[:2]:
        same(worlds[2], world)


def test_an_error_amid_steps_leaves_a_world_that_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sensor that fails after a stretch does not make it happen again."""
    world = built(CASES["told"][0])
    world.advance(20)
    read, failed = SensorImu.sense, []

    def failing(*args: Any, **more: Any) -> Any:
        if not failed:
            failed.append(True)
            raise PhysicsError("the sensor broke.\nTake another.")
        return read(*args, **more)

    monkeypatch.setattr(SensorImu, "sense", failing)
    with pytest.raises(PhysicsError, match="broke"):
        world.advance(9)
    rows, time = world.actors["robot"].ledger.rows, world.time
    assert rows == round(time / world.step_size)
    world.advance(10)
    assert world.actors["robot"].ledger.rows == rows + 10


def test_what_somebody_sets_between_two_calls_counts() -> None:
    """Commands and states of drives that are set from outside are those of the next step."""
    words = tuple(w for w in HOVER if not w.startswith("guide"))
    one, other = built(words), built(words)
    for world, parts in ((one, [1] * 10), (other, [10])):
        actor = world.actors["robot"]
        for speed in (300.0, 500.0):
            actor.command = np.full((1, 6), speed)
            actor.drive = np.full((1, 6), 0.5 * speed)
            for part in parts:
                world.advance(part)
    same(one, other)


def test_an_episode_knows_nothing_of_the_one_before() -> None:
    """A reset, another place of the arm, another velocity: as in a world that begins so."""
    words = ("robot=aam", "guide=commanded", "initial.position=[0,0,5]", "initial.drives=carrying")
    one, other = built(words), built(words)
    aims = [
        Reference(velocity=np.array([v, 0.0, 0.0]), joints={"arm": np.full(3, v)})
        for v in (0.3, -0.2)
    ]
    settings = build_run(compose([*words, "backend=mujoco"]))
    start = {"robot": initial_configuration(settings, one.actors["robot"].robot)}
    for world, told in ((one, aims), (other, aims[1:])):
        for aim in told:
            world.reset(start)
            pilot: Any = world.actors["robot"].pilot
            for k in range(3):
                pilot.guide.tell(aim._replace(yaw=0.1 * k))
                world.advance(13)
    a, b = (w.actors["robot"] for w in (one, other))
    np.testing.assert_array_equal(a.ledger.wrenches, b.ledger.wrenches)
    np.testing.assert_equal(b.readings, a.readings)


def test_a_refused_pass_leaves_what_was_kept() -> None:
    """The third of three doublings is beyond the bound: two are made."""
    kernel = compiled(lambda x: [x + x, x > 3.0], [(1,)])
    state = np.ones(1)
    program = Program(1)
    place = program.memory(state)
    program.keep(place, 1)
    program.copy(program.given(kernel), place, 1)
    program.run(kernel)
    program.copy(place, program.out(kernel), 1)
    program.refuse_if(program.out(kernel, 1))
    program.accept()
    program.record(0, (place, 1))
    seen = np.zeros(9)
    assert program.compiled()(0, 9, 0, seen.ctypes.data) == 2
    assert state.tolist() == [4.0]
    assert seen.tolist() == [2.0, 4.0, *[0.0] * 7]


def test_what_is_done_now_and_then() -> None:
    """Every third pass by the phase, and never in the first; twice more while a number is left."""
    count, left = np.zeros(1), np.zeros(1)
    less = compiled(lambda x: [x - 1.0], [(1,)])
    more = compiled(lambda x: [x + 1.0], [(1,)])
    program = Program(0)
    counted, rest = program.memory(count), program.memory(left)
    with program.every(3), program.unless(rest):
        program.copy(program.given(more), counted, 1)
        program.run(more)
        program.copy(counted, program.out(more), 1)
    program.copy(rest, program.memory(np.array([5.0])), 1)
    with program.repeated(9, rest):
        program.copy(program.given(less), rest, 1)
        program.run(less)
        program.copy(rest, program.out(less), 1)
    program.accept()
    run = program.compiled()
    assert run(0, 10, 0) == 10
    assert count.tolist() == [3.0]
    assert left.tolist() == [0.0]
    run(0, 2, 2)
    assert count.tolist() == [4.0]
