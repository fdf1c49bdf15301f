"""PyTorch's compiler, with its complaints in words."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule


def compiled(graph: GraphModule, given: Sequence[Tensor]) -> Callable[..., Any]:
    """Return a traced law as kernels.

    Args:
        graph: from `seals.fusion.tracing.traced`.
        given: tensors as it will be given.

    Raises:
        ConfigError: PyTorch's compiler finds no C++ compiler, or does not run.
    """
    from torch._inductor import compile as inductor

    try:
        with warnings.catch_warnings():
            # of the compiler's own parts, about one another
            warnings.simplefilter("ignore", DeprecationWarning)
            warnings.simplefilter("ignore", FutureWarning)
            run: Callable[..., Any] = inductor(graph, list(given), _options(given[0].device.type))
    except (RuntimeError, OSError) as problem:
        said = (str(problem).splitlines() or [type(problem).__name__])[0]
        raise ConfigError(
            f"fused: PyTorch's compiler failed: {said}\n"
            "It needs a C++ compiler such as g++; an accelerator needs Triton as well.  "
            "Or leave out backend.fused, or fused=True."
        ) from problem
    return run


def _options(device: str) -> dict[str, Any]:
    """Return settings of the compiler that suit columns of one length, as far as it knows them."""
    from torch._inductor import config

    # results are written side by side, not worked out again for every place of the whole
    wanted = {"max_pointwise_cat_inputs": 0, "max_complex_pointwise_cat_inputs": 0}
    if device == "cpu":
        # what is used often is worked out once, and kernels are large enough to keep it in them
        wanted |= {"realize_reads_threshold": 2, "realize_opcount_threshold": 10}
        wanted["max_fusion_size"] = 256
    else:
        # twice the compiler's own: less goes through memory, and registers still hold a kernel
        wanted["max_fusion_size"] = 128
    return {name: value for name, value in wanted.items() if hasattr(config, name)}
