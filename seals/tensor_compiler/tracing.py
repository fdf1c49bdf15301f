"""Tracing of a function into an operator graph, without data-dependent branches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from seals.arrays import undecided
from seals.errors import ConfigError
from seals.tensor_compiler.pure import without_writes
from seals.tensor_compiler.tidying import tidied

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule

_FOLLOWING: list[bool] = []


def following() -> bool:
    """Return whether a function is being traced, so that values are irrelevant."""
    return bool(_FOLLOWING)


def traced(law: Callable[..., list[Tensor]], given: Sequence[Tensor]) -> GraphModule:
    """Trace a function and return its graph, with constants folded.

    Args:
        law: of tensors, without memory; what it decides by numbers is decided as for an
            accelerator, see `seals.arrays.some`.
        given: tensors of the shapes, types and device that it will be given.

    Raises:
        ConfigError: the law asks for a number to decide what it does next.
    """
    import torch

    _FOLLOWING.append(True)
    try:
        with undecided(), torch.no_grad():
            graph = without_writes(law, given)
    except RuntimeError as problem:
        if "tracing tensor" not in str(problem):
            raise
        raise ConfigError(
            f"this robot cannot be fused: {_place(problem)} asks for a number to decide what "
            "comes next.\nGive it one way for all rows, as seals.arrays.some says, or leave out "
            "backend.fused, or fused=True"
        ) from problem
    finally:
        _FOLLOWING.pop()
    return tidied(graph, given[0].device)


def _place(problem: BaseException) -> str:
    """Return file and line of a law that caused a problem."""
    trace, place = problem.__traceback__, "a law"
    while trace is not None:
        name = trace.tb_frame.f_globals.get("__name__", "")
        if not name.startswith(
            ("torch", "seals.tensor_compiler", "seals.arrays", "array_api_compat")
        ):
            place = f"{name}, line {trace.tb_lineno},"
        trace = trace.tb_next
    return place
