"""Guards of run folders and of the processes that the program starts."""

from __future__ import annotations

from benchmarks.guard import Guard

LOCKS, CHILDREN = "tests/unit/test_run_lock.py", "tests/unit/test_child_process.py"
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
}
"""Every one of them by name."""
