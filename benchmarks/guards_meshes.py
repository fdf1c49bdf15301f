"""Guards of the bulk of meshes, the form of planned manoeuvres, and texts that no file has."""

from __future__ import annotations

from benchmarks.guard import Guard

READING, NUMBERS = "tests/unit/test_untrusted_io.py", "tests/unit/test_sound_numbers.py"
DRAWN = "tests/unit/test_drawn_text.py"
DISK = "tests/unit/test_disk_full.py"
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
    "sign zero in JSON": Guard(
        "seals.untrusted_io", 'if b"\\\\u0000" in', "if b'no' in", READING, "hostile_json and zero"
    ),
    "sign zero in YAML": Guard(
        "seals.untrusted_io",
        'if "\\0" in event.value:',
        "if False:",
        READING,
        "hostile_yaml and zero",
    ),
    "kinds in a planned manoeuvre": Guard(
        "seals.sysid.experiment_design.experiment",
        "runs: Sequence[Mapping[str, Any]]",
        "runs: Any",
        NUMBERS,
        "of_their_form",
    ),
    "start of a planned drop": Guard(
        "seals.sysid.experiment_design.experiment",
        "drops.append({**run, **vars_of(read(_Drop, run, where=where, extra=True))})",
        "drops.append({**run})",
        NUMBERS,
        "of_their_form",
    ),
    "turned lines of a page": Guard(
        "seals.report.page", "return readable(", "return str(", DRAWN, "turn_lines"
    ),
    "turned lines of Markdown": Guard(
        "seals.drawn_text", "readable(text))", "text)", DRAWN, "turn_lines"
    ),
    "errors of loaders of meshes": Guard(
        "seals.hydrostatics.meshes",
        "    except Exception as cause:  # each format's loader",
        "    except KeyError as cause:  # each format's loader",
        MESHES,
        "one_kind",
    ),
    "links to themselves": Guard(
        "seals.cli.of_system", "str(error).startswith(_LOOP)", "False", DISK, "link_to_itself"
    ),
    "columns of drives": Guard(
        "seals.plugins.actuators.layout",
        "if not 0 <= first <= 10_000:",
        "if first < 0:",
        "tests/unit/test_hostile_counts.py",
        "columns_of_drives",
    ),
}
