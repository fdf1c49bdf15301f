"""Compiled function of a scalar graph, cached on disk."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import itertools
import weakref
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats, undecided
from seals.caches import cache_folder, keep, kept
from seals.errors import ConfigError, MissingExtra, line_in_law, optional_import
from seals.scalar_compiler.graph import SINGLE, Node, given
from seals.scalar_compiler.llvm import text_of
from seals.scalar_compiler.traced import Traced, constant

_FLOAT = np.dtype(np.float64)
_FOLLOWERS = ("numpy", "seals.scalar_compiler", "seals.arrays", "array_api")


_LOADED: weakref.WeakValueDictionary[str, Any] = weakref.WeakValueDictionary()
"""Engines that hold machine code at present, by the key of their text: equal robots share them."""
REFUSED = (ArithmeticError, AttributeError, ConfigError, LookupError, TypeError, ValueError)
"""What a law raises that asks for more than arrays of the array API can do."""


class CannotCompile(ConfigError):
    """A law that has no machine code."""


class View:
    """Place of an array in a block of numbers.

    Args:
        shape: of the array.
        start: numbers before it.
    """

    __slots__ = ("_bytes", "shape", "size", "start")

    def __init__(self, shape: tuple[int, ...], start: int) -> None:
        self.shape, self.start, self.size, self._bytes = shape, start, _size(shape), 8 * start

    def of(self, block: Floats) -> Floats:
        """Return the array in a block; it shares the memory."""
        found: Floats = np.ndarray(self.shape, _FLOAT, block, self._bytes)
        return found


class Kernel:
    """Law as machine code: arrays of fixed shapes in, arrays out.

    Args:
        code: the engine that holds it, and the address of the function.
        shapes: of the arguments.
        results: of the law, numbers and nodes.
        work: memory for what it keeps meanwhile, see `seals.scalar_compiler.llvm.Text`.

    Attributes:
        address: of the function.
        memory: its arguments, its results, and what it keeps meanwhile, numbers side by side.
        places: views of the arguments.
        views: the places of all arguments, and of all results, in the memory.
        tables: that it looks numbers up in.
    """

    tables: Sequence[Any] = ()

    def __init__(
        self,
        code: tuple[Any, int],
        shapes: Sequence[tuple[int, ...]],
        results: Sequence[Traced],
        work: Floats,
    ) -> None:
        self._engine, self.address = code
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(self.address)
        self._given, self._out = (
            np.zeros(max(1, sum(_size(s) for s in part)))
            for part in (shapes, [x.shape for x in results])
        )
        self._work = work
        self.places = [v.reshape(s) for v, s in zip(_cut(self._given, shapes), shapes, strict=True)]
        starts = np.cumsum([0, *(x.entries.size for x in results)]).tolist()
        # the end of a vector, or 0: a slice takes a third of the time of another view
        self._results = [
            (x.shape, k, k + x.size if x.ndim == 1 else 0)
            for x, k in zip(results, starts, strict=False)
        ]
        for view, x in zip(_cut(self._out, [r.shape for r in results]), results, strict=True):
            view[:] = [0.0 if isinstance(e, Node) else e for e in x.entries.flat]
        self.memory = (self._given, self._out, self._work)
        first = np.cumsum([0, *(_size(s) for s in shapes)]).tolist()
        self.views = (
            [View(s, k) for s, k in zip(shapes, first, strict=False)],
            [View(x.shape, k) for x, k in zip(results, starts, strict=False)],
        )
        self._run = functools.partial(call, *(x.ctypes.data for x in self.memory))

    def __call__(self, *values: Any) -> list[Floats]:
        """Return the results for arguments of the traced shapes."""
        self.put(values)
        self._run()
        return self.results(self._out)

    def put(self, values: Sequence[Any]) -> None:
        """Set the arguments."""
        for place, value in zip(self.places, values, strict=True):
            place[...] = value

    def results(self, memory: Floats) -> list[Floats]:
        """Return a copy of the results in memory like that of the law."""
        out = memory.copy()
        # a fraction of the time of cutting and reshaping
        return [
            out[place:end] if end else np.ndarray(shape, _FLOAT, out, 8 * place)
            for shape, place, end in self._results
        ]


def compiled(law: Callable[..., Sequence[Any]], shapes: Sequence[tuple[int, ...]]) -> Kernel:
    """Compile a law on the array API for arguments of some shapes.

    The machine code is kept in the private cache folder, by its text. It does what the law does,
    operation by operation, in double precision; products with a constant 0 are 0, and what the law
    decides by numbers is decided as for an accelerator, see `seals.arrays.some`.

    Args:
        law: pure, of arrays; it returns arrays.
        shapes: of its arguments.

    Raises:
        CannotCompile: the law asks for a number to decide what it does, or for what only NumPy has;
            or llvmlite is not installed, or broken.
    """
    results = followed(law, shapes)
    text = text_of([entry for x in results for entry in x.entries.flat])
    found = Kernel(written(text.lines, "law"), shapes, results, text.memory())
    found.tables = text.tables
    return found


def written(text: str, name: str) -> tuple[Any, int]:
    """Return an engine that holds the code of a text of LLVM, and the address of a function in it.

    Raises:
        CannotCompile: llvmlite is not installed, or broken.
    """
    try:
        return _machine_code(text, name)
    except (MissingExtra, OSError, RuntimeError) as problem:
        raise CannotCompile(str(problem)) from problem


def followed(
    law: Callable[..., Sequence[Any]],
    shapes: Sequence[tuple[int, ...]],
    *,
    single: bool = False,
) -> list[Traced]:
    """Follow a law on the array API for arguments of some shapes, whose entries are numbered.

    Args:
        law: pure, of arrays; it returns arrays.
        shapes: of its arguments.
        single: whether numbers are in single precision, but where the law asks for more.

    Raises:
        CannotCompile: the law asks for a number to decide what it does, or for what only NumPy has.
    """
    graph: dict[Any, Any] = {SINGLE: True} if single else {}
    numbers = iter(range(sum(_size(s) for s in shapes)))
    traced = [
        Traced(np.array([given(next(numbers), graph) for _ in range(_size(s))], dtype=object))
        for s in shapes
    ]
    try:
        with undecided():
            found = law(*(x.reshape(s) for x, s in zip(traced, shapes, strict=True)))
    except REFUSED as problem:
        raise CannotCompile(
            f"this robot cannot be compiled: {line_in_law(problem, _FOLLOWERS)}: {problem}.\n"
            "Write the law without branches on numbers (see seals.arrays.some), or take "
            "backend.compiled=false"
        ) from problem
    return [constant(x) for x in found]


def _size(shape: tuple[int, ...]) -> int:
    return int(np.prod(shape, dtype=int))


def _cut(memory: Floats, shapes: Sequence[tuple[int, ...]]) -> list[Floats]:
    ends = np.cumsum([0, *(_size(s) for s in shapes)]).tolist()
    return [memory[a:b] for a, b in itertools.pairwise(ends)]


def _machine_code(text: str, name: str) -> tuple[Any, int]:
    # a fresh machine, which an engine takes over
    with optional_import(
        "backend.compiled=true needs the package llvmlite",
        "Install it: pip install llvmlite, or take backend.compiled=auto",
    ):
        from llvmlite import binding
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    target = binding.Target.from_default_triple()
    # no features of this very processor: the same numbers on all of its kind
    llvm, machine = binding, target.create_target_machine(opt=2, jit=True)
    key = hashlib.sha256(f"{llvm.llvm_version_info} {machine.triple} {text}".encode()).hexdigest()
    engine = _LOADED.get(key)
    if engine is not None:
        return engine, engine.get_function_address(name)
    place = cache_folder("kernels") / f"{key}.o"
    found = kept(place)
    if found is None:
        module = llvm.parse_assembly(text)
        module.verify()
        found = machine.emit_object(module)
        with contextlib.suppress(OSError):  # compiled anew the next time
            keep(place, found)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.object_file.ObjectFileRef.from_data(found))
    engine.finalize_object()
    _LOADED[key] = engine
    return engine, engine.get_function_address(name)
