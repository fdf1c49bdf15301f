"""Guards of stored states: checkpoints and other states of arrays and JSON."""

from __future__ import annotations

from benchmarks.guard import Guard

KEPT, STATES = "tests/unit/test_run_checkpoint.py", "tests/unit/test_state_file.py"
BOMBS = "tests/unit/test_config.py"
WATER = "tests/unit/test_pbf_water.py"

STORED_STATES: dict[str, Guard] = {
    "old checkpoints": Guard(
        "seals.run.checkpoint", "if (folder / OLD).exists():", "if False:", KEPT, "old_kind"
    ),
    "pickles as states": Guard(
        "seals.state_file", 'if raw[:1] == b"\\x80":', "if False:", KEPT, "old_kind"
    ),
    "versions of a state": Guard(
        "seals.state_file", "if version not in _READERS:", "if False:", STATES, "other_versions"
    ),
    "size of a state": Guard("seals.state_file", "if size > most:", "if False:", STATES, "sparse"),
    "lengths of a state": Guard(
        "seals.state_file",
        "len(raw) + _DIGEST + text + arrays != size",
        "False",
        STATES,
        "does_not_have",
    ),
    "JSON text of a state": Guard(
        "seals.state_file", "text > MOST_TEXT or", "", STATES, "does_not_have"
    ),
    "digest of a state": Guard(
        "seals.state_file",
        "if found.digest() != file.read(_DIGEST):",
        "if False:",
        STATES,
        "changed_number",
    ),
    "declared arrays of a state": Guard(
        "seals.state_file",
        "if total != held:",
        "if False:",
        STATES,
        "forged_states and huge",
    ),
    "objects in a state": Guard(
        "seals.state_file", "str(dtype) not in _DTYPES or", "", STATES, "forged_states and objects"
    ),
    "shapes in a state": Guard(
        "seals.state_file",
        "len(shape) > 16 or any(type(n) is not int or not 0 <= n <= MOST_BYTES for n in shape)",
        "False",
        STATES,
        "forged_states and negative",
    ),
    "links to a state": Guard(
        "seals.state_file", 'getattr(os, "O_NOFOLLOW", 0)', "0", STATES, "ordinary"
    ),
    "pipes as a state": Guard(
        "seals.state_file",
        "if not stat.S_ISREG(os.fstat(descriptor).st_mode):",
        "if False:",
        STATES,
        "ordinary",
    ),
    "numbers of a state": Guard(
        "seals.state_file", "parse_constant=_refuse_number,", "", STATES, "forged_states and number"
    ),
    "infinite numbers of a state": Guard(
        "seals.state_file", "parse_float=_finite,", "", STATES, "forged_states and infinite"
    ),
    "digits of a state": Guard(
        "seals.state_file", "parse_int=_whole,", "", STATES, "forged_states and long"
    ),
    "entries of a state": Guard(
        "seals.state_file", "object_pairs_hook=_once,", "", STATES, "forged_states and twice"
    ),
    "kind of a state": Guard(
        "seals.state_file",
        'if about["kind"] != kind:',
        "if False:",
        STATES,
        "forged_states and kind",
    ),
    "depth of a state": Guard(
        "seals.state_tree",
        "if depth > DEEPEST:\n        raise ValueError",
        "if False:\n        raise ValueError",
        STATES,
        "forged_states and deep",
    ),
    "marks of a state": Guard(
        "seals.state_tree",
        'if mark not in ("t", "x", "m"):',
        "if False:",
        STATES,
        "forged_states and mark",
    ),
    "keys of a state": Guard(
        "seals.state_tree",
        'if mark != "t" and len(_all_of(list, content)) > MOST_KEYS:',
        "if False:",
        STATES,
        "forged_states and hash",
    ),
    "classes of a state": Guard(
        "seals.state_records", "if cls is None:", "if False:", KEPT, "writes_files"
    ),
    "fields of a record": Guard(
        "seals.state_records",
        "if set(values) != set(names):",
        "if False:",
        STATES,
        "forged_states and fields",
    ),
    "kinds of fields": Guard(
        "seals.state_records",
        "if field in kinds and not fits(values[field], kinds[field]):",
        "if False:",
        STATES,
        "forged_states and wrong",
    ),
    "form of a state": Guard(
        "seals.run.checkpoint", "        conform(snapshot, like)\n", "", KEPT, "forged_states"
    ),
    "generator of a state": Guard(
        "seals.run.checkpoint",
        "random = {name: checked_generator(own) for name, own in snapshot.random.items()}",
        "random = dict(snapshot.random)",
        KEPT,
        "forged_states and generator",
    ),
    "world of a state": Guard(
        "seals.run.checkpoint",
        '        _refuse_other_world(state["world"], world)\n',
        "",
        KEPT,
        "forged_states and world",
    ),
    "time of a state": Guard(
        "seals.run.checkpoint",
        "snapshot.time != snapshot.steps * world.step_size or snapshot.steps < 0",
        "False",
        KEPT,
        "forged_states and steps",
    ),
    "scene of a state": Guard(
        "seals.run.checkpoint", "if _digest(content) != digest:", "if False:", KEPT, "never_reaches"
    ),
    "trial of a scene": Guard(
        "seals.plugins.backends.pybullet.trial",
        "return os.waitpid(child, 0)[1] == 0",
        "return os.waitpid(child, 0)[0] == child",
        KEPT,
        "kills_the_engine",
    ),
    "size of a scene": Guard(
        "seals.run.checkpoint", "if len(content) > MOST_SCENE:", "if False:", KEPT, "never_reaches"
    ),
    "link to a checkpoint": Guard(
        "seals.run.checkpoint", "if kept.is_symlink():", "if False:", KEPT, "folder_is_no_link"
    ),
    "size of a run": Guard(
        "seals.run.checkpoint",
        "read_state(kept / STATE, KIND, most=most)",
        "read_state(kept / STATE, KIND)",
        KEPT,
        "larger_than_the_run",
    ),
    "rows of a state": Guard(
        "seals.run.recorder",
        "if type(kept) is not int or not 1 <= kept <= most:",
        "if False:",
        KEPT,
        "forged_states and rows",
    ),
    "tables of a state": Guard(
        "seals.run.recorder", "kept.shape != wanted or", "", KEPT, "forged_states and rows"
    ),
    "ledger of a state": Guard(
        "seals.world.ledger",
        "if np.ndim(time) != 1 or wrenches.shape != wanted:",
        "if False:",
        KEPT,
        "forged_states and ledger",
    ),
    "pictures of a state": Guard(
        "seals.run.pictures",
        "copy_own(file, folder",
        "__import__('shutil').copyfile(file, folder",
        KEPT,
        "pictures_come",
    ),
    "errors of a memory": Guard(
        "seals.run.simulation",
        "fault if kept is None else _blamed(kept, fault)",
        "fault",
        KEPT,
        "only_its_owner",
    ),
    "choices that have an end": Guard(
        "seals.config.strangers", "if wrong is not None:", "if False:", BOMBS, "choices_have"
    ),
    "circle of choices": Guard(
        "seals.config.strangers", "if name in above:", "if False:", BOMBS, "choices_have"
    ),
    "number of choices": Guard(
        "seals.config.strangers", "if count > MOST_CHOSEN:", "if False:", BOMBS, "choices_have"
    ),
    "levels of choices": Guard(
        "seals.config.strangers", "if levels > DEEPEST:", "if False:", BOMBS, "choices_have"
    ),
    "words for a circle": Guard(
        "seals.config.refusal",
        "except RecursionError as error:",
        "except ZeroDivisionError as error:",
        BOMBS,
        "trusted_folder",
    ),
    "ends of references": Guard(
        "seals.config.checks",
        "if path in self.open or depth > DEEPEST:",
        "if False:",
        BOMBS,
        "references_have",
    ),
    "growth of references": Guard(
        "seals.config.checks", "if total > MOST:", "if False:", BOMBS, "references_have"
    ),
    "references of a stored run": Guard(
        "seals.run.replay_config", "    refuse_growth(raw)\n", "", BOMBS, "references_have"
    ),
    "references of a folder": Guard(
        "seals.config.strangers", "        refuse_growth(content)\n", "", BOMBS, "itself_ends"
    ),
    "particles of a state": Guard(
        "seals.plugins.fluids.solvers.device_solver",
        "        _check_state(arrays, self.capacity)\n",
        "",
        WATER,
        "forged_snapshot",
    ),
}
