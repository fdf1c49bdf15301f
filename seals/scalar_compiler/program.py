"""Loop of compiled laws and foreign functions as one function of machine code.

What is repeated is copies, calls and questions; Python is entered when it ends.
"""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.scalar_compiler.kernel import Kernel, written

_COPY = "llvm.memcpy.p0.p0.i64"


class Place(NamedTuple):
    """Place in memory.

    Args:
        row: of the table of addresses; or a name in the text, for a place that a pass finds.
        start: numbers from there.
    """

    row: int | str
    start: int = 0


class Program:
    """Loop that is written line by line, then compiled.

    A pass may be refused while it lasts, by `refuse_if`: what was `kept` is put back, the loop
    ends, and it is as if the pass had not begun. `accept` ends what may be refused.

    Args:
        tapes: number of arrays that get a row of every pass, see `record`.

    Example:
        >>> import numpy as np
        >>> x, y = np.zeros(2), np.ones(2)
        >>> program = Program(0)
        >>> program.add(program.memory(x), program.memory(y), [1, 1])
        >>> program.accept()
        >>> run = program.compiled()
        >>> run(0, 3, 0), x.tolist()
        (3, [0.0, 6.0])
    """

    def __init__(self, tapes: int) -> None:
        self._tapes = tapes
        self._rows: list[int] = []
        self._owners: list[Any] = []
        self._lines: list[str] = []
        self._kept: list[tuple[Place, Place, int]] = []
        self._blocks = 0
        self._ended = False

    def memory(self, array: Floats) -> Place:
        """Return the place of an array, which lives as long as the compiled loop.

        Raises:
            ValueError: its numbers do not lie side by side.
        """
        if not array.flags.c_contiguous or array.dtype != np.float64:
            raise ValueError("only doubles that lie side by side have one place")
        self._owners.append(array)
        return self.address(array.ctypes.data)

    def address(self, address: int, *owners: Any) -> Place:
        """Return the place at an address; owners of it are kept as long as the loop."""
        self._owners += owners
        if address not in self._rows:
            self._rows.append(address)
        return Place(self._rows.index(address))

    def copy(self, to: Place, of: Place, count: int | str) -> None:
        """Copy some numbers; ``count``: or the name of a count that a pass finds."""
        if count:
            self._copy(self._at(to), self._at(of), count)

    def _copy(self, to: str, of: str, count: int | str) -> None:
        size = 8 * count if isinstance(count, int) else self._new(f"mul i64 {count}, 8")
        self._lines.append(f"  call void @{_COPY}(ptr {to}, ptr {of}, i64 {size}, i1 false)")

    def pointed(self, place: Place) -> Place:
        """Return the place whose address stands at a place."""
        return Place(self._new(f"load ptr, ptr {self._at(place)}"))

    def moved(self, place: Place, count: str, size: int = 8, more: int = 0) -> Place:
        """Return the place that is a count of things after one.

        Args:
            place: of the first thing.
            count: its name.
            size: of a thing [bytes].
            more: bytes besides.
        """
        way = self._new(f"mul i64 {count}, {size}")
        way = self._new(f"add i64 {way}, {more}") if more else way
        return Place(self._new(f"getelementptr i8, ptr {self._at(place)}, i64 {way}"))

    def count(self, place: Place, more: int = 0, most: int | None = None) -> str:
        """Return the name of an integer of 32 bits at a place, plus some, bounded above."""
        found = self._new(f"load i32, ptr {self._at(place)}")
        found = self._new(f"sext i32 {found} to i64")
        found = self._new(f"add i64 {found}, {more}") if more else found
        if most is None:
            return found
        less = self._new(f"icmp slt i64 {found}, {most}")
        return self._new(f"select i1 {less}, i64 {found}, i64 {most}")

    @contextlib.contextmanager
    def each(self, count: str) -> Iterator[str]:
        """What is written inside is done for every number below a count; it gets its name."""
        self._blocks += 1
        own, at = self._blocks, self._at(self.memory(np.zeros(1)))
        self._lines += [f"  store i64 0, ptr {at}", f"  br label %each{own}", f"each{own}:"]
        number = self._new(f"load i64, ptr {at}")
        more = self._new(f"icmp slt i64 {number}, {count}")
        self._lines += [f"  br i1 {more}, label %one{own}, label %all{own}", f"one{own}:"]
        yield number
        following = self._new(f"add i64 {number}, 1")
        self._lines += [f"  store i64 {following}, ptr {at}", f"  br label %each{own}"]
        self._lines.append(f"all{own}:")

    def add(self, to: Place, of: Place, places: Sequence[int]) -> None:
        """Add numbers that lie side by side to those at some places."""
        for k, place in enumerate(places):
            target = self._at(Place(to.row, to.start + place))
            more = self._new(f"load double, ptr {self._at(Place(of.row, of.start + k))}")
            whole = self._new(f"fadd double {self._new(f'load double, ptr {target}')}, {more}")
            self._lines.append(f"  store double {whole}, ptr {target}")

    def run(self, kernel: Kernel) -> None:
        """Call a law; its arguments are where `given` says, its results where `out` says."""
        self._owners.append(kernel)
        self.call(kernel.address, *(self.memory(x) for x in kernel.memory))

    def given(self, kernel: Kernel, start: int = 0) -> Place:
        """Return the place of a law's arguments."""
        return Place(self.memory(kernel.memory[0]).row, start)

    def out(self, kernel: Kernel, start: int = 0) -> Place:
        """Return the place of a law's results."""
        return Place(self.memory(kernel.memory[1]).row, start)

    def call(self, address: int, *given: Place) -> None:
        """Call a function of addresses without a result."""
        function = self.address(address).row
        places = ", ".join(f"ptr {self._at(x)}" for x in given)
        self._lines.append(f"  call void %p{function}({places})")

    def tell_time(self, to: Place, step: float, later: int) -> None:
        """Write (first + pass + later) times a step [s]: the product that a world has."""
        count = self._new(f"add i64 %count, {later}")
        number = self._new(f"sitofp i64 {count} to double")
        bits = np.array(step, dtype=np.float64).view(np.uint64)
        product = self._new(f"fmul double {number}, 0x{int(bits):016X}")
        self._lines.append(f"  store double {product}, ptr {self._at(to)}")

    def keep(self, place: Place, count: int) -> None:
        """Keep some numbers as they are when a pass begins, for one that is refused."""
        self._kept.append((place, self.memory(np.zeros(count)), count))

    def refuse_if(self, place: Place, *, integer: bool = False) -> None:
        """Refuse the pass where a number, or an integer of 32 bits, is not zero."""
        if self._ended:
            raise ValueError("an accepted pass is not refused")
        self._branch(self._asked(place, integer=integer), "back")

    def refuse_outside(self, count: str, least: int, most: int) -> None:
        """Refuse the pass where a count is below or above two bounds."""
        span = self._new(f"sub i64 {count}, {least}")
        self._branch(self._new(f"icmp ugt i64 {span}, {most - least}"), "back")

    @contextlib.contextmanager
    def unless(self, place: Place) -> Iterator[None]:
        """What is written inside is done where a number is zero."""
        self._blocks += 1
        own, there = self._blocks, self._asked(place, integer=False)
        self._lines += [f"  br i1 {there}, label %past{own}, label %due{own}", f"due{own}:"]
        yield
        self._lines += [f"  br label %past{own}", f"past{own}:"]

    @contextlib.contextmanager
    def repeated(self, most: int, place: Place) -> Iterator[None]:
        """What is written inside is done again while a number is not zero.

        Args:
            most: how often at most.
            place: of the number.
        """
        self._blocks += 1
        own, count = self._blocks, self.memory(np.zeros(1))
        self._lines += [f"  store i64 0, ptr {self._at(count)}", f"  br label %turn{own}"]
        self._lines.append(f"turn{own}:")
        yield
        found = self._new(f"load i64, ptr {self._at(count)}")
        done = self._new(f"add i64 {found}, 1")
        self._lines.append(f"  store i64 {done}, ptr {self._at(count)}")
        left = self._new(f"icmp slt i64 {done}, {most}")
        again = self._new(f"and i1 {left}, {self._asked(place, integer=False)}")
        self._lines += [f"  br i1 {again}, label %turn{own}, label %turned{own}", f"turned{own}:"]

    @contextlib.contextmanager
    def every(self, passes: int) -> Iterator[None]:
        """What is written inside is done in one of some passes, but never in the first.

        Those whose number plus that of the first one's ``phase`` is a multiple.
        """
        self._blocks += 1
        own, phase = self._blocks, self._new("add i64 %phase, %k")
        rest = self._new(f"srem i64 {phase}, {passes}")
        due = self._new(f"icmp eq i64 {rest}, 0")
        later = self._new("icmp ne i64 %k, 0")
        both = self._new(f"and i1 {due}, {later}")
        self._lines += [f"  br i1 {both}, label %due{own}, label %past{own}", f"due{own}:"]
        yield
        self._lines += [f"  br label %past{own}", f"past{own}:"]

    def accept(self) -> None:
        """End what may be refused."""
        self._ended = True

    def end_if(self, place: Place) -> None:
        """End the loop after this pass where a number is not zero."""
        self._branch(self._asked(place, integer=False), "enough")

    def record(self, tape: int, *parts: tuple[Place, int]) -> None:
        """Copy numbers, side by side, into the row of this pass of a tape."""
        start = self._new(f"mul i64 %k, {sum(count for _, count in parts)}")
        row, first = self._new(f"getelementptr double, ptr %tape{tape}, i64 {start}"), 0
        for of, count in parts:
            to = self._new(f"getelementptr double, ptr {row}, i64 {first}") if first else row
            self._copy(to, self._at(of), count)
            first += count

    def _asked(self, place: Place, *, integer: bool) -> str:
        kind, test = ("i32", "icmp ne i32") if integer else ("double", "fcmp une double")
        found = self._new(f"load {kind}, ptr {self._at(place)}")
        return self._new(f"{test} {found}, {0 if integer else 0.0}")

    def _branch(self, condition: str, label: str) -> None:
        self._blocks += 1
        self._lines.append(f"  br i1 {condition}, label %{label}, label %on{self._blocks}")
        self._lines.append(f"on{self._blocks}:")

    def _new(self, text: str) -> str:
        name = f"%v{len(self._lines)}"
        self._lines.append(f"  {name} = {text}")
        return name

    def _at(self, place: Place) -> str:
        row = place.row if isinstance(place.row, str) else f"%p{place.row}"
        if not place.start:
            return row
        return self._new(f"getelementptr double, ptr {row}, i64 {place.start}")

    def _copies(self, *, turned: bool) -> list[str]:
        """Lines that keep what `keep` says, or put it back."""
        self._lines = []
        for place, own, count in self._kept:
            self.copy(*((place, own) if turned else (own, place)), count)
        return self._lines

    def compiled(self) -> Loop:
        """Compile the loop.

        Raises:
            CannotCompile: llvmlite is not installed, or broken.
        """
        # names are numbered by line: those of what is kept and put back begin anew
        body = self._lines
        keep, back = (
            [line.replace("%v", f"%{letter}") for line in self._copies(turned=turned)]
            for letter, turned in (("u", False), ("w", True))
        )
        self._lines = body
        tapes = "".join(f", ptr %tape{k}" for k in range(self._tapes))
        rows = [
            line
            for k in range(len(self._rows))
            for line in (
                f"  %a{k} = getelementptr ptr, ptr %table, i64 {k}",
                f"  %p{k} = load ptr, ptr %a{k}",
            )
        ]
        text = [
            f"declare void @{_COPY}(ptr, ptr, i64, i1)",
            f"define i64 @loop(ptr %table, i64 %first, i64 %most, i64 %phase{tapes}) {{",
            *("begin:", *rows, "  br label %pass", "pass:"),
            "  %k = phi i64 [0, %begin], [%next, %end]",
            "  %next = add i64 %k, 1",
            "  %count = add i64 %first, %k",
            *(*keep, *body, "  br label %end", "end:"),
            "  %more = icmp slt i64 %next, %most",
            "  br i1 %more, label %pass, label %enough",
            *("back:", *back, "  ret i64 %k", "enough:", "  ret i64 %next", "}", ""),
        ]
        return Loop(written("\n".join(text), "loop"), self._rows, self._owners, self._tapes)


class Loop:
    """Compiled loop.

    Args:
        code: the engine that holds it, and the address of the function.
        rows: the table of addresses.
        owners: of what lies there.
        tapes: number of arrays that get a row of every pass.
    """

    def __init__(
        self, code: tuple[Any, int], rows: Sequence[int], owners: Sequence[Any], tapes: int
    ) -> None:
        self._engine, address = code
        self._table, self._owners = np.array(rows, dtype=np.uint64), owners
        kinds = [ctypes.c_void_p, *[ctypes.c_int64] * 3, *[ctypes.c_void_p] * tapes]
        self._call = ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(address)
        self._first = self._table.ctypes.data

    def __call__(self, first: int, most: int, phase: int, *tapes: int) -> int:
        """Return how many passes were made and not refused.

        Args:
            first: number of the first pass, for `Program.tell_time`.
            most: passes, at least one.
            phase: of the first pass, see `Program.every`.
            tapes: addresses of arrays of ``most`` rows.
        """
        found: int = self._call(self._first, first, most, phase, *tapes)
        return found
