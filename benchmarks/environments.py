"""Control steps a second of many environments: ``python benchmarks/environments.py``.

A control step holds command, allocation, two steps of 20 ms of the whole manipulator, observation,
reward, and a fresh episode where one ended. ``--parity`` flies the same starts in single precision
on the accelerator and in double precision on the processor, and tells how far apart they end.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from typing import Any, NamedTuple

import machine
import numpy as np

WORDS = ["env=reach", "backend=twin"]
MEDIA = {
    "air": ((-0.7, -0.7, 3.0), (0.7, 0.7, 4.0)),
    "water": ((-0.7, -0.7, -4.0), (0.7, 0.7, -3.0)),
    "crossing": ((-0.7, -0.7, -0.5), (0.7, 0.7, 0.5)),
}
"""Boxes of starts and targets, water level at 0: far from it, or around it [m]."""
SECOND = 25
"""Control steps in one."""
STATE = ("position", "rotation", "velocity", "spin")


class Case(NamedTuple):
    """What is timed: environments at once, device, spread of parameters, blocks and their steps."""

    count: int
    device: str
    varied: float
    repeats: int
    steps: int
    fused: bool = False


def built(case: Case, *words: str) -> Any:
    """Return environments of a case."""
    import torch

    from seals.config.compose import compose
    from seals.config.learning import build_learning
    from seals.learn.environments import batched_of
    from seals.learn.environments.varied import drawn

    torch.set_num_threads(1)
    fused = f"backend.fused={'true' if case.fused else 'false'}"
    config = compose([*WORDS, fused, *words], root="learn")
    values = None
    if case.varied:
        settings, _ = build_learning(config)
        rng = np.random.default_rng(0)
        values = dict(drawn(settings.effects, case.count, share=case.varied, rng=rng))
    return batched_of(config, count=case.count, device=case.device, values=values)


def waited(device: str) -> None:
    """Wait for a device that works on its own."""
    import torch

    if device != "cpu":
        torch.cuda.synchronize()


def speed_of(case: Case) -> tuple[float, float, float]:
    """Return median, lowest and highest control steps a second of one process."""
    import torch

    environment = built(case)
    environment.reset()
    draw = torch.Generator(device=case.device).manual_seed(0)
    shape = (case.count, environment.action_size)

    def block() -> float:
        waited(case.device)
        begin = time.perf_counter()
        for _ in range(case.steps):
            action = torch.rand(shape, generator=draw, device=case.device) * 2.0 - 1.0
            environment.step(action)
        waited(case.device)
        return case.steps * case.count / (time.perf_counter() - begin)

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


def flown(medium: str, device: str, count: int, *, fused: bool) -> dict[str, Any]:
    """Return where the same starts are after a second of the same actions."""
    import torch

    low, high = MEDIA[medium]
    boxes = [
        f"task.{name}_{side}=[{','.join(map(str, corner))}]"
        for name in ("start", "target")
        for side, corner in (("low", low), ("high", high))
    ]
    case = Case(count, device, 0.0, 1, SECOND, fused)
    environment = built(case, *boxes)
    environment.reset(list(range(count)))
    draw = torch.Generator().manual_seed(0)
    for _ in range(SECOND):
        action = torch.rand((count, environment.action_size), generator=draw) - 0.5
        environment.step(action.to(device))
    parts = {name: getattr(environment.now, name) for name in STATE}
    return {k: np.asarray(x if device == "cpu" else x.cpu(), dtype=float) for k, x in parts.items()}


def apart(one: dict[str, Any], other: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return relative differences of each environment, by part of the state."""
    found = {}
    for name, values in one.items():
        rows, more = (x.reshape(len(values), -1) for x in (values, other[name]))
        size = np.maximum(np.linalg.norm(rows, axis=1), 1e-12)
        found[name] = np.linalg.norm(rows - more, axis=1) / size
    return found


def tell_parity(count: int, media: list[str], *, fused: bool) -> None:
    """Print how far apart accelerator and processor end, by medium."""
    print(f"{'after 1 s, relative':20} {'part':>10} {'median':>9} {'99 %':>9} {'largest':>9}")
    for medium in media:
        exact = flown(medium, "cpu", count, fused=False)
        far = apart(exact, flown(medium, "cuda", count, fused=fused))
        for part, gap in far.items():
            median, most = np.quantile(gap, [0.5, 0.99])
            print(f"{medium:20} {part:>10} {median:9.1e} {most:9.1e} {gap.max():9.1e}")


def main() -> None:
    """Print control steps a second for each number of environments, or the differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--count", type=int, nargs="+", default=[1024], help="environments at once")
    parser.add_argument("--processes", type=int, default=1, help="at the same time, on a processor")
    parser.add_argument("--varied", type=float, default=0.0, help="spread of the parameters")
    parser.add_argument("--fused", action="store_true", help="joined by PyTorch's compiler")
    parser.add_argument("--repeats", type=int, default=5, help="blocks of each case")
    parser.add_argument("--steps", type=int, default=20, help="control steps of a block")
    parser.add_argument("--parity", action="store_true", help="compare cuda with cpu")
    parser.add_argument("--media", nargs="+", default=list(MEDIA), help="where it is compared")
    chosen = parser.parse_args()
    print(machine.describe())
    if chosen.parity:
        tell_parity(chosen.count[0], chosen.media, fused=chosen.fused)
        return
    print(f"{'environments':>12} {'control steps/s':>16} {'lowest':>11} {'highest':>11}")
    for count in chosen.count:
        chosen_case = (count, chosen.device, chosen.varied, chosen.repeats, chosen.steps)
        case = Case(*chosen_case, chosen.fused)
        speed = together(case, chosen.processes)
        print(f"{count:12d} {speed[0]:16.0f} {speed[1]:11.0f} {speed[2]:11.0f}", flush=True)


if __name__ == "__main__":
    machine.one_thread()
    main()
