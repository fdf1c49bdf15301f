"""The compiler of laws beside torch.compile: ``python benchmarks/compile_laws.py``.

The same laws with the same numbers, every compiler in one process, timed in turn: a Runge-Kutta
step of a rigid vehicle with eight effects, and a control step of the manipulator's environment.
``--device cuda`` launches every one of them as one CUDA graph, by tensordict's ``CudaGraphModule``.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import machine

LAWS = ("sphere", "box", "cylinder", "reach")
"""Laws that are measured."""

COMPILERS = ("eager", "seals", "traced", "default", "max-autotune-no-cudagraphs", "regional")
"""``eager``: operation by operation. ``seals``: `seals.tensor_compiler`. ``traced``: its graph,
without its passes, given to Inductor. ``regional``: torch.compile of the innermost laws
alone. Else: torch.compile of the whole law in that mode."""


class Case(NamedTuple):
    """A law, ready to be called.

    Args:
        call: makes one step from the same state every time.
        flat: numbers that it gives, in one vector.
    """

    call: Callable[[], Any]
    flat: Callable[[], Any]


@contextlib.contextmanager
def compiler(name: str) -> Iterator[None]:
    """Let laws that ask for `seals.tensor_compiler` get another compiler."""
    from seals.tensor_compiler import fused, tracing

    own, tidied = fused.Fused.__call__, tracing.tidied
    if name == "traced":
        tracing.tidied = lambda graph, device: graph
    elif name != "seals":
        fused.Fused.__call__ = replacement(name)
    try:
        yield
    finally:
        fused.Fused.__call__, tracing.tidied = own, tidied


def replacement(name: str) -> Callable[..., Any]:
    """Return a method that calls a law by PyTorch alone, in place of `Fused.__call__`."""
    import torch

    from seals.arrays import deciding, undecided

    runs: dict[int, Any] = {}

    def whole(self: Any, *given: Any) -> Any:
        if not deciding():
            return self._law(*given)
        run = runs.get(id(self))
        if run is None:
            run = runs[id(self)] = torch.compile(self._law, mode=name, dynamic=False)
        with torch.no_grad(), undecided():
            return run(*given)

    def eager(self: Any, *given: Any) -> Any:
        with torch.no_grad(), undecided():
            return self._law(*given)

    def regional(self: Any, *given: Any) -> Any:
        with torch.no_grad(), undecided():
            if self._law.__name__ not in ("slopes", "_round"):
                return self._law(*given)
            run = runs.get(id(self))
            if run is None:
                run = runs[id(self)] = torch.compile(self._law, dynamic=False)
            return run(*given)

    return {"eager": eager, "regional": regional}.get(name, whole)


def vehicle(kind: str, batch: int, device: str, folder: Path) -> Case:
    """Return a step of a rigid vehicle that crosses the surface."""
    import numpy as np
    import scene
    import torch
    from twin import HULLS, MASSES

    from seals.run import build_twin

    robot = scene.vehicle(folder, kind, HULLS[kind], MASSES[kind])
    settings = scene.settings(robot, scene.effects(added_mass=True), height=0.0)
    like = torch.zeros(1, dtype=torch.float32, device=device)
    twin, _ = build_twin(settings, batch=batch, like=like, fused=True)
    rng = np.random.default_rng(0)
    start = twin.start(
        position=rng.normal(size=(batch, 3)) * [1.0, 1.0, 0.02],
        rpy=rng.normal(size=(batch, 3)) * 0.3,
        velocity=rng.normal(size=(batch, 3)) * 0.3,
        spin=rng.normal(size=(batch, 3)) * 0.3,
    )
    now = torch.zeros((1, 1), device=device)
    return _case(lambda: twin.step(start, now, 0.004)[0], device)


def reach(batch: int, device: str) -> Case:
    """Return a control step of the manipulator's environment."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    config = compose(["env=reach", "backend=twin", "backend.fused=true"], root="learn")
    environment: Any = batched_of(config, count=batch, device=device)
    environment.reset(list(range(batch)))
    environment._prefetch_resets()
    scene, chance = environment._scene, torch.rand(batch, 1, device=device)
    chance = environment._starts.chances(batch, environment._generator)
    action = torch.full((batch, environment.action_size), 0.3, device=device)
    return _case(lambda: environment._joined(scene, action, chance)[0].flight, device)


