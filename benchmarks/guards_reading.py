"""Guards of file reading: robots, meshes, plain data, tables, recordings."""

from __future__ import annotations

from benchmarks.guard import BOUNDS, CLASSES, FILES, FOUND, Guard

BROKEN, RECORDINGS = "tests/unit/test_logs_broken.py", "tests/unit/test_logs_recordings.py"
ROBOT, ULOG = "tests/unit/test_robot_broken.py", "tests/unit/test_logs_ulog.py"
READING = "tests/unit/test_untrusted_io.py"
PARQUET, _PAGES = "tests/unit/test_logs_parquet.py", "seals.logs.table"
CLOCK, FORGED = "tests/unit/test_logs_clock.py", "tests/unit/test_parquet_forged.py"
REFERENCES, _NAMES = "tests/unit/test_mesh_references.py", "seals.hydrostatics.references"
MACROS, _CHILD = "tests/unit/test_macros_child.py", "seals.robot.macros_child"
TRIAL = "tests/unit/test_isolated_reading.py"

_XML = 'if re.search(r"<!\\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):'
_YAML = "seals.untrusted_io"
ROBOTS_AND_TABLES: dict[str, Guard] = {
    "header of an array": Guard(
        "seals.logs.arrays",
        "    *(MemoryError, SystemError),\n",
        "",
        "tests/unit/test_logs_broken.py",
        "python_cannot_parse",
    ),
    "memory of a small file": Guard(
        "seals.untrusted_io",
        "raw = stream.read(status.st_size + 1)",
        "raw = stream.read(most + 1)",
        READING,
        "little_memory",
    ),
    "growing file": Guard(
        "seals.untrusted_io", "    if len(raw) > most:\n", "    if False:\n", READING, "that_grows"
    ),
    "entities of a URDF": Guard("seals.robot.urdf", _XML, "if False:", FILES, "entities_of_a_urdf"),
    "zero bytes of a URDF": Guard(
        "seals.robot.urdf", 'if "\\0" in text:', "if False:", FILES, "entities_of_a_urdf"
    ),
    "entities of a URDF taken over": Guard(
        "seals.untrusted_io",
        'or re.search(r"<!\\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE)',
        "",
        BOUNDS,
        "taken_over",
    ),
    "entities of a mesh": Guard(
        "seals.hydrostatics.meshes", "if _ENTITY.search(raw) or", "if", FILES, "entities_of_a_mesh"
    ),
    "zero bytes of a mesh": Guard(
        "seals.hydrostatics.meshes", ' or b"\\0" in raw', "", FILES, "entities_of_a_mesh"
    ),
    "entities of a manifest": Guard(
        "seals.scaffold.resources", 'if "<!" in text', 'if "<?!" in text', FILES, "manifest"
    ),
    "libraries that crash": Guard(
        "seals.isolated_reading", "if done.returncode:", "if False:", TRIAL, "_crash"
    ),
    "libraries that hang": Guard(
        "seals.isolated_reading",
        "str(seconds), str(memory)",
        '"1000", str(memory)',
        TRIAL,
        "endless_loop",
    ),
    "MATLAB files in a child": Guard(
        "seals.plugins.readers.pendulum",
        'read_isolated(f"{__name__}:segments_of", file)',
        "segments_of(file)",
        TRIAL,
        "never_reads",
    ),
    "macros": Guard(_CHILD, "_INSIDE.match(name)", "False", MACROS, "inner_names_are", "xacro"),
    "functions in macros": Guard(
        _CHILD, '{"__builtins__": {}}', "{}", MACROS, "no_functions", "xacro"
    ),
    "environment of macros": Guard(
        "seals.robot.structure", "if key in _KEPT", "if True", MACROS, "no_environment", "xacro"
    ),
    "files of macros": Guard(
        _CHILD,
        "return target.is_relative_to(folder) and not any(",
        "return not any(",
        MACROS,
        "near_files",
        "xacro",
    ),
    "pipes in macros": Guard(
        _CHILD,
        "if not stat.S_ISREG(status.st_mode) or status.st_size > MOST_BYTES:",
        "if False:",
        MACROS,
        "near_files",
        "xacro",
    ),
    "acts of macros": Guard(
        _CHILD,
        "elif event.startswith(_ACTING) or event in _CHANGING:",
        "elif False:",
        MACROS,
        "may_not_act",
        "xacro",
    ),
    "folders that macros look into": Guard(
        _CHILD,
        "        _may_list(words[0], near, code)\n",
        "        pass\n",
        MACROS,
        "look_into",
        "xacro",
    ),
    "bounds of macros": Guard(
        "seals.isolated_reading",
        "resource.setrlimit(what, (min(soft, most), most))",
        "pass",
        MACROS,
        "is_bounded",
        "xacro",
    ),
    "answer of macros": Guard(
        "seals.robot.structure",
        "plain_json(done.stdout)",
        "__import__('json').loads(done.stdout)",
        MACROS,
        "answer",
        "xacro",
    ),
    "formats of meshes": Guard(
        "seals.hydrostatics.meshes", "not in FORMATS", "is None", FILES, "plain_meshes"
    ),
    "meshes inside": Guard(
        "seals.robot.urdf",
        "if not target.is_relative_to(shipped if folder.is_relative_to(shipped) else folder):",
        "if False:",
        ROBOT,
        "outside",
    ),
    "files that a mesh names": Guard(
        "seals.hydrostatics.meshes",
        "    refuse_references(path, where)\n",
        "",
        REFERENCES,
        "hostile_mesh",
    ),
    "files beside a mesh": Guard(_NAMES, "if not near:", "if False:", REFERENCES, "hostile_mesh"),
    "devices that a mesh names": Guard(
        _NAMES,
        "            regular_file(target, most=MOST_BYTES)\n",
        "            pass\n",
        REFERENCES,
        "mesh",
    ),
    "copies in a COLLADA": Guard(
        _NAMES, "    _refuse_copies(root)\n", "", REFERENCES, "hostile_mesh"
    ),
    "numbers of a glTF": Guard(
        _NAMES, "    _refuse_hollow(content)\n", "", REFERENCES, "hostile_mesh"
    ),
    "files that a URDF names": Guard(
        "seals.robot.urdf",
        "                refuse_elsewhere(element.attrib[key], path, where)\n",
        "                pass\n",
        REFERENCES,
        "picture_elsewhere",
    ),
    "files of the kernel": Guard(
        "seals.robot.urdf", ' if path.stat().st_size else b""', "", REFERENCES, "seems_to_be"
    ),
    "size of a URDF taken over": Guard(
        "seals.scaffold.takeover",
        "        text = read_text(path)\n",
        '        text = path.read_text("utf-8-sig") if path.stat().st_size < 1e9 else ""\n',
        REFERENCES,
        "taken_over_is_read",
    ),
    "materials of a mesh taken over": Guard(
        "seals.scaffold.meshes",
        "write_bytes(without_references(raw))",
        "write_bytes(raw)",
        REFERENCES,
        "stripped",
    ),
    "hulls inside": Guard(
        "seals.robot.build", ".resolve().is_relative_to(folder)", "", ROBOT, "hull_mesh_outside"
    ),
    "size of meshes": Guard(
        "seals.robot.urdf",
        "if max(size, declared) > _LARGEST_MESH:",
        "if False:",
        ROBOT,
        "huge",
    ),
    "work on broken meshes": Guard(
        "seals.hydrostatics.meshes",
        "MOST_WORK // len(even)",
        "4 * MOST_WORK // len(even)",
        FOUND,
        "thin_broken",
    ),
    "URDF inside": Guard(
        "seals.robot.robot_file",
        "if not (folder / urdf).resolve().is_relative_to(folder.resolve()):",
        "if False:",
        CLASSES,
        "stays_in_itself",
    ),
    "references of a robot": Guard(
        "seals.robot.robot_file",
        "    refuse_references(raw, where=str(path))\n",
        "",
        CLASSES,
        "stays_in_itself",
    ),
    "references of a model": Guard(
        "seals.config.overlay",
        "    refuse_references(raw, where=str(path))\n",
        "",
        CLASSES,
        "looks_nothing_up",
    ),
    "names of parts": Guard(
        "seals.robot.robot_file",
        "not _NAME.fullmatch(name)",
        "False",
        CLASSES,
        "stays_in_itself",
    ),
    "safe YAML": Guard(
        _YAML,
        'loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)',
        "loader = yaml.UnsafeLoader",
        FILES,
        "yaml",
    ),
    "depth of YAML": Guard(_YAML, "if depth > _DEEPEST or", "if", BOUNDS, "measured_first"),
    "aliases of YAML": Guard(_YAML, "        _unfold(content)\n", "", FILES, "yaml_that_unfolds"),
    "size of YAML": Guard(
        _YAML, "_MOST_META_BYTES = 1 << 20", "_MOST_META_BYTES = 1 << 40", BROKEN, "meta"
    ),
    "numbers of YAML": Guard(
        _YAML,
        "        if len(event.value) > _LONGEST_NUMBER and (\n",
        "        if False and (\n",
        READING,
        "hostile_yaml",
    ),
    "keys of YAML": Guard(
        _YAML, "        if long > _MOST_LONG:\n", "        if False:\n", READING, "hostile_yaml"
    ),
    "merges of YAML": Guard(_YAML, 'if "<<" in text:', "if False:", READING, "hostile_yaml"),
    "depth of JSON": Guard(
        _YAML,
        "(steps), default=0) > _DEEPEST:",
        "(steps), default=0) < -9e9:",
        READING,
        "hostile_json",
    ),
    "entries of JSON": Guard(
        _YAML, "if many or len(marks) > _MOST_JSON_NODES:", "if False:", READING, "hostile_json"
    ),
    "numbers of JSON": Guard(_YAML, ", parse_int=_whole", "", READING, "hostile_json"),
    "texts of JSON": Guard(_YAML, 'if b"\\\\u" in raw:', "if False:", READING, "hostile_json"),
    "ordinary files": Guard(
        _YAML, "if not stat.S_ISREG(status.st_mode):", "if False:", READING, "strange_file"
    ),
    "files as opened": Guard(
        _YAML,
        "        _refuse_strange(file, status, most)\n",
        "",
        READING,
        "becomes_a_pipe",
    ),
    "size of files": Guard(
        _YAML, "if status.st_size > most:", "if False:", BOUNDS, "size_of_a_file"
    ),
    "packed files": Guard(_YAML, "if unpacker.unconsumed_tail:", "if False:", BROKEN, "gzip_bomb"),
    "values of a table": Guard(
        "seals.logs.table", "if rows * max(width, 1) > MOST_VALUES:", "if False:", BOUNDS, "table"
    ),
    "columns of numbers": Guard(
        "seals.logs.table",
        "        if flat and (",
        "        if True and (",
        PARQUET,
        "not_unpacked",
    ),
    "pages of a table": Guard(
        _PAGES, " or held > _WIDEST * chunk.num_values + _SLACK", "", PARQUET, "unpacks_to_more"
    ),
    "count of pages": Guard(_PAGES, "if count >= most or", "if", PARQUET, "many_pages"),
    "footer of a table": Guard(
        _PAGES, "declared > min(MOST_FOOTER_BYTES, size):", "False:", PARQUET, "large_footer"
    ),
    "encrypted footer of a table": Guard(
        _PAGES, '(b"PAR1", b"PARE")', '(b"PAR1",)', FORGED, "large"
    ),
    "lists of a footer": Guard(
        "seals.logs.table", ", thrift_container_size_limit=MOST_ENTRIES", "", FORGED, "no_memory"
    ),
    "columns of a table": Guard(
        "seals.logs.table", "if len(content.schema) > MOST_COLUMNS:", "if False:", FORGED, "columns"
    ),
    "kinds of pages": Guard(
        _PAGES,
        "_COUNTED.get(int(header[1]))",
        "next((n for n in (5, 8) if n in header), None)",
        FORGED,
        "forged_pages",
    ),
    "values of a page": Guard(
        _PAGES, "if more > chunk.num_values:", "if False:", FORGED, "forged_pages"
    ),
    "fields that stand twice": Guard(
        _PAGES, "if number in found:", "if False:", FORGED, "forged_pages"
    ),
    "fields of other widths": Guard(
        _PAGES, "(value if kind == _WHOLE else None)", "value", FORGED, "forged_pages"
    ),
    "numbers of a page": Guard(
        _PAGES,
        "if kind == _WHOLE and not -(1 << 31) <= value < 1 << 31:",
        "if False:",
        FORGED,
        "forged_pages",
    ),
    "unit of the time": Guard(
        "seals.logs.native",
        'columns["t"], clock = in_seconds(columns["t"], segment, channels=columns)',
        "clock = {}",
        CLOCK,
        "another_unit",
    ),
    "span of the time": Guard(
        "seals.logs.check",
        "if steps > max(_MOST_STEPS, _FILLED * time.size) or span > _LONGEST_SPAN:",
        "if False:",
        CLOCK,
        "absurd_times",
    ),
    "steps of the time": Guard(
        "seals.logs.check",
        "absurd = median >= _ABSURD_STEP",
        "absurd = False",
        CLOCK,
        "absurd",
    ),
    "shortest step of the time": Guard(
        "seals.logs.check",
        "if 0.0 < median < _SHORTEST_STEP:",
        "if False:",
        CLOCK,
        "no_sensor",
    ),
    "time of a large table": Guard(
        "seals.logs.table", "if rows * width > _LARGE:", "if False:", PARQUET, "is_said"
    ),
    "rows of a diagnosis": Guard(
        "seals.sysid.report.given_logs",
        "if log.rows > MOST_ROWS:",
        "if False:",
        "tests/unit/test_diagnose_long_logs.py",
        "long_logs or ten_million",
    ),
    "declared chunks": Guard(
        "seals.plugins.readers.mcap_file",
        "if size > _MOST_RECORD:",
        "if False:",
        BOUNDS,
        "not_unpacked",
        "mcap",
    ),
    "declared records": Guard(
        "seals.plugins.readers.mcap_file",
        "record_size_limit=_MOST_RECORD",
        "record_size_limit=None",
        BOUNDS,
        "not_read",
        "mcap",
    ),
    "packed streams": Guard(
        "seals.plugins.readers.mcap_file",
        "max_length=size + 1",
        "max_length=-1",
        BOUNDS,
        "stream",
        "lz4",
    ),
    "views of a database": Guard(
        "seals.plugins.readers.recording",
        '.startswith("TABLE CREATE TABLE")',
        '.startswith("")',
        RECORDINGS,
        "data_only",
        "rosbags",
    ),
    "computed columns": Guard(
        "seals.plugins.readers.recording",
        "if row[6] == 0",
        "",
        RECORDINGS,
        "data_only",
        "rosbags",
    ),
    "read-only database": Guard(
        "seals.plugins.readers.recording", "?mode=ro&immutable=1", "", BOUNDS, "read_only"
    ),
    "files of a bag": Guard(
        "seals.plugins.readers.recording",
        " or not file.resolve().is_relative_to(place.resolve())",
        "",
        RECORDINGS,
        "lie_in_its_folder",
        "rosbags",
    ),
    "fields of a ULog": Guard(
        "seals.plugins.readers.ulog",
        "if len(layout) > _MOST_FIELDS:",
        "if False:",
        BOUNDS,
        "fields",
    ),
    "depth of a ULog": Guard(
        "seals.plugins.readers.ulog", " or depth > _DEEPEST", "", ULOG, "itself"
    ),
    "objects in an array": Guard(
        "seals.logs.arrays", 'if dtype.kind not in "fiu":', "if False:", BROKEN, "pickled_array"
    ),
    "declared arrays": Guard(
        "seals.logs.arrays", "if declared != held or", "if", BROKEN, "declares_too_much"
    ),
}
"""Guards of robots, meshes, plain data and logs."""
