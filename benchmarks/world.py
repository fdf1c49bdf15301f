"""Steps per second of a world with one robot: ``python benchmarks/world.py``.

Case ``chain``: eight links, eight effects on all of them (seven without added mass), ledger and a
noisy IMU. Case ``aam``: the aerial-aquatic manipulator with its rotors, servos, battery, Fossen
water, IMU, contact sensors at the finger-tips, and the controller that holds it. Steps of 4 ms.
``--paired`` takes NumPy and compiled laws in turn, block by block, on both engines, and adds a crab
on the bottom, the task Reach, and the engines alone.
The time is that of the processor; other programs still slow it down, so compare the highest.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import machine
import numpy as np

from seals import registry

ENGINES = ("pybullet", "mujoco")
HEIGHTS = {"in air": 5.0, "crossing": 0.0, "submerged": -5.0}
CONTROLS = 40
"""Control steps of a block, of ten steps each."""
BLOCK = 100
"""Steps between resets, so that the robot stays in the medium that is measured."""


WALKING = 160
"""Steps after which a crab walks."""
ADDED = ("~effects.added_mass", "~effects.arm_added_mass")
AAM = (
    "robot=aam",
    "water=fossen",
    "guide=hover",
    "+sensor@sensors.touch_1=contact",
    "sensors.touch_1.link=tip_1",
)


def chain_settings(folder: Path, *, added_mass: bool, height: float) -> Any:
    """Return the eight-link chain at a height [m]."""
    import scene

    effects = scene.effects(added_mass=added_mass, scale=0.1)
    return scene.settings(scene.chain(folder), effects, height=height)


def aam_settings(*, added_mass: bool, height: float, piloted: bool = True) -> Any:
    """Return the manipulator at a height [m], held there by its controller or left alone."""
    from seals.run.build import run_settings

    words = [w for w in AAM if piloted or not w.startswith(("controller", "guide"))]
    words += [f"initial.position=[0,0,{height}]", "time.duration=4.0"]
    return run_settings([*words, *(() if added_mass else ADDED)])


def crab_settings() -> Any:
    """Return the crab that walks on the bottom of a tank."""
    from seals.run.build import run_settings

    return run_settings(["experiment=crab_seabed"])


def blocks_of(settings: Any, warm: int = 1) -> tuple[Any, Callable[[], float]]:
    """Return a world, and what measures its steps a second over a block, after some steps."""
    from seals.run import build_world, initial_configuration

    world = build_world(settings)
    start = {"robot": initial_configuration(settings, world.actors["robot"].robot)}

    def block() -> float:
        world.reset(start)
        for _ in range(warm):
            world.step()
        begin = time.process_time()
        world.advance(BLOCK)
        return BLOCK / (time.process_time() - begin)

    block()
    return world, block


def steps_a_second(settings: Any, repeats: int) -> tuple[float, float, float]:
    """Return median, lowest and highest steps a second over blocks of steps."""
    world, block = blocks_of(settings)
    found = machine.median(block, repeats)
    world.close()
    return found


def paired(folder: Path, engines: Sequence[str], repeats: int) -> Iterator[str]:
    """Yield lines: medians of steps a second with NumPy and compiled laws, and of their ratios.

    The last column is the engine alone: its own step of the same scene, nothing acting; of a crab
    with the same contacts and forces, see `bare_in_contact`.
    """
    made: dict[str, Callable[[], Any]] = {
        "aam, in air": lambda: aam_settings(added_mass=True, height=HEIGHTS["in air"]),
        "aam, crossing": lambda: aam_settings(added_mass=True, height=HEIGHTS["crossing"]),
        "crab on the bottom": crab_settings,
        "chain, crossing": lambda: chain_settings(folder, added_mass=True, height=0.0),
    }
    for (name, settings_of), engine in itertools.product(made.items(), engines):
        both = []
        for compiled in ("false", "true"):
            settings = settings_of()
            settings.backend = registry.get("backend", engine).load()(compiled=compiled)
            both.append(blocks_of(settings, warm=WALKING if "crab" in name else 1))
        yield _line(f"{name}, {engine}", [block for _, block in both], repeats, bare(both[1][0]))
        for world, _ in both:
            world.close()
    for engine in engines:
        yield _line(f"reach, control steps/s, {engine}", reaching(engine), repeats, math.nan)


def _line(name: str, blocks: Sequence[Callable[[], float]], repeats: int, alone: float) -> str:
    rows = [[block() for block in blocks] for _ in range(repeats)]
    plain, fast = (statistics.median(column) for column in zip(*rows, strict=True))
    ratio, best = statistics.median(b / a for a, b in rows), max(b for _, b in rows)
    return f"{name:40} {plain:9.0f} {fast:9.0f} {best:9.0f} {ratio:9.2f} {alone:9.0f}"


def bare(world: Any) -> float:
    """Return the steps a second of the engine alone, from where a world is."""
    backend = world.backend
    if hasattr(backend, "_client"):
        step = partial(backend._engine.stepSimulation, physicsClientId=backend._client)
    else:
        scene = backend._scene
        if scene.data.ncon:
            return bare_in_contact(world)
        step = partial(scene.engine.mj_step, scene.model, scene.data)
    begin = time.process_time()
    for _ in range(BLOCK):
        step()
    return BLOCK / (time.process_time() - begin)


def bare_in_contact(world: Any) -> float:
    """Return the steps a second of MuJoCo alone through the states of a world's next steps.

    Each begins at the pose, velocity and forces of one of them: left alone, a robot on its legs
    would collapse, and other contacts would be solved.
    """
    scene = world.backend._scene
    engine, model, d = scene.engine, scene.model, scene.data
    arrays = d.qpos, d.qvel, d.qacc_warmstart, d.qfrc_applied
    states = []
    for _ in range(BLOCK):
        began = [x.copy() for x in arrays[:3]]
        world.advance(1)
        states.append((*began, d.qfrc_applied.copy()))
    kept = [x.copy() for x in arrays]

    def through(step: Callable[[Any, Any], None]) -> float:
        begin = time.process_time()
        for state in states:
            for array, values in zip(arrays, state, strict=True):
                array[:] = values
            step(model, d)
        return time.process_time() - begin

    alone = through(engine.mj_step) - through(lambda model, data: None)
    for array, values in zip(arrays, kept, strict=True):
        array[:] = values
    return BLOCK / alone


def reaching(engine: str) -> list[Callable[[], float]]:
    """Return what measures control steps a second of the task Reach, by NumPy and compiled."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments.batch import Environments
    from seals.learn.environments.build import build_learning
    from seals.learn.environments.world import FullWorld, WorldsInTurn

    def measured(compiled: str) -> Callable[[], float]:
        words = ["env=reach", f"backend={engine}", f"backend.compiled={compiled}"]
        settings, task = build_learning(compose(words, root="learn"))
        one = WorldsInTurn([FullWorld(settings, task)])
        environment = Environments(one, task, count=1, device="cpu", renew=False)
        actions = torch.as_tensor(np.random.default_rng(0).uniform(-1.0, 1.0, (CONTROLS, 3)))

        def block() -> float:
            environment.reset([0])
            begin = time.process_time()
            for k, action in enumerate(actions):
                turn = environment.step(action[None])
                if turn.terminated[0] or turn.truncated[0]:
                    environment.reset([k])
            return CONTROLS / (time.process_time() - begin)

        block()
        return block

    return [measured("false"), measured("true")]


