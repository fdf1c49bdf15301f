"""Compiled state derivatives of the batch dynamics, common to all stages of a step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from seals.arrays import Array, as_like, column_of
from seals.batch.state import Posture, Rates, TwinState
from seals.errors import ConfigError
from seals.motion import Inputs
from seals.tensor_compiler import compile_law

Ahead = tuple[Rates, Any] | None
"""Rates to go along before others are found, and for how long [s]; None stays where it is."""


class FusedSlopes:
    """Compiled `BatchDynamics.slopes`; arguments that differ between stages are arrays.

    Args:
        slopes: method of a twin.
        like: its array library, which must be PyTorch.

    Raises:
        ConfigError: the twin computes with another array library.
    """

    def __init__(self, slopes: Callable[..., Any], like: Array) -> None:
        if not hasattr(like, "untyped_storage"):
            raise ConfigError(
                f"a twin of {type(like).__module__} arrays cannot be fused.\n"
                "Give like=torch.zeros(1), or leave out fused."
            )
        self._like = like
        self._law = compile_law(slopes)
        self._numbers: dict[float, Array] = {}

    def __call__(
        self,
        state: TwinState,
        ahead: Ahead,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        *,
        posture: Posture | None = None,
    ) -> tuple[Rates, Mapping[str, Array]]:
        """Return the rates and the new memory; a known posture is not used."""
        del posture
        if ahead is None:
            still = state.velocity * 0.0
            ahead = Rates._make([*(x * 0.0 for x in state), still]), 0.0
        rates, span = ahead
        given = inputs._replace(step=self._number(inputs.step))
        found: tuple[Rates, Mapping[str, Array]] = self._law(
            state, (rates, self._number(span)), column_of(time, self._like), given, memory
        )
        return found

    def _number(self, value: Any) -> Array:
        """Return a number as an array (1, 1), cached."""
        if not isinstance(value, int | float):
            return column_of(value, self._like)
        if value not in self._numbers:
            self._numbers[value] = as_like([[value]], self._like)
        return self._numbers[value]
