"""Guards of run folders and of the processes that the program starts."""

from __future__ import annotations

from benchmarks.guard import Guard

LOCKS, CHILDREN = "tests/unit/test_run_lock.py", "tests/unit/test_child_process.py"
STRANGE, CACHES = "tests/unit/test_hostile_runs.py", "tests/unit/test_caches.py"
_FOLDER = "seals.logs.run_folder"

RUN_FOLDERS: dict[str, Guard] = {
    "lock of a run": Guard(
        _FOLDER,
        "            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)\n",
        "",
        LOCKS,
        "one_living_run or second_run",
    ),
    "locks are files": Guard(
        _FOLDER, "if not stat.S_ISREG(os.fstat(descriptor).st_mode):", "if 0:", LOCKS, "ordinary"
    ),
    "used folders": Guard(
        "seals.logs.run_folder",
        "            self.earlier = set_aside(folder)\n",
        "            pass\n",
        LOCKS,
        "killed_run",
    ),
    "folders of refused runs": Guard(
        _FOLDER, "            bring_back(earlier)\n", "            pass\n", LOCKS, "as_it_was"
    ),
    "moves that were cut off": Guard(
        _FOLDER, "        _roll_back(folder)\n        yield", "        yield", LOCKS, "cut_off_move"
    ),
    "logs of another run": Guard(
        _FOLDER,
        "if not own or not logged or own == logged:",
        "if True:",
        LOCKS,
        "mixed_folder",
    ),
    "states of the dead": Guard(
        "seals.sweep.rows",
        "if state == RUNNING and not lives and lockable():",
        "if False:",
        LOCKS,
        "living_from_the_dead",
    ),
    "interrupted writing": Guard(
        "seals.run.application",
        "if beginning.facts and not beginning.ended:",
        "if False:",
        LOCKS,
        "interrupted_writing",
    ),
    "children without the working directory": Guard(
        "seals.child_process",
        "return [sys.executable, *flags, str(file), *words]",
        "return [sys.executable, '-c', 'import runpy, sys; "
        'runpy.run_path(sys.argv[1], run_name="__main__")\', str(file), *words]',
        CHILDREN,
        "runs_none",
    ),
    "empty entries of PYTHONPATH": Guard(
        "seals.child_process",
        'for entry in found.get(PATH, "").split(os.pathsep) if entry]',
        'for entry in found.get(PATH, "").split(os.pathsep)]',
        CHILDREN,
        "runs_none",
    ),
    "repositories above": Guard(
        "seals.run.provenance",
        "str(folder.parent.parent)}",
        '"/"}',
        CHILDREN,
        "repository",
    ),
    "lookups of a recipe": Guard(
        "seals.config.strangers", "found = lookup_in(content)", "found = None", STRANGE, "recipe"
    ),
    "lookups of a run": Guard(
        "seals.run.replay_config",
        "    refuse_lookups(\n",
        "    (lambda *_, **__: None)(\n",
        STRANGE,
        "strangers_run_looks",
    ),
    "names of runs": Guard(
        "seals.sweep.place",
        'if ".." in Path(hydra[kind].dir).parts:',
        "if False:",
        STRANGE,
        "leads_nowhere",
    ),
    "notes of a run that is listed": Guard(
        "seals.sweep.rows",
        "facts = read_json(path, most=_MOST)",
        "import json; facts = json.loads(path.read_text())",
        STRANGE,
        "strange_notes and (deep or huge)",
    ),
    "notes of a run that is repeated": Guard(
        "seals.run.replay_config",
        "facts = read_json(path)",
        "import json; facts = json.loads(path.read_text())",
        STRANGE,
        "strange_notes and (deep or huge)",
    ),
    "owner of a cache": Guard(
        "seals.caches", "found.st_uid != os.getuid()", "False", CACHES, "not_ours"
    ),
    "links in place of a cache": Guard(
        "seals.caches", "found = folder.lstat()", "found = folder.stat()", CACHES, "not_ours"
    ),
    "mode of a cache": Guard(
        "seals.caches", "if stat.S_IMODE(found.st_mode) & 0o077:", "if False:", CACHES, "alone"
    ),
    "relative homes of caches": Guard(
        "seals.caches", "if os.path.isabs(given)", "if given", CACHES, "relative"
    ),
}
"""Every one of them by name."""