def main() -> None:
    """Print steps a second with and without added mass, in air, at the surface and under it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=11, help="blocks of 100 steps of each case")
    parser.add_argument("--case", choices=("chain", "aam", "all"), default="all")
    parser.add_argument("--paired", action="store_true", help="NumPy and compiled laws in turn")
    parser.add_argument("--backend", nargs="+", choices=ENGINES, default=list(ENGINES))
    given = parser.parse_args()
    print(machine.describe())
    if given.paired:
        heads = ("NumPy", "compiled", "best", "ratio", "engine")
        print(f"{'world, 4 ms, steps/s':40} " + " ".join(f"{head:>9}" for head in heads))
        with tempfile.TemporaryDirectory() as folder:
            for line in paired(Path(folder), given.backend, given.repeats):
                print(line, flush=True)
        return
    print(f"{'world, 4 ms':40} {'steps/s':>9} {'lowest':>9} {'highest':>9} {'x real time':>12}")
    with tempfile.TemporaryDirectory() as folder:
        for case, settings in cases(Path(folder), given.case):
            speed = steps_a_second(settings, given.repeats)
            print(
                f"{case:40} {speed[0]:9.0f} {speed[1]:9.0f} {speed[2]:9.0f} "
                f"{speed[0] * 0.004:12.1f}"
            )


def cases(folder: Path, chosen: str) -> Iterator[tuple[str, Any]]:
    """Yield names and settings of the cases."""
    for added_mass in (True, False):
        words = f"{'with' if added_mass else 'without'} added mass"
        for name, height in HEIGHTS.items():
            if chosen != "aam":
                settings = chain_settings(folder, added_mass=added_mass, height=height)
                yield f"chain, {name}, {words}", settings
        for name, height in HEIGHTS.items():
            if chosen != "chain":
                yield f"aam, {name}, {words}", aam_settings(added_mass=added_mass, height=height)
        if chosen != "chain":
            left = aam_settings(added_mass=added_mass, height=HEIGHTS["in air"], piloted=False)
            yield f"aam, no controller, {words}", left


if __name__ == "__main__":
    machine.one_thread()
    main()
