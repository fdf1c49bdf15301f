"""Compiled functions: traced and compiled at the first call for each form of arguments."""

from __future__ import annotations

import functools
import operator
import warnings
import weakref
from collections.abc import Callable, Hashable, Sequence
from itertools import count
from typing import TYPE_CHECKING, Any

from seals.arrays import deciding, undecided
from seals.caches import use_private_compiler_cache
from seals.errors import ConfigError
from seals.pytree import filled, form_of, is_tensor, mapped, tensors
from seals.tensor_compiler.tracing import following, traced

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule


_NUMBERS = count()
_PIECES: weakref.WeakValueDictionary[int, Piece] = weakref.WeakValueDictionary()


class Fused:
    """Function of nested tensors, compiled into few kernels.

    The first call with a form (shapes, types, device, and all that is not a tensor) follows the law
    and compiles it, which takes minutes for a robot of many parts; later calls run what was
    compiled. A fused law that another one calls stays a piece of its own: it is compiled once,
    however often it is called.
    Results carry no gradients.

    Args:
        law: without memory; it gives back nests of tensors. What it holds besides stays as it was
            at the first call.

    Raises:
        ConfigError: the law takes decisions by numbers, or there is no compiler.
    """

    def __init__(self, law: Callable[..., Any]) -> None:
        self._law = law
        self._pieces: dict[Hashable, Piece] = {}

    def __call__(self, *given: Any) -> Any:
        """Return the result of the law."""
        given = mapped(given, lambda leaf: _columnar(leaf) if is_tensor(leaf) else leaf)
        form = form_of(given)
        if form not in self._pieces:
            self._pieces[form] = Piece(self._law, given)
        return self._pieces[form](given)


def compile_law(law: Callable[..., Any], *, nested: bool = False) -> Callable[..., Any]:
    """Return a function that is compiled at its first call for each form of arguments.

    Args:
        law: as for `Fused`: a pure function of nested tuples and mappings of tensors.
        nested: compile only within other compiled laws, as a piece of its own that they share;
            called alone, the law runs as it is. As a decorator:
            ``@functools.partial(compile_law, nested=True)``.
    """
    fused = Fused(law)
    if not nested:
        return fused

    @functools.wraps(law)
    def call(*given: Any) -> Any:
        return law(*given) if deciding() else fused(*given)

    return call


class Piece:
    """Function compiled for one form of arguments."""

    def __init__(self, law: Callable[..., Any], given: Any) -> None:
        import torch

        # copy tensors that occur twice: later calls may give different ones
        seen: set[int] = set()
        rows = []
        for x in tensors(given):
            rows.append(x.clone() if id(x) in seen else x)
            seen.add(id(x))
        with torch.no_grad():
            # what a law prepares at its first call must not be prepared while it is followed
            with undecided():
                law(*given)

            def flat(*values: Tensor) -> list[Tensor]:
                inner = filled(given, iter(values))
                made, self._nest = _made(law(*inner), values)
                return made

            self._run = compiled(traced(flat, rows), rows)
            made = self._run(*rows)
        self._sample = made
        self._number = next(_NUMBERS)
        _PIECES[self._number] = self

    def __call__(self, given: Any) -> Any:
        """Return the result of the law, in its own structure."""
        import torch

        rows = list(tensors(given))
        with torch.no_grad():
            made = self._run(*rows) if deciding() else _operator()(self._number, rows)

        def placed(leaf: Any) -> Any:
            return leaf.of(rows, made) if isinstance(leaf, _Place) else leaf

        return mapped(self._nest, placed)

    def run(self, rows: Sequence[Tensor]) -> list[Tensor]:
        """Return the output tensors; while tracing, those of the first call.

        What is compiled does not run there; nor may the numbers be wild, for some are places.
        """
        return [x.clone() for x in self._sample] if following() else list(self._run(*rows))

    def empty(self) -> list[Tensor]:
        """Return uninitialised tensors like the outputs."""
        import torch

        kinds = ((x.shape, x.stride(), x.dtype, x.device) for x in self._sample)
        return [torch.empty_strided(a, b, dtype=c, device=d) for a, b, c, d in kinds]


class _Place:
    """Origin of a tensor that a law returned."""

    def __init__(self, number: int, *, given: bool) -> None:
        self.number, self.given = number, given

    def of(self, rows: Sequence[Tensor], made: Sequence[Tensor]) -> Tensor:
        return (rows if self.given else made)[self.number]


def _made(found: Any, given: Sequence[Tensor]) -> tuple[list[Tensor], Any]:
    """Return copies of the new tensors, each once, and the structure of their origins.

    What was given and comes back unchanged is not made again.
    """
    import torch

    places = {id(x): _Place(k, given=True) for k, x in enumerate(given)}
    made: list[Tensor] = []
    for x in tensors(found):
        if id(x) not in places:
            places[id(x)] = _Place(len(made), given=False)
            made.append(_columnar(x).clone(memory_format=torch.preserve_format))
    return made, mapped(found, lambda leaf: places.get(id(leaf), leaf))


def _columnar(x: Tensor) -> Tensor:
    """Return a tensor with its first axis fastest in memory, which is efficient on CPU and GPU.

    Tensors of one layout also keep a law in one piece, whoever made them.
    """
    if x.ndim < 2:
        return x
    if x.ndim == 2 and x.stride(0) == 1 and (x.shape[1] == 1 or x.stride(1) == x.shape[0]):
        return x
    return x.movedim(0, -1).contiguous().movedim(-1, 0)


@functools.cache
def _operator() -> Any:
    """Return the operation of a compiled piece within another law."""
    import torch

    def call(number: int, given: Sequence[Tensor]) -> list[Tensor]:
        return _PIECES[number].run(given)

    operator = torch.library.custom_op(
        "seals::fused", call, mutates_args=(), schema="(int number, Tensor[] given) -> Tensor[]"
    )
    operator.register_fake(lambda number, given: _PIECES[number].empty())
    return torch.ops.seals.fused.default


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
