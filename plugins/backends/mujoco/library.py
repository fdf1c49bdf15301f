"""The engine's own functions and memory, for machine code that steps it without Python."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

_KINDS: dict[str, Any] = {
    **{"int": ctypes.c_int, "mjtNum": ctypes.c_double, "mjtSize": ctypes.c_int64},
    **{"mjtBool": ctypes.c_bool, "size_t": ctypes.c_size_t, "uint64_t": ctypes.c_uint64},
    "uintptr_t": ctypes.c_void_p,
}
STAGES = (
    *("mj_kinematics", "mj_comPos", "mj_makeM", "mj_factorM", "mj_collision"),
    *("mj_makeConstraint", "mj_projectConstraint", "mj_fwdVelocity", "mj_fwdAcceleration"),
    *("mj_fwdConstraint", "mj_Euler"),
)
"""Stages of a step, functions of model and data."""
PRODUCTS = ("mj_mulJacVec", "mju_rotVecQuat")
"""Functions of more: model, data, result and vector; result, vector and quaternion."""


class Library:
    """Addresses of the engine's functions and of the places in its data.

    Args:
        stages: addresses of `STAGES` and `PRODUCTS` by name.
        data: layout of ``mjData``.
        contact: layout of a contact.
    """

    def __init__(
        self,
        stages: dict[str, int],
        data: type[ctypes.Structure],
        contact: type[ctypes.Structure],
    ) -> None:
        self.stages, self._data, self._contact = stages, data, contact

    def place(self, data: Any, name: str) -> int:
        """Return the address of a field of the engine's data."""
        offset: int = getattr(self._data, name).offset
        return int(data._address) + offset

    def of_contact(self, name: str) -> int:
        """Return where a field of a contact stands in it [bytes]."""
        offset: int = getattr(self._contact, name).offset
        return offset

    @property
    def contact_size(self) -> int:
        """Size of a contact [bytes]."""
        return ctypes.sizeof(self._contact)

    def fits(self, data: Any) -> bool:
        """Return whether the layout is that of some data, seen by the fields that Python shows."""
        seen = self._data.from_address(data._address)
        arrays = ("qpos", "qvel", "qacc", "M", "qfrc_applied", "xpos")
        return (
            all(getattr(seen, name) == getattr(data, name).ctypes.data for name in arrays)
            and (seen.ncon, seen.nefc) == (data.ncon, data.nefc)
            and seen.time == data.time
            and self.contact_size == data.contact.pos.strides[0]
        )


@cache
def library(engine: Any) -> Library | None:
    """Return the engine's library; None where it does not describe itself, or lies elsewhere.

    Args:
        engine: the mujoco module.
    """
    found = sorted(Path(engine.__file__).parent.glob("libmujoco*"))
    try:
        from mujoco.introspect import structs

        data, contact = (_structure(name, structs.STRUCTS) for name in ("mjData", "mjContact"))
        loaded = ctypes.CDLL(str(found[0]))
        stages = {
            name: ctypes.cast(getattr(loaded, name), ctypes.c_void_p).value or 0
            for name in (*STAGES, *PRODUCTS)
        }
    except (AttributeError, ImportError, IndexError, LookupError, OSError):
        return None
    return Library(stages, data, contact)


def _structure(name: str, structs: Any) -> type[ctypes.Structure]:
    """Layout of one of the engine's structures, as C lays it out."""
    fields = [(field.name, _kind(str(field.type), structs)) for field in structs[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _kind(text: str, structs: Any) -> Any:
    """Type of a field: a number, an address, a structure, or several."""
    base, _, count = text.partition("[")
    base = base.strip()
    if base.endswith("*"):
        kind: Any = ctypes.c_void_p
    else:
        kind = _KINDS[base] if base in _KINDS else _structure(base, structs)
    return kind * int(count.rstrip("]")) if count else kind
