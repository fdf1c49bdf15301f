"""Guards of robot files of other formats on their way into a robot's folder."""

from __future__ import annotations

from benchmarks.guard import Guard

HOSTILE = "tests/unit/test_scaffold_hostile.py"
STRUCTURE, MJCF = "seals.robot.structure", "seals.scaffold.mjcf_bounds"
IMPORTS: dict[str, Guard] = {
    "includes of an MJCF": Guard(
        MJCF, "len(read) >= _MOST_INCLUDES or", "", HOSTILE, "fan"
    ),
    "elements of an MJCF": Guard(
        MJCF, " or sum(read) > _MOST_ELEMENTS", "", HOSTILE, "includes and elements"
    ),
    "parts of an MJCF": Guard(
        MJCF, "        if count > most:\n", "        if False:\n", HOSTILE, "hostile"
    ),
    "generated meshes": Guard(
        MJCF, 'if mesh.get("builtin") is not None:', "if False:", HOSTILE, "engine"
    ),
    "corners in an MJCF": Guard(
        MJCF, "if count > _MOST_NUMBERS:", "if False:", HOSTILE, "half"
    ),
    "orders of a motor": Guard(MJCF, '    "actdim",\n', "", HOSTILE, "orders_no_memory"),
    "elements of an SDF": Guard(
        "seals.scaffold.sdf_includes",
        "if found.elements > _MOST_PARTS:",
        "if False:",
        HOSTILE,
        "models and elements",
    ),
    "depth of an SDF": Guard(
        "seals.scaffold.sdf_includes",
        "        if depth > _DEEPEST_MODEL:\n",
        "        if False:\n",
        HOSTILE,
        "hostile",
    ),
    "shapes of a robot": Guard(
        STRUCTURE, "if shapes > MOST_SHAPES:", "if False:", HOSTILE, "shapes"
    ),
    "lines in names": Guard(
        STRUCTURE, "if not name.isprintable() or", "if", HOSTILE, "line"
    ),
    "lookups in names": Guard(STRUCTURE, '"${" in name or ', "", HOSTILE, "lookup"),
    "length of names": Guard(STRUCTURE, " or len(name) > _MOST_NAME", "", HOSTILE, "signs"),
    "size of numbers": Guard(
        STRUCTURE, "all(abs(x) < LARGEST for", "all(math.isfinite(x) for", HOSTILE, "1e"
    ),
    "scale of meshes": Guard(
        STRUCTURE, "if min(map(abs, scale)) < _FINEST:", "if False:", HOSTILE, "scaled"
    ),
    "flat meshes": Guard(
        "seals.scaffold.shapes",
        "except (QhullError, ValueError) as cause:",
        "except ZeroDivisionError as cause:",
        HOSTILE,
        "flat or corner",
    ),
    "needles of panels": Guard(
        "seals.scaffold.hydrodynamics.panels",
        "if not own.volume > 0.0:",
        "if False:",
        "tests/unit/test_new_hydrodynamics.py",
        "needle",
        "capytaine",
    ),
    "addresses of meshes": Guard(
        "seals.scaffold.resources",
        "    except ValueError as cause:\n        raise MissingMesh(",
        "    except KeyError as cause:\n        raise MissingMesh(",
        HOSTILE,
        "address",
    ),
    "meshes of texts": Guard(
        "seals.scaffold.meshes", "name != given and name in self.texts", "name != given",
        HOSTILE, "text",
    ),
    "names of hulls": Guard(
        "seals.scaffold.shapes", "hull_{plain(link)}_", "hull_{link}_", HOSTILE, "names_are"
    ),
    "names in YAML": Guard(
        "seals.scaffold.writing",
        'environment.filters["flow"] = flow',
        'environment.filters["flow"] = str',
        HOSTILE,
        "names_are",
    ),
    "lines of a plug-in": Guard(
        "seals.scaffold.writing",
        "printable(value) if isinstance(value, str) else value",
        "value",
        HOSTILE,
        "plug_in_writes",
    ),
}  # fmt: skip
"""Every one of them by name."""
