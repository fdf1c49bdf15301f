"""Law of one row as a kernel of an accelerator, a thread a row."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array, looping
from seals.caches import cache_folder, keep, kept
from seals.pytree import leaves, mapped
from seals.scalar_compiler import functions
from seals.scalar_compiler.clike import literal, statements_of, tables_of_graph
from seals.scalar_compiler.graph import Node
from seals.scalar_compiler.kernel import CannotCompile, followed

if TYPE_CHECKING:
    from torch import Tensor

THREADS = 128
"""Threads of a block."""
MANY, BLOCKS = 200_000, 3
"""Rows from which on a kernel is limited to the registers with which a multiprocessor holds so many
blocks. Of a million manipulators a card of type H200 then makes 79 to 88 million steps a second in
place of 70 to 73, of a quarter of a million 75 in place of 69; of 65,536, which do not fill it, 55
in place of 61."""
LONGEST = 200_000
"""Statements of a kernel that a compiler takes in a minute or two; a manipulator has 20,000."""


class DeviceRowKernel:
    """Law on arrays of one row, compiled for tensors of many rows on an accelerator.

    The graph is the one that becomes machine code for a processor, see `RowKernel`, with loops
    where the law iterates; it is compiled by NVRTC, which PyTorch for CUDA brings. Tensors are read
    and written component by component, so that neighbouring threads read neighbouring numbers.

    Args:
        law: pure, of arrays; it returns arrays. Their first axis is the batch, or that of links
            within which the batch is: of one row m, of N rows m N, link by link.
        shapes: of its arguments for one row.
        like: tensor whose type and device to use.
        rows: about how many there will be.

    Raises:
        CannotCompile: the law asks for a number to decide what it does, or there is no compiler.
    """

    def __init__(
        self,
        law: Callable[..., Sequence[Array]],
        shapes: Sequence[tuple[int, ...]],
        like: Tensor,
        rows: int = 0,
    ) -> None:
        with looping(functions.loop):
            results = followed(law, shapes, single=_kind(like) == "float")
        self._shapes = [tuple(shape) for shape in shapes]
        self._results, self._like = results, like
        bounds = f"__launch_bounds__({THREADS}, {BLOCKS}) " if rows >= MANY else ""
        self.text, tables = source_of(results, self._shapes, _kind(like), bounds)
        self._tables = [like.new_tensor(table.values.ravel()) for table in tables]
        with _device_of(like):
            self._kernel = _compiled(self.text)
        self._same: dict[tuple[int, int], Tensor] = {}

    def __call__(self, given: Sequence[Tensor]) -> list[Tensor]:
        """Return the results for tensors of N rows."""
        rows = len(given[0]) // self._shapes[0][0]
        held = [_turned(x.to(self._like.dtype)).contiguous() for x in given]
        out = [self._memory(k, rows) for k in range(len(self._results))]
        written = [x for x, r in zip(out, self._results, strict=True) if r.numbers is None]
        blocks = -(-rows // THREADS)
        with _device_of(self._like):
            self._kernel(
                grid=(blocks, 1, 1),
                block=(THREADS, 1, 1),
                args=[*self._tables, *held, *written, rows],
            )
        return [_turned(x) for x in out]

    def _memory(self, k: int, rows: int) -> Tensor:
        """Return memory for a result, its last axis first; what no row changes stands there."""
        import torch

        result = self._results[k]
        links, *rest = result.shape
        kind = torch.bool if result.dtype == np.bool_ else self._like.dtype
        if result.numbers is None:
            shape = (*rest[::-1], links * rows)
            return torch.empty(shape, dtype=kind, device=self._like.device)
        key = k, rows
        if key not in self._same:
            same = self._like.new_tensor(result.numbers).to(kind)
            self._same[key] = _turned(same.repeat_interleave(rows, dim=0)).contiguous()
        return self._same[key]


class DeviceLaw:
    """Law on nests of tensors as one kernel of an accelerator, compiled for its first call.

    Args:
        law: of one row, on traced arrays.
        like: tensor whose type and device to use.
    """

    def __init__(self, law: Callable[..., Any], like: Any) -> None:
        self._law, self._like = law, like
        self._kernel: Any = None
        self._form: Any = None

    def __call__(self, *given: Any) -> Any:
        """Return the results for nests of tensors, of which the last one has N rows.

        Raises:
            CannotCompile: see `DeviceRowKernel`.
        """
        flat = list(leaves(given))
        if self._kernel is None:
            self._kernel = self._compiled(given, flat)
        found = iter(self._kernel(flat))
        return mapped(self._form, lambda leaf: next(found))

    def _compiled(self, given: Any, flat: list[Any]) -> DeviceRowKernel:
        count = flat[-1].shape[0]
        shapes = [(x.shape[0] // count, *x.shape[1:]) for x in flat]

        def law(*arrays: Array) -> list[Array]:
            more = iter(arrays)
            self._form = self._law(*mapped(given, lambda leaf: next(more)))
            return list(leaves(self._form))

        return DeviceRowKernel(law, shapes, self._like, count)


def by_component(nest: Any) -> Any:
    """Return nested tensors in the memory layout of kernels, which they otherwise copy them to."""
    return mapped(nest, lambda x: _turned(_turned(x).contiguous()))


def source_of(
    results: Sequence[Any], shapes: Sequence[tuple[int, ...]], number: str, bounds: str = ""
) -> tuple[str, list[Any]]:
    """Return the text of a kernel ``rows``, and the tables that come before its arguments.

    Args:
        results: traced arrays.
        shapes: of the arguments.
        number: ``float`` or ``double``.
        bounds: of its registers, as C for a graphics card states them.
    """
    entries: list[Any] = []
    writes: list[str] = []
    for k, result in enumerate(results):
        places = _places(result.shape, f"r{k}")
        for entry, place in zip(result.entries.flat, places, strict=True):
            if result.numbers is None:
                entries.append(entry)
                writes.append(place)
    reads = [place for k, shape in enumerate(shapes) for place in _places(shape, f"a{k}")]
    tables = tables_of_graph(entries)
    lines = statements_of(entries, "IN{}", "OUT{}", number=number)
    if len(lines) > LONGEST:
        raise CannotCompile(f"a kernel of {len(lines)} statements would take too long to compile")
    heads = [f"#define IN{k} {place}" for k, place in enumerate(reads)]
    heads += [f"#define OUT{k} {place}" for k, place in enumerate(writes)]
    # results that are numbers in an array of others
    still = [
        f"OUT{k} = {literal(x, number)};" for k, x in enumerate(entries) if not isinstance(x, Node)
    ]
    given = [f"const {number}* __restrict__ table{k}" for k in range(len(tables))]
    given += [f"const {number}* __restrict__ a{k}" for k in range(len(shapes))]
    given += [
        f"{'bool' if r.dtype == np.bool_ else number}* __restrict__ r{k}"
        for k, r in enumerate(results)
        if r.numbers is None
    ]
    body = "\n".join([*lines, *still])
    head = "\n".join(heads)
    text = f"""{head}
