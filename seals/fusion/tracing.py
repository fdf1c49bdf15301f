"""A law as a list of what it does to numbers, found by following it once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from seals.arrays import undecided
from seals.errors import ConfigError
from seals.fusion.tidying import tidied

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule

SMALL = 6
"""Largest side of matrices whose products are written out."""
_FOLLOWING: list[bool] = []


def following() -> bool:
    """Return whether a law is being followed: numbers do not matter then, only what is done."""
    return bool(_FOLLOWING)


def traced(law: Callable[..., list[Tensor]], given: Sequence[Tensor]) -> GraphModule:
    """Follow a law and return what it does, with its constants worked out.

    Args:
        law: of tensors, without memory; what it decides by numbers is decided as for an
            accelerator, see `seals.arrays.some`.
        given: tensors of the shapes, types and device that it will be given.

    Raises:
        ConfigError: the law asks for a number to decide what it does next.
    """
    import torch
    from torch.fx.experimental.proxy_tensor import make_fx

    products = {torch.ops.aten.bmm.default: _product}
    _FOLLOWING.append(True)
    try:
        with undecided(), torch.no_grad():
            # what is written in place is as if it had been made anew
            pure = torch.func.functionalize(law)
            graph = make_fx(pure, decomposition_table=products)(*given)
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


def _product(a: Tensor, b: Tensor) -> Any:
    """Products of many small matrices, entry by entry; of large ones as ever."""
    import torch

    rows, inner, columns = *a.shape[1:], b.shape[2]
    if max(rows, inner, columns) > SMALL or a.shape[0] < SMALL:
        return NotImplemented
    entries = [
        sum((a[:, i, k] * b[:, k, j] for k in range(1, inner)), a[:, i, 0] * b[:, 0, j])
        for i in range(rows)
        for j in range(columns)
    ]
    return torch.stack(entries, dim=1).reshape(-1, rows, columns)


def _place(problem: BaseException) -> str:
    """Return file and line of a law where a problem arose."""
    trace, place = problem.__traceback__, "a law"
    while trace is not None:
        name = trace.tb_frame.f_globals.get("__name__", "")
        if not name.startswith(("torch", "seals.fusion", "seals.arrays", "array_api_compat")):
            place = f"{name}, line {trace.tb_lineno},"
        trace = trace.tb_next
    return place
