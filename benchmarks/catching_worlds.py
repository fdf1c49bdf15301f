"""Divers that catch crabs in many worlds at once: ``python benchmarks/catching_worlds.py``.

The scripted diver in ``backend=mujoco_warp``: control steps a second, the time of a physics step by
phase, and how many of the first episodes succeed, beside which `benchmarks/judged.py` counts those
of full worlds. It ends with 1 where contacts did not fit.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from many_worlds import share_of, waited


def measured(env: str, count: int, device: str, steps: int) -> dict[str, Any]:
    """Return speed, phases and successes of the first episode of every world."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments.batch import Environments
    from seals.learn.environments.build import build_learning
    from seals.learn.environments.warp_worlds import DivingWorlds

    before = waited(device)
    words = [f"env={env}", "backend=mujoco_warp", "task.ends=true"]
    settings, task = build_learning(compose(words, root="learn"))
    worlds = DivingWorlds(settings, task, count=count, device=device)
    environment = Environments(worlds, task, count=count, device=device)
    environment.reset(list(range(count)))
    environment.step(environment.scripted_policy())
    environment.reset(list(range(count)))
    start = waited(device) - before
    running = torch.ones(count, dtype=torch.bool, device=device)
    won = torch.zeros_like(running)
    begin = waited(device)
    for _ in range(steps):
        result = environment.step(environment.scripted_policy())
        won |= running & result.success
        running &= ~(result.terminated | result.truncated)
    took = waited(device) - begin
    worlds = environment.simulator.worlds
    phases = worlds.parts() | {"fly": environment.simulator.fly, "walk": environment.simulator.walk}
    return {
        "env": env,
        "worlds": count,
        "device": torch.cuda.get_device_name() if device != "cpu" else "cpu",
        "start_s": start,
        "control_steps_per_s": count * steps / took,
        "steps_per_s": count * steps * environment.simulator.physics_steps / took,
        "won": int(won.sum()),
        "ended": int((~running).sum()),
        "phases_ms": share_of(phases, device, 50 if device != "cpu" else 2),
        "overflow": worlds.overflowing(),
        "memory_GB": torch.cuda.max_memory_reserved() / 1e9 if device != "cpu" else 0.0,
    }


def main(given: list[str] | None = None) -> int:
    """Measure, and print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--envs", nargs="*", default=["catch_fleeing", "catch"])
    parser.add_argument("--counts", type=int, nargs="*", default=[1024])
    parser.add_argument("--steps", type=int, default=250)
    parser.add_argument("--device", default="cuda", choices=["cuda", "cpu"])
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(given)
    found = []
    for count in chosen.counts:
        for env in chosen.envs:
            case = measured(env, count, chosen.device, chosen.steps)
            found.append(case)
            phases = ", ".join(f"{name} {spent:.2f}" for name, spent in case["phases_ms"].items())
            print(
                f"{env}, {count} worlds: {case['won']} of {count} caught; "
                f"{case['control_steps_per_s']:,.0f} control steps/s, "
                f"{case['steps_per_s']:,.0f} steps/s; ms: {phases}; start {case['start_s']:.1f} s, "
                f"{case['memory_GB']:.1f} GB{', OVERFLOW' if case['overflow'] else ''}",
                flush=True,
            )
            if chosen.out is not None:
                chosen.out.write_text(json.dumps(found, indent=1))
    return int(any(case["overflow"] for case in found))


if __name__ == "__main__":
    sys.exit(main())
