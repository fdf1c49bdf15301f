"""Laws of motion, compilers and ways to launch them, for ``compile_laws.py``."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

LAWS = ("sphere", "box", "cylinder", "reach")
"""A Runge-Kutta step of a rigid vehicle with eight effects; a control step of task Reach."""

COMPILERS = {
    "eager": "operation by operation",
    "seals": "seals.tensor_compiler",
    "traced": "its graph without its passes, given to Inductor",
    "regional": "torch.compile of the innermost laws alone",
    "default": "torch.compile of the whole law",
    "reduce-overhead": "torch.compile(mode='reduce-overhead')",
    "max-autotune": "torch.compile(mode='max-autotune')",
}

LAUNCHES = ("calls", "CudaGraphModule", "Recorded")
"""``calls``: as Python calls it. ``CudaGraphModule``: one CUDA graph, by tensordict. ``Recorded``:
one CUDA graph, by `seals.learn.recorded`."""

OWN_GRAPHS = ("reduce-overhead", "max-autotune")
"""Modes in which torch.compile makes CUDA graphs itself."""

TIMED_BLOCK = 0.3
"""Least length of one timed block of calls [s]."""


class Law(NamedTuple):
    """A law with the state that it starts from.

    Args:
        step: takes the state, a nest of tensors, and returns the next one.
        state: the same at every call.
    """

    step: Callable[[Any], Any]
    state: Any


def law_of(name: str, batch: int, device: str) -> Law:
    """Return one of `LAWS` for so many robots, uncompiled until it is called."""
    return reach(batch, device) if name == "reach" else vehicle(name, batch, device)


def vehicle(kind: str, batch: int, device: str) -> Law:
    """Return a step of a rigid vehicle that crosses the surface."""
    import torch
    from twin import like_of, vehicles

    twin, start = vehicles(kind, batch, like_of(device, single=True), fused=True)
    now = torch.zeros((1, 1), device=device)
    return Law(lambda state: twin.step(state, now, 0.004)[0], start)


def reach(batch: int, device: str) -> Law:
    """Return a control step of the manipulator's environment, all twins as one batch."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    config = compose(["env=reach", "backend=twin", "backend.fused=true"], root="learn")
    environment: Any = batched_of(config, count=batch, device=device)
    environment.reset(list(range(batch)))
    environment._prefetch_resets()
    chance = environment._starts.chances(batch, environment._generator)
    action = torch.full((batch, environment.action_size), 0.3, device=device)
    step = environment._compiled
    return Law(lambda scene: step(scene, action, chance)[0], environment._scene)


@contextlib.contextmanager
def compiler(name: str) -> Iterator[None]:
    """Let laws that ask for `seals.tensor_compiler` get another compiler."""
    from seals.tensor_compiler import fused, tracing

    own, tidied = fused.Fused.__call__, tracing.tidied
    if name == "traced":
        tracing.tidied = lambda graph, device: graph
    elif name != "seals":
        fused.Fused.__call__ = _replacement(name)
    try:
        yield
    finally:
        fused.Fused.__call__, tracing.tidied = own, tidied


def _replacement(name: str) -> Callable[..., Any]:
    """Return a method that calls a law by PyTorch alone, in place of `Fused.__call__`."""
    import torch

    from seals.arrays import deciding, undecided

    runs: dict[int, Any] = {}
    mode = None if name == "regional" else name

    def call(self: Any, *given: Any) -> Any:
        inner = self._law.__name__ in ("slopes", "_round")
        # torch.compile joins the laws that the outermost one calls; regional takes the inner ones
        compiles = name != "eager" and (inner if name == "regional" else deciding())
        with torch.no_grad(), undecided():
            if not compiles:
                return self._law(*given)
            if id(self) not in runs:
                runs[id(self)] = torch.compile(self._law, mode=mode, dynamic=False)
            return runs[id(self)](*given)

    return call


def launches_of(device: str, name: str) -> tuple[str, ...]:
    """Return the ways in which a compiler's result is launched on a device.

    Example:
        >>> launches_of("cpu", "default")
        ('calls',)
    """
    return LAUNCHES[:1] if device == "cpu" or name in OWN_GRAPHS else LAUNCHES


def launched(law: Law, launch: str, device: str) -> Callable[[], Any]:
    """Return a call of a law from its own state, on an accelerator as one graph if asked."""
    import torch

    if launch == "calls":

        def call() -> Any:
            torch.compiler.cudagraph_mark_step_begin()
            return law.step(law.state)

        return call
    if launch == "Recorded":
        from seals.learn.recorded import Recorded

        def keeping(state: Any, given: Any) -> tuple[Any, Any]:
            return state, law.step(given)

        run = Recorded(keeping, (), law.state, torch.Generator(device=device))
        return lambda: run(law.state)
    from tensordict.nn import CudaGraphModule

    from seals.pytree import filled, tensors

    rows = list(tensors(law.state))

    def flat(*given: Any) -> Any:
        return tuple(tensors(law.step(filled(law.state, iter(given)))))

    module = CudaGraphModule(flat)
    return lambda: module(*rows)


def numbers(found: Any) -> Any:
    """Return all tensors that a law gives as one vector, in double precision."""
    import torch

    from seals.pytree import tensors

    return torch.cat([x.double().flatten().cpu() for x in tensors(found)]).numpy()


def pace(call: Callable[[], Any], device: str) -> float:
    """Return the time of one call [s], over a block of calls."""
    import torch

    calls, begin = 0, time.perf_counter()
    while True:
        call()
        calls += 1
        if device != "cpu":
            torch.cuda.synchronize()
        spent = time.perf_counter() - begin
        if spent > TIMED_BLOCK:
            return spent / calls
