"""Recording of work on a GPU as one CUDA graph: launches of Warp and of PyTorch in their order."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

Work = Callable[[], None]
ROUNDS = 3
"""Calls before a recording: libraries choose and load their kernels in the first ones."""


def recorded(work: Work, device: str) -> Work:
    """Return work as one graph that is replayed on PyTorch's present stream.

    Warp records, for only it can insert the loops of its solver; PyTorch launches into the same
    stream, and takes what it needs from a pool that lives as long as the graph.

    Args:
        work: reads and writes the same memory at every call; called some times before.
        device: ``cpu`` records nothing.
    """
    if device == "cpu":
        return work
    import torch
    import warp

    wp: Any = warp
    pool = torch.cuda.MemPool()
    aside = torch.cuda.Stream()  # type: ignore[no-untyped-call, unused-ignore]
    stream = wp.stream_from_torch(aside)
    torch.cuda.synchronize()
    with torch.cuda.use_mem_pool(pool), torch.cuda.stream(aside), wp.ScopedStream(stream):
        for _ in range(ROUNDS):
            work()
        torch.cuda.synchronize()
        try:
            with wp.ScopedCapture(stream=stream) as capture:
                work()
        except (
            RuntimeError
        ) as cause:  # both libraries tell so of a driver without what a graph needs
            return _unrecorded(work, cause)
    torch.cuda.synchronize()

    def replay(pool: Any = pool) -> None:
        wp.capture_launch(capture.graph, stream=wp.stream_from_torch(torch.cuda.current_stream()))

    return replay


def _unrecorded(work: Work, cause: Any) -> Work:
    """Say that work is launched call by call, and return it, on PyTorch's present stream."""
    import torch
    import warp

    wp: Any = warp
    torch.cuda.synchronize()
    text = " ".join(str(cause).split())[:300]
    print(f"note: a step of the worlds cannot be recorded and is slower. {text}", file=sys.stderr)

    def call() -> None:
        with wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream())):
            work()

    return call
