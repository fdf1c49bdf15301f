"""Recording of work on a GPU as CUDA graphs: of Warp's kernels, and of PyTorch's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

Work = Callable[[], None]
ROUNDS = 3
"""Calls before a recording: libraries choose and load their kernels in the first ones."""


def recorded_warp(work: Work, device: str) -> Work:
    """Return Warp's launches as one graph that is replayed on PyTorch's present stream.

    Args:
        work: launches kernels; called some times before it is recorded.
        device: ``cpu`` records nothing.
    """
    if device == "cpu":
        return work
    import torch
    import warp as wp

    for _ in range(ROUNDS):
        work()
    torch.cuda.synchronize()
    try:
        with wp.ScopedCapture(device=device) as capture:
            work()
    except Exception as cause:  # drivers without what a graph needs say so in many ways
        return _unrecorded(_on_stream(work), cause)
    torch.cuda.synchronize()

    engine: Any = wp

    def replay() -> None:
        stream = engine.stream_from_torch(torch.cuda.current_stream())
        engine.capture_launch(capture.graph, stream=stream)

    return replay


def recorded_torch(work: Work, device: str) -> Work:
    """Return work on PyTorch's tensors, in place, as one graph.

    Args:
        work: reads and writes the same tensors at every call; called some times before.
        device: ``cpu`` records nothing.
    """
    if device == "cpu":
        return work
    import torch

    aside = torch.cuda.Stream()  # type: ignore[no-untyped-call, unused-ignore]
    aside.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(aside):
        for _ in range(ROUNDS):
            work()
    torch.cuda.current_stream().wait_stream(aside)
    graph = torch.cuda.CUDAGraph()
    try:
        with torch.cuda.graph(graph):
            work()
    except RuntimeError as cause:
        torch.cuda.synchronize()
        return _unrecorded(work, cause)
    replay: Work = graph.replay
    return replay


def _on_stream(work: Work) -> Work:
    """Return Warp's launches on PyTorch's present stream."""
    import torch
    import warp

    wp: Any = warp

    def call() -> None:
        with wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream())):
            work()

    return call


def _unrecorded(work: Work, cause: Any) -> Work:
    """Say that work is launched call by call, and return it."""
    text = " ".join(str(cause).split())[:300]
    print(f"note: a step of the worlds cannot be recorded and is slower. {text}", file=sys.stderr)
    return work
