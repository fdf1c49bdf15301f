"""Contacts of MuJoCo in machine code: Coulomb's friction and what is told of them, pass by pass."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.plugins.backends.mujoco.contact_law import Points
from seals.plugins.backends.mujoco.library import Library
from seals.plugins.backends.mujoco.sliding import WAYS, corrected
from seals.scalar_compiler import Place, Program, compiled

ROOM = 32
"""Contacts of a step, at most; a step with more is refused."""
_ROWS = 512
"""Rows of the engine's constraints, at most."""
_WIDE = 16
"""Numbers of a contact in a record: its two shapes as integers, place, frame, forces."""
RECORD = 1 + _WIDE * ROOM
"""Numbers of a record, see `recorded`."""


class ContactLoop:
    """Writes to a program what `Sliding` does, and a record of the contacts.

    Args:
        program: to write to.
        found: the engine's library.
        scene: with model and data.
    """

    def __init__(self, program: Program, found: Library, scene: Any) -> None:
        self._program, self._found, self._data = program, found, scene.data
        self._model, self._engine_data = (
            program.address(x._address, x) for x in (scene.model, scene.data)
        )
        step, shapes = scene.step, [(ROOM, WAYS), (ROOM,), (ROOM, WAYS), (ROOM, WAYS), (3, ROOM)]

        def law(*given: Array) -> list[Array]:
            friction, base, wanted, change, past, known = given
            return corrected(friction, base, wanted, change, past, known, step)

        self._law = compiled(law, [*shapes, (1,)])
        self._record = np.zeros(RECORD)

    def _field(self, name: str) -> Place:
        return self._program.address(self._found.place(self._data, name))

    def write_count(self) -> None:
        """Write that the pass is refused without contacts, or with too many."""
        self._number = self._program.count(self._field("ncon"))
        self._program.refuse_outside(self._number, 1, ROOM)

    def write_begin(self) -> None:
        """Write what `Sliding.begin` does."""
        program, found, law = self._program, self._found, self._law
        friction, base, wanted, *_ = law.views[0]
        program.refuse_outside(program.count(self._field("nefc")), 0, _ROWS - WAYS - 1)
        zeros = program.memory(np.zeros(law.memory[0].size))
        program.copy(program.given(law), zeros, law.memory[0].size)
        first, rows = (
            program.pointed(self._field("contact")),
            program.pointed(self._field("efc_aref")),
        )
        self._first, self._rows = first, rows
        with program.each(self._number) as k:
            row, ways = self._row(k), self._ways(k)
            # a contact that the engine leaves out has none
            program.refuse_outside(row, 0, _ROWS)
            place = program.moved(first, k, found.contact_size, found.of_contact("friction"))
            program.copy(self._given(friction.start, k, WAYS), place, ways)
            program.copy(self._given(base.start, k, 1), program.moved(rows, row), 1)
            place = program.moved(rows, row, more=8)
            program.copy(self._given(wanted.start, k, WAYS), place, ways)

    def _row(self, k: str) -> str:
        """Name of a contact's first row among the constraints."""
        found = self._found
        more = found.of_contact("efc_address")
        return self._program.count(self._program.moved(self._first, k, found.contact_size, more))

    def _ways(self, k: str, more: int = -1, most: int | None = None) -> str:
        """Name of the number of ways in which a contact slides, or of its rows."""
        found = self._found
        place = self._program.moved(self._first, k, found.contact_size, found.of_contact("dim"))
        return self._program.count(place, more, most)

    def _given(self, start: int, k: str, wide: int) -> Place:
        """Place of a contact's numbers among the arguments of the law."""
        return self._program.moved(self._program.given(self._law, start), k, 8 * wide)

    @property
    def places(self) -> tuple[Place, Place]:
        """Places of whether to solve again after a correction, and of whether not."""
        *_, again, settled = self._law.views[1]
        first, second = (self._program.out(self._law, view.start) for view in (again, settled))
        return first, second

    def write_correction(self, change: Place) -> None:
        """Write what `Sliding.correct` does, but for the references.

        Args:
            change: accelerations of the last solution.
        """
        program, law = self._program, self._law
        product = program.memory(np.zeros(_ROWS))
        address = self._found.stages["mj_mulJacVec"]
        program.call(address, self._model, self._engine_data, product, change)
        start = law.views[0][3].start
        with program.each(self._number) as k:
            place = program.moved(product, self._row(k), more=8)
            program.copy(self._given(start, k, WAYS), place, self._ways(k))
        program.run(law)

    def write_references(self) -> None:
        """Write the references for the next solution, and what to remember."""
        program, law = self._program, self._law
        normal, past, *_ = law.views[1]
        *_, before, known = law.views[0]
        with program.each(self._number) as k:
            place = program.moved(program.out(law, normal.start), k)
            program.copy(program.moved(self._rows, self._row(k)), place, 1)
        program.copy(program.given(law, before.start), program.out(law, past.start), before.size)
        program.copy(program.given(law, known.start), program.memory(np.ones(1)), 1)

    def write_record(self) -> Place:
        """Write a record of the contacts; return its place."""
        program, found = self._program, self._found
        size, record, none = found.contact_size, program.memory(self._record), np.zeros(3)
        program.copy(record, self._field("ncon"), 1)
        force = program.pointed(self._field("efc_force"))
        with program.each(self._number) as k:
            for first, name, count in ((0, "geom", 1), (1, "pos", 3), (4, "frame", 9)):
                place = program.moved(self._first, k, size, found.of_contact(name))
                program.copy(program.moved(record, k, 8 * _WIDE, 8 + 8 * first), place, count)
            place = program.moved(record, k, 8 * _WIDE, 8 + 8 * 13)
            program.copy(place, program.memory(none), 3)
            program.copy(place, program.moved(force, self._row(k)), self._ways(k, 0, 3))
        return record


def recorded(record: Floats) -> Points:
    """Return the contact points of a record, copies."""
    # the first number holds an integer of 32 bits, and what lies beside it
    count = int(record[:1].view(np.int32)[0])
    table = record[1 : 1 + _WIDE * count].reshape(count, _WIDE).copy()
    geom = table[:, :1].copy().view(np.int32)
    return Points(geom, table[:, 1:4], table[:, 4:13], table[:, 13:16])
