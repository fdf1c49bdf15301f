"""Physics steps a second of many worlds with contacts: ``python benchmarks/many_worlds.py``.

A crab of 18 joints walks on the sea bed by its scripted policy: contacts, servos, buoyancy, drags
and added mass in every world, by ``backend=mujoco_warp``. One line for each number of worlds, with
the time of a step by phase; then, with ``--agree N``, the ways of N crabs after 1 s against those
of MuJoCo, beside what half its step makes of them. It ends with 1 where contacts did not fit, or
where the mean deviation is above that of half a step.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import machine
import numpy as np

SEA = (
    "env=crab_walk",
    "water=fossen",
    "environment.ground_level=null",
    "environment.tank_bottom=-1.0",
    "task.height=-0.971",
)
STEP, HALF = 0.004, 0.002
CONTROL_STEPS = 5
"""Control steps after which ways are compared: 1 s."""


def learning(*words: str) -> tuple[Any, Any]:
    """Return run and task of the crab."""
    from seals.config.compose import compose
    from seals.learn.environments.build import build_learning

    return build_learning(compose([*SEA, *words], root="learn"))


def batch(count: int, device: str, *words: str) -> Any:
    """Return a batch of worlds."""
    from seals.learn.environments.batch import Environments
    from seals.learn.environments.warp_worlds import WalkingWorlds

    settings, task = learning("backend=mujoco_warp", *words)
    worlds = WalkingWorlds(settings, task, count=count, device=device)
    return Environments(worlds, task, count=count, device=device)


def waited(device: str) -> float:
    """Return the time when the device has done all that it was asked for [s]."""
    import torch

    if device != "cpu":
        torch.cuda.synchronize()
    return time.perf_counter()


def share_of(parts: dict[str, Callable[[], None]], device: str, steps: int) -> dict[str, float]:
    """Return the mean time of every part of a step [ms], waiting for each."""
    spent = dict.fromkeys(parts, 0.0)
    for _ in range(steps):
        for name, part in parts.items():
            before = waited(device)
            part()
            spent[name] += waited(device) - before
    return {name: 1e3 * total / steps for name, total in spent.items()}


def measured(count: int, device: str, seconds: float) -> dict[str, Any]:
    """Return speed, shares and memory of a number of worlds."""
    import torch

    before = waited(device)
    environment = batch(count, device)
    environment.reset()
    environment.step(environment.scripted_policy())
    start = waited(device) - before
    steps, begin = 0, waited(device)
    while waited(device) - begin < seconds:
        environment.step(environment.scripted_policy())
        steps += environment.simulator.physics_steps
    took = waited(device) - begin
    worlds = environment.simulator.worlds
    found = {
        "worlds": count,
        "device": torch.cuda.get_device_name() if device != "cpu" else "cpu",
        "start_s": start,
        "steps_per_s": count * steps / took,
        "control_steps_per_s": count * steps / took / environment.simulator.physics_steps,
        "phases_ms": share_of(worlds.parts() | {"gait": environment.simulator.walk}, device, 50),
        "overflow": worlds.overflowing(),
        "upright": float((environment.now.rotation[:, 2, 2] > 0.5).float().mean()),
        "memory_GB": torch.cuda.max_memory_reserved() / 1e9 if device != "cpu" else 0.0,
    }
    environment.close()
    return found


def agreement(count: int, device: str) -> dict[str, Any]:
    """Return the deviation of crabs after 1 s from MuJoCo's, and that of half its step [m]."""
    from seals.learn.environments.batch import Environments
    from seals.learn.environments.world import FullWorld, WorldsInTurn

    environment = batch(count, device)
    environment.reset(list(range(count)))
    actions = []
    for _ in range(CONTROL_STEPS):
        actions.append(environment.scripted_policy())
        environment.step(actions[-1])
    end = environment.now.position.cpu().numpy()
    ends = {}
    for step in (STEP, HALF):
        own = ("backend=mujoco", "backend.second_order=false", f"time.step={step}")
        settings, task = learning(*own)
        one = WorldsInTurn([FullWorld(settings, task)])
        world = Environments(one, task, count=1, device="cpu", renew=False)
        places = []
        for row in range(count):
            world.reset([row])
            for action in actions:
                world.step(action[row : row + 1].cpu())
            places.append(world.now.position[0].copy())
        ends[step] = np.array(places)
        world.close()
    off = np.linalg.norm(end - ends[STEP], axis=1)
    spread = np.linalg.norm(ends[HALF] - ends[STEP], axis=1)
    return {
        "crabs": count,
        "mean_m": off.mean().item(),
        "largest_m": off.max().item(),
        "half_step_mean_m": spread.mean().item(),
        "half_step_largest_m": spread.max().item(),
    }


def told(found: dict[str, Any]) -> str:
    """Return one line."""
    phases = ", ".join(f"{name} {spent:.2f}" for name, spent in found["phases_ms"].items())
    return (
        f"{found['worlds']:6} worlds: {found['steps_per_s']:12,.0f} steps/s, "
        f"{found['control_steps_per_s']:9,.0f} control steps/s; ms a step: {phases}; "
        f"start {found['start_s']:.1f} s, {found['memory_GB']:.1f} GB, "
        f"upright {found['upright']:.1%}{', OVERFLOW' if found['overflow'] else ''}"
    )


def main(words: list[str] | None = None) -> int:
    """Measure, and print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--counts", type=int, nargs="*", default=[1024, 4096, 8192])
    parser.add_argument("--device", default="cuda", choices=["cuda", "cpu"])
    parser.add_argument("--seconds", type=float, default=10.0, help="of every case")
    parser.add_argument("--agree", type=int, default=0, help="crabs to compare with MuJoCo")
    parser.add_argument("--out", type=Path, help="file of all figures, JSON")
    given = parser.parse_args(words)
    print(machine.describe())
    figures: dict[str, Any] = {"machine": machine.describe(), "cases": []}
    wrong = False
    for count in given.counts:
        found = measured(count, given.device, given.seconds)
        figures["cases"].append(found)
        wrong |= found["overflow"]
        print(told(found), flush=True)
    if given.agree:
        near = figures["agreement"] = agreement(given.agree, given.device)
        wrong |= near["mean_m"] > near["half_step_mean_m"]
        print("after 1 s [mm]:", {k: round(1e3 * v, 2) for k, v in near.items() if k != "crabs"})
    if given.out:
        given.out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return int(wrong)


if __name__ == "__main__":
    machine.one_thread()
    sys.exit(main())
