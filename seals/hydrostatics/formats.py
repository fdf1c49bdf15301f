"""Check of mesh files before loading: plain geometry formats only."""

from __future__ import annotations

import re
from pathlib import Path

from seals.errors import RobotError
from seals.hydrostatics.references import refuse_references

FORMATS = (".stl", ".obj", ".ply", ".off", ".dae", ".glb")
"""Endings of the mesh files that are read; the mesh library knows archives as well."""
_ENTITY = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


def refuse_strange_format(path: Path, where: str) -> None:
    """Refuse a file that is not a plain mesh.

    Args:
        path: a file that is there, of bearable size.
        where: what names it, for the message.

    Raises:
        RobotError: its ending is another one, it is XML that declares entities, or it names
            files elsewhere.
    """
    if path.suffix.lower() not in FORMATS:
        raise RobotError(
            f"{where}: '{path.name}' is not a mesh file.\nAllowed: {', '.join(FORMATS)}; export it."
        )
    if path.suffix.lower() == ".dae":
        raw = path.read_bytes()
        # zero bytes: another encoding than UTF-8, in which the words look different
        if _ENTITY.search(raw) or b"\0" in raw:
            raise RobotError(
                f"{where}: '{path.name}' declares a DOCTYPE or an ENTITY, or is not UTF-8.\n"
                "Remove it: such files can expand without end."
            )
    refuse_references(path, where)