extern "C" __global__ void {bounds}rows({", ".join(given)}, int n) {{
const int i = blockIdx.x * blockDim.x + threadIdx.x;
if (i >= n) return;
{body}
}}
"""
    return text, tables


def _places(shape: Sequence[int], name: str) -> list[str]:
    """Return the places of the entries of an array of one row among those of n."""
    links, *rest = shape
    inner = int(np.prod(rest, dtype=int))
    # entry (link, component) of row i; components are kept in reversed order of axes
    order = np.arange(inner).reshape(rest[::-1]).transpose().ravel() if rest else np.zeros(1, int)
    return [
        f"{name}[{int(c) * links + link} * (size_t)n + i]" for link in range(links) for c in order
    ]


def _turned(x: Tensor) -> Tensor:
    """Return a view with the axes in reversed order."""
    return x.permute(*range(x.ndim - 1, -1, -1))


def _device_of(like: Tensor) -> contextlib.AbstractContextManager[Any]:
    """Return a context in which a tensor's accelerator, one of several, is the present one."""
    import torch

    return torch.cuda.device(like.device) if like.is_cuda else contextlib.nullcontext()


def _kind(like: Tensor) -> str:
    return "double" if like.dtype.itemsize == 8 else "float"


def _compiled(text: str) -> Any:
    """Return a kernel, from the private cache where it was compiled before.

    Raises:
        CannotCompile: this PyTorch has no compiler for kernels, or it refuses the text.
    """
    import torch

    try:
        from torch.cuda import _utils as compiler

        load, compile_text = compiler._cuda_load_module, compiler._nvrtc_compile
    except (AttributeError, ImportError) as problem:
        raise CannotCompile(
            f"PyTorch {torch.__version__} compiles no kernels.\nInstall torch>=2.9 for CUDA"
        ) from problem
    capability = "".join(map(str, torch.cuda.get_device_capability()))
    key = hashlib.sha256(f"{torch.version.cuda} {capability} {text}".encode()).hexdigest()
    place = cache_folder("kernels") / f"{key}.cubin"
    code = kept(place)
    if code is None:
        try:
            code = bytes(compile_text(text, "rows", capability)[0])
        except RuntimeError as problem:
            raise CannotCompile(f"the kernel was refused: {problem}") from problem
        with contextlib.suppress(OSError):  # compiled anew the next time
            keep(place, code)
    kernels: Any = load(code, ["rows"])
    return kernels["rows"]
