"""CUDA graph of a function of tensors: recorded once, replayed at each call."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from seals.pytree import copied, put

if TYPE_CHECKING:
    from torch import Generator

ROUNDS = 3
"""Calls before the recording: libraries choose their kernels in the first ones."""


class Recorded:
    """Function of tensors recorded as one CUDA graph.

    State and inputs lie in tensors of their own, which every replay reads and the state of which it
    replaces; a replay takes no decision and no number from the host.

    Args:
        law: takes a state and an input, and returns the next state and its output; nested
            tuples and mappings of tensors, of the same form at every call.
        state: nested tuples and mappings of tensors.
        given: the input, likewise.
        generator: of all random numbers that the law draws.
    """

    def __init__(
        self,
        law: Callable[[Any, Any], tuple[Any, Any]],
        state: Any,
        given: Any,
        generator: Generator,
    ) -> None:
        """Call the law a few times, record it, and restore the state."""
        import torch

        self.state, self._given = copied(state), copied(given)
        before = generator.get_state()
        aside = torch.cuda.Stream()  # type: ignore[no-untyped-call, unused-ignore]
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):
            for _ in range(ROUNDS):
                law(self.state, self._given)
        torch.cuda.current_stream().wait_stream(aside)
        self._graph = torch.cuda.CUDAGraph()
        self._graph.register_generator_state(generator)
        with torch.cuda.graph(self._graph):
            after, self._output = law(self.state, self._given)
            put(after, self.state)
        generator.set_state(before)

    def __call__(self, given: Any) -> Any:
        """Return the output of the step for an input and the stored state."""
        put(given, self._given)
        self._graph.replay()
        return copied(self._output)

    def begin(self, state: Any) -> None:
        """Continue from another state."""
        put(state, self.state)
