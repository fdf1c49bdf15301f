"""Control steps per second of many environments: ``python benchmarks/environments.py``.

A control step holds command, allocation, two steps of 20 ms of the whole manipulator, observation,
reward, and a fresh episode where one ended.
"""

from __future__ import annotations

import argparse
import multiprocessing
from typing import Any, NamedTuple

import machine
import numpy as np
from many_worlds import waited

WORDS = ["env=reach", "backend=twin"]


class Case(NamedTuple):
    """What is timed: environments at once, device, spread of parameters, blocks and their steps."""

    count: int
    device: str
    varied: float
    repeats: int
    steps: int


def built(case: Case) -> Any:
    """Return environments of a case."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of
    from seals.learn.environments.build import build_learning
    from seals.learn.environments.posterior import drawn_parameters

    torch.set_num_threads(1)
    config = compose(WORDS, root="learn")
    values = None
    if case.varied:
        settings, _ = build_learning(config)
        rng = np.random.default_rng(0)
        values = dict(drawn_parameters(settings.effects, case.count, share=case.varied, rng=rng))
    return batched_of(config, count=case.count, device=case.device, values=values)


def speed_of(case: Case) -> tuple[float, float, float]:
    """Return median, lowest and highest control steps a second of one process."""
    import torch

    environment = built(case)
    environment.reset()
    draw = torch.Generator(device=case.device).manual_seed(0)
    shape = (case.count, environment.action_size)

    def block() -> float:
        begin = waited(case.device)
        for _ in range(case.steps):
            action = torch.rand(shape, generator=draw, device=case.device) * 2.0 - 1.0
            environment.step(action)
        return case.steps * case.count / (waited(case.device) - begin)

    block()
    found = machine.median(block, case.repeats)
    environment.close()
    return found


def together(case: Case, processes: int) -> tuple[float, float, float]:
    """Return the sums over processes that step at the same time."""
    if processes == 1:
        return speed_of(case)
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        each = pool.map(speed_of, [case] * processes)
    low, middle, high = (sum(column) for column in zip(*(sorted(x) for x in each), strict=True))
    return middle, low, high


def main() -> None:
    """Print control steps a second for each number of environments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--count", type=int, nargs="+", default=[1024], help="environments at once")
    parser.add_argument("--processes", type=int, default=1, help="at the same time, on a processor")
    parser.add_argument("--varied", type=float, default=0.0, help="spread of the parameters")
    parser.add_argument("--repeats", type=int, default=5, help="blocks of each case")
    parser.add_argument("--steps", type=int, default=20, help="control steps of a block")
    chosen = parser.parse_args()
    print(machine.describe())
    print(f"{'environments':>12} {'control steps/s':>16} {'lowest':>11} {'highest':>11}")
    for count in chosen.count:
        case = Case(count, chosen.device, chosen.varied, chosen.repeats, chosen.steps)
        speed = together(case, chosen.processes)
        print(f"{count:12d} {speed[0]:16.0f} {speed[1]:11.0f} {speed[2]:11.0f}", flush=True)


if __name__ == "__main__":
    machine.one_thread()
    main()
