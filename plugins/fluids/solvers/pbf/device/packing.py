"""Vectors in 64-bit words, which a CUDA device loads with a half of the instructions or fewer.

The compiler loads every component of a vector by itself. What a sweep gathers from neighbours is
limited by the number of loads, not by their bytes: two words of 64 bits take the place of four
floats, or of the six numbers of a symmetric matrix. On a processor fields stay as they are.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solvers.pbf.language import ti

# bits of a number between -1 and 1, and the exponent that turns them into a float: 2^23 + bits
BITS = 21
MASK = (1 << BITS) - 1
HALF = 1 << (BITS - 1)
EXPONENT = 0x4B000000
OFFSET = 2.0 ** (23 - BITS + 1) + 1.0


@ti.func
def pair(low, high) -> Any:
    """Two floats as one word."""
    first = ti.cast(ti.bit_cast(low, ti.u32), ti.u64)
    return first | (ti.cast(ti.bit_cast(high, ti.u32), ti.u64) << 32)


@ti.func
def low_of(word) -> Any:
    """First float of a word."""
    return ti.bit_cast(ti.cast(word, ti.u32), ti.f32)


@ti.func
def high_of(word) -> Any:
    """Second float of a word."""
    return ti.bit_cast(ti.cast(word >> 32, ti.u32), ti.f32)


@ti.func
def bits_of(x) -> Any:
    """A number in [-1, 1) as bits."""
    n = ti.cast(ti.floor(x * HALF + (HALF + 0.5)), ti.i32)
    return ti.cast(ti.min(ti.max(n, 0), MASK), ti.u64)


@ti.func
def number_of(word, shift: ti.template()) -> Any:
    """The number whose bits begin at ``shift``."""
    bits = ti.cast(word >> shift, ti.u32) & ti.u32(MASK)
    return ti.bit_cast(bits | ti.u32(EXPONENT), ti.f32) * (1.0 / HALF) - OFFSET


@ti.data_oriented
class Quads:
    """Field of vectors of four floats.

    Args:
        fields: where it lives.
        count: number of vectors.
        packed: whether they are stored as words.
    """

    def __init__(self, fields: Any, count: int, packed: bool) -> None:
        self.packed = packed
        self.words: Any = fields.scalar(ti.u64, count, 2) if packed else None
        self.plain: Any = None if packed else fields.vector(4, ti.f32, count)

    @ti.func
    def get(self, i) -> Any:
        """Vector number ``i``."""
        v = ti.Vector([0.0, 0.0, 0.0, 0.0])
        if ti.static(self.packed):
            a, b = self.words[i, 0], self.words[i, 1]
            v = ti.Vector([low_of(a), high_of(a), low_of(b), high_of(b)])
        else:
            v = self.plain[i]
        return v

    @ti.func
    def set(self, i, v):
        """Write vector number ``i``."""
        if ti.static(self.packed):
            self.words[i, 0] = pair(v[0], v[1])
            self.words[i, 1] = pair(v[2], v[3])
        else:
            self.plain[i] = v

    @ti.func
    def set_last(self, i, x):
        """Write the fourth component of vector number ``i``; the others keep their values."""
        if ti.static(self.packed):
            self.words[i, 1] = pair(low_of(self.words[i, 1]), x)
        else:
            self.plain[i][3] = x

    def to_numpy(self) -> NDArray[np.float32]:
        """Copy to the host, shape (count, 4)."""
        if self.packed:
            return np.asarray(self.words.to_numpy()).view(np.float32)
        return np.asarray(self.plain.to_numpy())

    def from_numpy(self, values: NDArray[np.float32]) -> None:
        """Copy from the host, shape (count, 4)."""
        if self.packed:
            whole = np.ascontiguousarray(values, dtype=np.float32)
            self.words.from_numpy(whole.view(np.uint64))
        else:
            self.plain.from_numpy(values)


@ti.data_oriented
class Triples:
    """Field of vectors of three floats.

    Args:
        fields: where it lives.
        count: number of vectors.
        packed: whether they are stored as words, two each.
    """

    def __init__(self, fields: Any, count: int, packed: bool) -> None:
        self.packed = packed
        self.words: Any = fields.scalar(ti.u64, count, 2) if packed else None
        self.plain: Any = None if packed else fields.vector(3, ti.f32, count)

    @ti.func
    def get(self, i) -> Any:
        """Vector number ``i``."""
        v = ti.Vector([0.0, 0.0, 0.0])
        if ti.static(self.packed):
            a = self.words[i, 0]
            v = ti.Vector([low_of(a), high_of(a), low_of(self.words[i, 1])])
        else:
            v = self.plain[i]
        return v

    @ti.func
    def set(self, i, v):
        """Write vector number ``i``."""
        if ti.static(self.packed):
            self.words[i, 0] = pair(v[0], v[1])
            self.words[i, 1] = pair(v[2], 0.0)
        else:
            self.plain[i] = v

    @ti.func
    def add(self, i, v):
        """Add to vector number ``i``."""
        self.set(i, self.get(i) + v)

    def to_numpy(self) -> NDArray[np.float32]:
        """Copy to the host, shape (count, 3)."""
        if self.packed:
            return np.asarray(self.words.to_numpy()).view(np.float32)[:, :3]
        return np.asarray(self.plain.to_numpy())

    def from_numpy(self, values: NDArray[np.float32]) -> None:
        """Copy from the host, shape (count, 3)."""
        if self.packed:
            whole = np.zeros((len(values), 4), np.float32)
            whole[:, :3] = values
            self.words.from_numpy(whole.view(np.uint64))
        else:
            self.plain.from_numpy(values)


@ti.data_oriented
class Symmetrics:
    """Field of symmetric matrices whose six numbers lie in [-1, 1): diagonal, and (yz, xz, xy).

    Args:
        fields: where it lives.
        count: number of matrices.
        packed: whether they are stored as words, to 5e-7.
    """

    def __init__(self, fields: Any, count: int, packed: bool) -> None:
        self.packed = packed
        self.words: Any = fields.scalar(ti.u64, count, 2) if packed else None
        self.plain: Any = None if packed else fields.vector(6, ti.f32, count)

    @ti.func
    def get(self, i) -> Any:
        """Matrix number ``i``."""
        m = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        if ti.static(self.packed):
            a, b = self.words[i, 0], self.words[i, 1]
            for k in ti.static(range(3)):
                m[k] = number_of(a, BITS * k)
                m[k + 3] = number_of(b, BITS * k)
        else:
            m = self.plain[i]
        return m

    @ti.func
    def set(self, i, m):
        """Write matrix number ``i``."""
        if ti.static(self.packed):
            a, b = ti.u64(0), ti.u64(0)
            for k in ti.static(range(3)):
                a |= bits_of(m[k]) << (BITS * k)
                b |= bits_of(m[k + 3]) << (BITS * k)
            self.words[i, 0], self.words[i, 1] = a, b
        else:
            self.plain[i] = m
