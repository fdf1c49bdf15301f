"""Guards of the bulk of mesh files."""

from __future__ import annotations

from benchmarks.guard import Guard

MESHES = "tests/unit/test_mesh_references.py"

BULK: dict[str, Guard] = {
    "lines of a mesh": Guard(
        "seals.hydrostatics.references",
        "lines > MOST_LINES or ",
        "",
        MESHES,
        "hostile_mesh and lines",
    ),
    "words of a mesh": Guard(
        "seals.hydrostatics.references",
        " or words > MOST_WORDS",
        "",
        MESHES,
        "hostile_mesh and words",
    ),
    "solids of a mesh": Guard(
        "seals.hydrostatics.references",
        "len(_SOLIDS.findall(raw)) > MOST_SOLIDS",
        "False",
        MESHES,
        "hostile_mesh and solids",
    ),
    "materials that part a mesh": Guard(
        "seals.hydrostatics.meshes",
        "raw = without_references(raw)",
        "pass",
        MESHES,
        "make_no_parts",
    ),
}
