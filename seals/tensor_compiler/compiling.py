"""Compilation of a traced graph by Inductor."""

from __future__ import annotations

import operator
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from seals.caches import use_private_compiler_cache
from seals.errors import ConfigError

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule

OWN = 64
"""Parameters of its own that a row of a law may have before an accelerator's kernels stay small:
each takes a register."""


def compiled(graph: GraphModule, given: Sequence[Tensor]) -> Callable[..., Any]:
    """Compile a traced function to kernels.

    Raises:
        ConfigError: PyTorch's compiler finds no C++ compiler, or does not run.
    """
    use_private_compiler_cache()
    from torch._inductor import compile as inductor

    try:
        with warnings.catch_warnings():
            # of the compiler's own parts, about one another
            warnings.simplefilter("ignore", DeprecationWarning)
            warnings.simplefilter("ignore", FutureWarning)
            run: Callable[..., Any] = inductor(graph, list(given), _options(graph, given))
    except (RuntimeError, OSError) as problem:
        said = (str(problem).splitlines() or [type(problem).__name__])[0]
        raise ConfigError(
            f"fused: PyTorch's compiler failed: {said}\n"
            "It needs a C++ compiler such as g++; an accelerator needs Triton as well.  "
            "Or leave out backend.fused, or fused=True."
        ) from problem
    return run


def _options(graph: GraphModule, given: Sequence[Tensor]) -> dict[str, Any]:
    """Return compiler settings for columns of one length, those that it knows."""
    from torch._inductor import config

    # results are written side by side, not worked out again for every place of the whole
    wanted = {"max_pointwise_cat_inputs": 0, "max_complex_pointwise_cat_inputs": 0}
    if given[0].device.type == "cpu":
        # what is used often is worked out once, and kernels are large enough to keep it in them
        wanted |= {"realize_reads_threshold": 2, "realize_opcount_threshold": 10}
        wanted["max_fusion_size"] = 256
    else:
        # the compiler's own choice is 64: larger kernels send less through memory, as long as
        # registers hold what they need
        wanted["max_fusion_size"] = 128 if held_by_row(graph, given) < OWN else 48
    return {name: value for name, value in wanted.items() if hasattr(config, name)}


def held_by_row(graph: GraphModule, given: Sequence[Tensor]) -> int:
    """Return the number of values per batch row that a traced function holds in memory.

    Rows may be held some at a time, one below the other; a table has other lengths.
    """
    rows = max((x.shape[0] for x in given if x.ndim and x.shape[0]), default=1)
    names = {str(node.target) for node in graph.graph.find_nodes(op="get_attr")}
    held: list[Tensor] = [operator.attrgetter(name)(graph) for name in names]
    lengths = {rows * k for k in range(1, 17)}
    return sum(x.numel() // rows for x in held if not lengths.isdisjoint(x.shape))
