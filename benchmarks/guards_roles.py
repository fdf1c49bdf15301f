"""Guards of what a stranger's file may set, read, name and draw."""

from __future__ import annotations

from benchmarks.guard import Guard

ROLES, READERS = "tests/unit/test_field_roles.py", "tests/unit/test_one_reader.py"
SMALL = "tests/unit/test_small_holes.py"
NUMBERS = "tests/unit/test_sound_numbers.py"
DRAWN = "tests/unit/test_drawn_text.py"

ROLES_AND_READERS: dict[str, Guard] = {
    "roles of values": Guard(
        "seals.cli.hydra_app",
        "        if self.source:\n            refuse_values(",
        "        if False:\n            refuse_values(",
        ROLES,
        "sets_data_only or card",
    ),
    "roles of objects in the scene": Guard(
        "seals.config.foreign_values",
        'elif name in OPEN and isinstance(node, DictConfig):',
        "elif False:",
        ROLES,
        "folder_of_configuration",
    ),
    "robots elsewhere": Guard(
        "seals.config.foreign_values",
        "if str(value) != _installed(node).get(name):",
        "if False:",
        ROLES,
        "folder_of_configuration",
    ),
    "models elsewhere": Guard(
        "seals.config.foreign_values",
        "if file is not None and not _own_model(str(file)):",
        "if False:",
        ROLES,
        "model",
    ),
    "notes of Hydra": Guard(
        "seals.sweep.watch",
        "strange = path.exists() and not (path.is_file() and path.stat().st_nlink == 1)",
        "strange = False",
        "tests/unit/test_hostile_folders.py",
        "resumed_in",
    ),
    "faults of own lines": Guard(
        "seals.sound_numbers",
        "isinstance(error, ValueError | IndexError) and _of_library(error)",
        "isinstance(error, ValueError) and _of_library(error) or isinstance(error, IndexError)",
        NUMBERS,
        "boundary or fault_of",
    ),
    "folders in place of files": Guard(
        "seals.logs.atomic",
        "    if target.is_dir() and not target.is_symlink():\n        raise",
        "    if False:\n        raise",
        "tests/unit/test_logs_atomic.py",
        "place_of_a_file",
    ),
    "parts of a robot": Guard(
        "seals.robot.robot_file",
        "if count > MOST_PARTS or entries(raw) > MOST_ENTRIES:",
        "if False:",
        "tests/unit/test_hostile_counts.py",
        "parts_of_a_robot",
    ),
    "records of an MCAP": Guard(
        "seals.plugins.readers.mcap_file",
        "if total > most:",
        "if False:",
        "tests/unit/test_logs_recordings.py",
        "many_records",
        "mcap",
    ),
    "messages of a ULog": Guard(
        "seals.plugins.readers.ulog",
        "if state.known + state.strange > _MOST_MESSAGES:",
        "if False:",
        "tests/unit/test_logs_ulog.py",
        "messages_are_counted",
        "pyulog",
    ),
    "who comes second": Guard(
        "seals.logs.atomic",
        "        if replace:\n            _take_place",
        "        if True:\n            _take_place",
        "tests/unit/test_logs_atomic.py",
        "comes_second",
    ),
    "log of a diagnosis": Guard(
        "seals.sysid.validation.answer",
        "if Path(place).exists() and log_digest(place) != digest:",
        "if False:",
        ROLES,
        "diagnosis_does and plan",
    ),
    "log without a checksum": Guard(
        "seals.sysid.validation.answer",
        "        if not digest:\n",
        "        if False:\n",
        ROLES,
        "diagnosis_does",
    ),
    "names of what is installed": Guard(
        "seals.config.foreign_values",
        "        and _SHIPPED.fullmatch(one) is not None\n",
        "",
        ROLES,
        "installed_things",
    ),
    "names as paths": Guard(
        "seals.file_names", "        or _REFUSED & set(text)\n", "", ROLES, "no_path"
    ),
    "decoder of a picture": Guard(
        "seals.picture_files", ", formats=FORMATS", "", READERS, "picture_starts"
    ),
    "pixels of a picture": Guard(
        "seals.picture_files", "if width * height > MOST_PIXELS:", "if False:", READERS, "pictures"
    ),
    "textures of a mesh": Guard(
        "seals.hydrostatics.meshes",
        "            skip_materials=True,\n",
        "",
        READERS,
        "texture or inside_a_mesh",
    ),
    "size of a mesh": Guard(
        "seals.hydrostatics.meshes",
        "    raw = read_bytes(path, most=most)\n",
        "    raw = path.read_bytes()\n",
        READERS,
        "meshes_are_bounded",
    ),
    "parts of a glTF": Guard(
        "seals.hydrostatics.references",
        "    return sum(counts[key] for key in keys)\n",
        "    return 0\n",
        "tests/unit/test_mesh_references.py",
        "hostile_mesh",
    ),
    "corners in a COLLADA": Guard(
        "seals.hydrostatics.references",
        "            count = each + own\n",
        "            count = each\n",
        "tests/unit/test_mesh_references.py",
        "hostile_mesh",
    ),
    "groups of an OBJ": Guard(
        "seals.hydrostatics.references",
        "if len(_PARTS.findall(raw)) > MOST_COPIES:",
        "if False:",
        "tests/unit/test_mesh_references.py",
        "hostile_mesh",
    ),
    "faces of an OBJ": Guard(
        "seals.hydrostatics.references",
        "if sum(map(len, map(bytes.split, faces))) - 3 * len(faces) > _MOST_TRIANGLES:",
        "if False:",
        "tests/unit/test_mesh_references.py",
        "hostile_mesh",
    ),
    "signs of a COLLADA": Guard(
        "seals.hydrostatics.meshes",
        " or _OTHER_SIGNS.search(raw)",
        "",
        "tests/unit/test_mesh_references.py",
        "hostile_mesh",
    ),
    "numbers of an array": Guard(
        "seals.logs.arrays",
        "if declared == held and math.prod(shape) > MOST_VALUES:",
        "if False:",
        "tests/unit/test_logs_broken.py",
        "one_byte",
    ),
    "files that a run names": Guard(
        "seals.run.provenance",
        "    if not near or Path(name).is_absolute():\n",
        "    if False:\n",
        READERS,
        "checksums or names_files",
    ),
    "size of a checksum": Guard(
        "seals.run.provenance",
        "most=MOST_BYTES, packed=True",
        "most=1 << 60, packed=True",
        READERS,
        "checksums",
    ),
    "places of particles": Guard(
        "seals.view.instants",
        "found = read_npy(path)",
        "found = np.asarray(np.load(path, allow_pickle=False), dtype=float)",
        READERS,
        "places",
    ),
    "text of a script": Guard(
        "seals.control.key_events",
        "text = read_text(path)",
        "text = path.read_text()",
        READERS,
        "scripts_and_curves",
    ),
    "formulas in charts": Guard(
        "seals.report.pictures",
        'matplotlib.rcParams["text.parse_math"] = False',
        "pass",
        DRAWN,
        "charts or formulas_runs",
    ),
    "formulas in tables": Guard(
        "seals.drawn_text",
        """return f"'{text}" if formula else text""",
        "return text",
        DRAWN,
        "tables or jobs",
    ),
    "programs in Markdown": Guard(
        "seals.plugins.viewers.browser.panel",
        "{in_markdown(self._session.note)}",
        "{self._session.note}",
        DRAWN,
        "note",
    ),
    "numbers as a system": Guard(
        "seals.cli.main",
        "if why is None or not arises_inside(fault):",
        "if True:",
        NUMBERS,
        "gravity or solution or proportion",
    ),
    "numbers of a diagnosis": Guard(
        "seals.sysid.report.application",
        'with sound_numbers("a diagnosis", _ADVICE), trials(), _LeftOver(processes) as beside:',
        "with trials(), _LeftOver(processes) as beside:",
        NUMBERS,
        "without_a_solution",
    ),
    "numbers of a comparison": Guard(
        "seals.sysid.report.healthy_application",
        'with sound_numbers("a comparison with healthy flights", _ADVICE):',
        "if True:",
        NUMBERS,
        "without_a_solution",
    ),
    "end of a planned drop": Guard(
        "seals.sysid.experiment_design.experiment",
        '    length += sum(drop["seconds"] for drop in drops)\n',
        "",
        NUMBERS,
        "have_an_end",
    ),
    "most links of PyBullet": Guard(
        "seals.plugins.backends.pybullet.loading",
        "if len(robot.links) > MOST_LINKS:",
        "if False:",
        NUMBERS,
        "most_of_links",
        "pybullet",
    ),
    "length of words of files": Guard(
        "seals.config.overrides",
        "if sum(map(len, words)) > MOST_SIGNS:",
        "if False:",
        SMALL,
        "long_words",
    ),
    "closed streams": Guard(
        "seals.terminal",
        "PlainStream(stream or nowhere)",
        "PlainStream(stream)",
        SMALL,
        "closed_streams",
    ),
    "signs of a terminal": Guard(
        "seals.terminal", "except UnicodeEncodeError:", "except KeyError:", SMALL, "few_signs"
    ),
    "whom a repeated run talks to": Guard(
        "seals.run.replay_config",
        '{**_read(folder, key), "live": None}',
        "_read(folder, key)",
        SMALL,
        "in_silence",
    ),
    "places where folders are prepared": Guard(
        "seals.scaffold.writing",
        'f".{name}.{secrets.token_hex(8)}.part"',
        'f".{name}.part"',
        SMALL,
        "nobody_knows",
    ),
    "folder of a flag": Guard(
        "seals.cli.words",
        "whole = joined(words)",
        "whole = list(words)",
        SMALL,
        "flag_before",
    ),
    "silent routers": Guard(
        "seals.plugins.live.ros2",
        '        "transport/unicast/open_timeout": PATIENCE,\n',
        "",
        SMALL,
        "silent_router",
        "zenoh",
    ),
    "files of the installation": Guard(
        "seals.cli.installed_files",
        'elif path.hash.mode == "sha256" and _code(file) != path.hash.value:',
        "elif False:",
        "tests/unit/test_installed_files.py",
        "overwrote or edited",
    ),
    "names of instances": Guard(
        "seals.run.build", "if not _NAME.fullmatch(str(name)):", "if False:", ROLES, "instances"
    ),
}