def _case(call: Callable[[], Any], device: str) -> Case:
    """Return a law's call, on an accelerator as one CUDA graph."""
    import torch

    from seals.pytree import tensors

    if device != "cpu":
        from tensordict.nn import CudaGraphModule

        call = CudaGraphModule(lambda law=call: tuple(x.clone() for x in tensors(law())))

    def flat() -> Any:
        return torch.cat([x.double().flatten().cpu() for x in tensors(call())])

    return Case(call, flat)


class Overdue(Exception):
    """A compiler took longer than it was given."""


@contextlib.contextmanager
def within(seconds: int) -> Iterator[None]:
    """Raise `Overdue` in what takes longer."""

    def ring(number: int, frame: object) -> None:
        raise Overdue

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def built(law: str, name: str, chosen: Any, folder: Path) -> tuple[Case, float, int]:
    """Return a compiled law, the time that took [s] and the number of graphs it fell into."""
    from torch._dynamo.utils import counters

    counters.clear()
    begin = time.perf_counter()
    if law == "reach":
        case = reach(chosen.batch, chosen.device)
    else:
        case = vehicle(law, chosen.batch, chosen.device, folder)
    case.call()
    case.call()
    graphs = counters["stats"]["unique_graphs"] if name in COMPILERS[3:] else 1
    return case, time.perf_counter() - begin, graphs


def pace(case: Case, device: str, least: float = 0.3) -> float:
    """Return the time of one call [s], over at least so many seconds."""
    import torch

    calls, begin = 0, time.perf_counter()
    while True:
        case.call()
        calls += 1
        if device != "cpu":
            torch.cuda.synchronize()
        if time.perf_counter() - begin > least:
            return (time.perf_counter() - begin) / calls


def measure(law: str, chosen: Any, folder: Path) -> None:
    """Print a row for every compiler."""
    import torch

    cases: dict[str, Case] = {}
    notes: dict[str, str] = {}
    expected = None
    for name in chosen.compilers:
        torch._dynamo.reset()
        with compiler(name):
            try:
                with within(chosen.limit):
                    case, spent, graphs = built(law, name, chosen, folder)
                    found = case.flat()
            except Overdue:
                print(f"{law:9} {name:27} not compiled within {chosen.limit} s", flush=True)
                continue
            except Exception as problem:  # a benchmark tells every compiler's failure and goes on
                said = (str(problem).splitlines() or [""])[0][:100]
                print(f"{law:9} {name:27} failed: {type(problem).__name__}: {said}", flush=True)
                continue
        expected = found if expected is None else expected
        apart = float((found - expected).abs().max())
        cases[name], notes[name] = case, f"{spent:8.0f} {graphs:7d} {apart:9.1e}"
    times: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(chosen.repeats):
        for name, case in cases.items():
            with compiler(name):
                times[name].append(pace(case, chosen.device))
    for name, found in times.items():
        middle = statistics.median(found)
        print(
            f"{law:9} {name:27} {1e3 * middle:9.3f} {1e3 * min(found):9.3f} "
            f"{chosen.batch / middle:12.0f} {notes[name]}",
            flush=True,
        )


def main() -> None:
    """Print milliseconds a call, rows a second, compile times and differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--laws", nargs="+", default=list(LAWS), choices=LAWS)
    parser.add_argument("--compilers", nargs="+", default=list(COMPILERS), choices=COMPILERS)
    parser.add_argument("--batch", type=int, default=1000, help="robots at once")
    parser.add_argument("--repeats", type=int, default=7, help="blocks of each case, in turn")
    parser.add_argument("--limit", type=int, default=900, help="for compiling one law [s]")
    chosen = parser.parse_args()
    import torch

    torch.set_num_threads(1)
    torch._dynamo.config.cache_size_limit = 64
    torch._inductor.config.force_disable_caches = True
    print(f"{machine.describe()}, PyTorch {torch.__version__}, {chosen.device}")
    print(
        f"{'law':9} {'compiler':27} {'ms/call':>9} {'lowest':>9} {'robots/s':>12} "
        f"{'build s':>8} {'graphs':>7} {'apart':>9}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for law in chosen.laws:
            measure(law, chosen, Path(folder))


if __name__ == "__main__":
    machine.one_thread()
    main()
