"""Lower bounds of the cost of compiled functions: ``python benchmarks/floors.py``.

Operations are counted in the laws as they are handed to PyTorch's compiler, a piece as often as it
is called, and so are the bytes that its pieces read and write for one robot in single precision.
What a piece keeps in memory between its kernels is not among them. A multiplication and an addition
that go together count as two, at half of the peak each.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any, NamedTuple

import machine

BATCH = 1024
MOVES = {"select", "slice", "stack", "cat", "reshape", "view", "_unsafe_view", "permute", "expand",
         "clone", "alias", "_to_copy", "full", "zeros", "ones", "unsqueeze", "squeeze"}  # fmt: skip
"""Operations that move numbers and compute none."""


class Cost(NamedTuple):
    """Cost of one call for one robot: operations and bytes.

    Args:
        operations: that compute.
        read: by the pieces, the whole one and those it calls [B].
        written: likewise [B].
    """

    operations: float
    read: float
    written: float

    def plus(self, other: Cost, times: int) -> Cost:
        """Return the sum of this cost and another one, so many times."""
        return Cost(*(a + times * b for a, b in zip(self, other, strict=True)))


PIECES: list[Cost] = []
"""Costs of all pieces of this process, by their numbers."""


def cost_of(graph: Any, inner: list[Cost]) -> Cost:
    """Return the cost of a traced function, given the pieces traced before it."""
    total = Cost(0.0, 0.0, 0.0)
    for node in graph.graph.nodes:
        name = str(node.target)
        if node.op == "placeholder":
            total = total.plus(Cost(0.0, size_of(node), 0.0), 1)
        elif node.op == "output":
            # results are as wide as what makes them; the same one twice is written once
            for made in dict.fromkeys(node.args[0]):
                total = total.plus(Cost(0.0, 0.0, size_of(made)), 1)
        elif name.startswith("seals.fused"):
            total = total.plus(inner[node.args[0]], 1)
        elif name.startswith("aten.") and name.split(".")[1] not in MOVES:
            total = total.plus(Cost(1.0, 0.0, 0.0), 1)
    return total


def size_of(node: Any) -> float:
    """Return the bytes of a tensor for one robot; a number for all of them counts nothing."""
    value = node.meta.get("val")
    shape = getattr(value, "shape", ())
    return value.numel() * value.element_size() / BATCH if BATCH in shape else 0.0


def watched(fly: Callable[[], None]) -> Cost:
    """Return the cost of the last law that is compiled while something is called."""
    from seals.tensor_compiler import fused

    compiled = fused.compiled

    def note(graph: Any, given: Any) -> Any:
        from torch._subclasses.fake_tensor import FakeTensorMode
        from torch.fx.passes.fake_tensor_prop import FakeTensorProp

        mode = FakeTensorMode(allow_non_fake_inputs=True)
        FakeTensorProp(graph, mode).propagate(*given)
        PIECES.append(cost_of(graph, PIECES))
        return graph

    fused.compiled = note
    try:
        fly()
    finally:
        fused.compiled = compiled
    return PIECES[-1]


def vehicle(kind: str) -> Cost:
    """Return the cost of a Runge-Kutta step of a rigid vehicle with eight effects."""
    from twin import like_of, vehicles

    twin, state = vehicles(kind, BATCH, like_of("cpu", single=True), fused=True)
    return watched(lambda: twin.step(state, 0.0, 0.004) and None)


def manipulator() -> Cost:
    """Return the cost of a control step of an environment of the manipulator."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    config = compose(["env=reach", "backend=twin", "backend.fused=true"], root="learn")
    environment = batched_of(config, count=BATCH)
    environment.reset(list(range(BATCH)))
    still = torch.zeros(BATCH, environment.action_size)
    return watched(lambda: environment.step(still) and None)


def main() -> None:
    """Print operations, bytes and the speeds that a device allows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peak", type=float, default=67.0, help="single precision [TFLOP/s]")
    parser.add_argument("--memory", type=float, default=4.8, help="[TB/s]")
    given = parser.parse_args()
    print(machine.describe())
    print(f"{'law':22} {'operations':>10} {'bytes':>8} {'million/s by either':>22}")
    laws: dict[str, Callable[[], Cost]] = {
        "sphere, a step": lambda: vehicle("sphere"),
        "box, a step": lambda: vehicle("box"),
        "cylinder, a step": lambda: vehicle("cylinder"),
        "reach, a control step": manipulator,
    }
    for name, law in laws.items():
        cost = law()
        moved = cost.read + cost.written
        limits = 0.5e6 * given.peak / cost.operations, 1e6 * given.memory / moved
        print(f"{name:22} {cost.operations:10.0f} {moved:8.0f} {limits[0]:11.0f} {limits[1]:10.0f}")


if __name__ == "__main__":
    machine.one_thread()
    main()
