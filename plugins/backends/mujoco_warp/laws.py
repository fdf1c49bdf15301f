"""Laws of one robot as one kernel with a thread a world."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array, as_like
from seals.batch.loads import BatchLoads, LinkStates, Loads
from seals.effects.scene import refuse_asking
from seals.motion import Inputs, Joints
from seals.multibody.kinematics import by_batch, by_link
from seals.pytree import leaves, mapped
from seals.scalar_compiler import Traced, followed, statements_of
from seals.world.drivetrain import response_of

if TYPE_CHECKING:
    from torch import Tensor

THREADS = 32
"""Threads of a block: few, so that some thousand worlds are spread over all of a card."""


class LawKernel:
    """Effects on the links of B robots, as `seals.batch.loads.BatchLoads` evaluates them.

    The laws are followed once, for one robot, and written as statements of C in double precision;
    each thread evaluates them for one world.

    Args:
        one: effects on one robot, on NumPy, with the same parameters in every world.
        step: h [s].
        batch: number of worlds B.
        like: tensor whose type and device to use.

    Raises:
        CannotCompile: a law asks for a number to decide what it does.
    """

    def __init__(self, one: BatchLoads, *, step: float, batch: int, like: Tensor) -> None:
        import torch
        import warp

        refuse_asking(one.effects)

        wp: Any = warp
        wp.config.log_level = wp.LOG_WARNING
        wp.init()
        self._one, self._batch = one, batch
        links, joints = len(one.robot.links), one.robot.tree.joints
        self._step, self._still = step, np.zeros((1, joints))
        kept = {name: value.shape for name, value in one.zero_memory().items()}
        self._names = tuple(kept)
        rows, turns = (1, links, 3), (1, links, 3, 3)
        drives = len(response_of(one.effects).lag)
        self._drives = [(1, drives)] if drives else []
        shapes = [rows, turns, rows, rows, *[(1, joints)] * 3, *self._drives, (1, 1)]
        shapes += kept.values()
        nest, size = self._followed(shapes)
        given = sum(int(np.prod(shape)) for shape in shapes)
        self._given = torch.zeros((given, batch), dtype=like.dtype, device=like.device)
        self._out = torch.zeros((size, batch), dtype=like.dtype, device=like.device)
        self._found = mapped(nest, lambda part: part.placed(self._out, like))
        self._engine, self._kernel = wp, kernel_of(self._lines)
        self._arrays = [wp.from_torch(x.reshape(-1)) for x in (self._given, self._out)]

    def _followed(self, shapes: list[tuple[int, ...]]) -> tuple[Loads, int]:
        """Follow the laws; return where their results will lie, and how many numbers they are."""
        nest: list[Loads] = []

        def law(*given: Array) -> list[Array]:
            nest.append(self._evaluated(*given))
            return list(leaves(nest[0]))

        results = followed(law, shapes)
        self._lines = statements_of(
            [entry for x in results for entry in x.entries.flat],
            "given.data[tid + {} * count]",
            "out.data[tid + {} * count]",
        )
        parts, place = [], 0
        for x in results:
            parts.append(_Part(x, place))
            place += x.size
        found = iter(parts)
        return mapped(nest[0], lambda _: next(found)), place

    def _evaluated(self, *given: Array) -> Loads:
        origins, turns, linear, angular, places, rates, command, *rest = given
        drive = rest.pop(0) if self._drives else None
        time, *memory = rest
        inputs = Inputs(self._step, self._still, drive, joint_command=command)
        kept = dict(zip(self._names, memory, strict=True))
        states = LinkStates(origins, turns, linear, angular)
        return self._one.evaluate(states, Joints(places, rates), time, inputs, kept)

    def evaluate(
        self,
        states: LinkStates,
        joints: Joints,
        time: Tensor,
        inputs: Inputs,
        memory: Mapping[str, Tensor],
    ) -> Loads:
        """Return the loads of all effects, see `BatchLoads`; the next call writes over them."""
        import torch

        batch = self._batch
        own = [by_batch(memory[x], len(memory[x]) // batch) for x in self._names]
        drive = [inputs.drive] if self._drives else []
        parts = (*states, *joints[:2], inputs.joint_command, *drive, time, *own)
        torch.cat([x.reshape(batch, -1).T for x in parts], out=self._given)
        self._engine.launch(
            self._kernel,
            dim=batch,
            inputs=[*self._arrays, batch],
            device=self._arrays[0].device,
            block_dim=THREADS,
        )
        kept = {}
        for name, x in self._found.memory.items():
            rows = x.reshape(len(x), -1, memory[name].shape[1])
            kept[name] = by_link(rows.expand(batch, -1, -1))
        found: Loads = self._found._replace(memory=kept)
        return found


class _Part:
    """Array among the results: its entries, from a place on."""

    def __init__(self, entries: Traced, place: int) -> None:
        self._entries, self._place = entries, place

    def placed(self, out: Tensor, like: Tensor) -> Tensor:
        """Return the numbers of all worlds, (B, ...), or (1, ...) where they are the same."""
        x = self._entries
        # results of one robot have one row, memory one for each link
        shape = x.shape[1:] if x.shape[0] == 1 else x.shape
        if x.numbers is not None:
            same: Tensor = as_like(x.numbers.reshape(1, *shape), like)
            return same
        rows = slice(self._place, self._place + x.size)
        for row, entry in enumerate(x.entries.flat, start=self._place):
            if isinstance(entry, int | float):
                out[row] = float(entry)
        return out[rows].T.view(-1, *shape)


def kernel_of(lines: list[str]) -> Any:
    """Return a kernel of Warp that runs statements of C for its number ``tid`` of ``count``."""
    import warp

    wp: Any = warp
    text = "\n".join(lines)
    name = f"laws_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    row = wp.array(dtype=float)

    def statements(given: Any, out: Any, tid: Any, count: Any) -> None: ...

    statements.__annotations__ = {"given": row, "out": row, "tid": int, "count": int}
    # Warp knows functions by name: those of another robot are others
    statements.__qualname__ = statements.__name__ = name
    laws = wp.func_native(text)(statements)

    def kernel(given: Any, out: Any, count: Any) -> None:
        laws(given, out, wp.tid(), count)

    kernel.__annotations__ = {"given": row, "out": row, "count": int}
    return wp.kernel(kernel, module="unique", enable_backward=False)
