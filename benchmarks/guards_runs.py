"""Guards of run folders and of the processes that the program starts."""

from __future__ import annotations

from benchmarks.guard import Guard

LOCKS, CHILDREN = "tests/unit/test_run_lock.py", "tests/unit/test_child_process.py"
FOLDERS, SIGNALS = "tests/unit/test_hostile_folders.py", "tests/unit/test_signals.py"
REFUSALS = "tests/unit/test_cli_refusals.py"
DISPLAY = "tests/unit/test_sweep_display.py"
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
        _FOLDER, "if not stat.S_ISREG(found.st_mode) or", "if", LOCKS, "ordinary"
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
        "seals.config.strangers",
        "    found = lookup_in(content)\n    if found is not None:\n        yield",
        "    found = None\n    if found is not None:\n        yield",
        STRANGE,
        "recipe",
    ),
    "lookups of a run": Guard(
        "seals.run.replay_config",
        "    refuse_lookups(\n",
        "    (lambda *_, **__: None)(\n",
        STRANGE,
        "strangers_run_looks",
    ),
    "names of runs": Guard(
        "seals.config.source",
        'return checked_name(str(name), key="name") if name else ""',
        "return str(name)",
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
        'read_file(_Facts, path, remedy="Restore it, or remove it.", extra=True)',
        "_Facts(**__import__('json').loads(path.read_text()))",
        STRANGE,
        "strange_notes and (deep or huge)",
    ),
    "display of a damaged sweep": Guard(
        "seals.sweep.watch",
        "except (SealsError, OSError, ValueError):",
        "except ZeroDivisionError:",
        DISPLAY,
        "damaged_book",
    ),
    "end of a display": Guard(
        "seals.sweep.watch",
        "        finally:\n            sweep.stop()\n",
        "        except ZeroDivisionError:\n            pass\n        sweep.stop()\n",
        DISPLAY,
        "locks_do_not",
    ),
    "digest of kept code": Guard(
        "seals.caches",
        "return data if hashlib.sha256(data).digest() == digest else None",
        "return data",
        CACHES,
        "what_was_written",
    ),
    "size of a kept file": Guard(
        "seals.caches",
        "if not path.is_file() or path.stat().st_size > MOST:",
        "if not path.is_file():",
        CACHES,
        "fill_the",
    ),
    "room of kept code": Guard(
        "seals.caches",
        "        if room < 0 and file != newest:\n",
        "        if False:\n",
        CACHES,
        "fill_the",
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
    "links in a run folder": Guard(
        _FOLDER, "        if linked:\n", "        if False:\n", FOLDERS, "links_in_a_run"
    ),
    "notes without room": Guard(
        "seals.sweep.rows", " and (facts or path.stat().st_size > 0)", "", LOCKS, "without_room"
    ),
    "second names of a lock": Guard(
        _FOLDER, " or found.st_nlink > 1", "", FOLDERS, "ordinary_ones and second"
    ),
    "words in a lock": Guard(
        _FOLDER, "found = plain_json(os.read", "found = json.loads(os.read", FOLDERS, "a_holder"
    ),
    "lock of a sweep": Guard(
        "seals.sweep.book",
        "descriptor = open_own(folder / LOCK, os.O_RDWR | os.O_CREAT)",
        "descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT)",
        FOLDERS,
        "ordinary_ones",
    ),
    "book of a sweep": Guard(
        "seals.sweep.book",
        "os.fdopen(open_own(path, flags), ",
        "os.fdopen(os.open(path, flags), ",
        FOLDERS,
        "ordinary_ones",
    ),
    "folders of jobs": Guard(
        "seals.sweep.job",
        "if not folder.resolve().is_relative_to(sweep.resolve()):",
        "if False:",
        FOLDERS,
        "strangers_sweep",
    ),
    "words of jobs": Guard(
        "seals.sweep.job",
        "open_own(folder / SAID, os.O_WRONLY",
        "os.open(folder / SAID, os.O_WRONLY",
        FOLDERS,
        "strangers_sweep",
    ),
    "notes of a sweep": Guard(
        "seals.sweep.watch",
        "if path.is_symlink() or strange:",
        "if strange:",
        FOLDERS,
        "strangers_sweep",
    ),
    "instants of another run": Guard(
        "seals.run.particle_snapshots",
        "with open_regular(file) as source:",
        "with file.open('rb') as source:",
        FOLDERS,
        "taken_over_from and not device and not pipe",
    ),
    "size of an instant": Guard(
        "seals.run.particle_snapshots",
        "if os.fstat(source.fileno()).st_size > MOST_BYTES:",
        "if False:",
        FOLDERS,
        "any_name_or_size",
    ),
    "names of instants": Guard(
        "seals.run.particle_snapshots",
        "if not _TIME.fullmatch(file.stem):",
        "if False:",
        FOLDERS,
        "any_name_or_size",
    ),
    "frames of a run": Guard(
        "seals.view.films.application",
        "if not found.resolve().is_relative_to(run.resolve()):",
        "if False:",
        FOLDERS,
        "frames_stay",
    ),
    "what others put into a cache": Guard(
        "seals.caches",
        "and any(folder.iterdir())",
        "and False",
        CACHES,
        "strange_folders and put",
    ),
    "folder above a cache": Guard(
        "seals.caches", "if above & stat.S_IWOTH", "if False", CACHES, "strange_folders and above"
    ),
    "room of a cache": Guard(
        "seals.caches",
        "        file.write(bytes(_ROOM))\n",
        "        pass\n",
        CACHES,
        "takes_nothing",
    ),
    "settings of pictures": Guard(
        "seals.report.pictures",
        "        os.chdir(os.path.dirname(__file__))\n",
        "        pass\n",
        CHILDREN,
        "out_of_reach",
        "matplotlib",
    ),
    "terminals that are closed": Guard(
        "seals.run.stopping", '("SIGTERM", "SIGHUP")', '("SIGTERM",)', SIGNALS, "render-1"
    ),
    "signals that are ignored": Guard(
        "seals.run.stopping",
        " if signal.getsignal(number) is not signal.SIG_IGN",
        "",
        SIGNALS,
        "stays_ignored",
    ),
    "signals of every command": Guard(
        "seals.cli.main",
        "with stoppable() if ours else contextlib.nullcontext():",
        "if True:",
        SIGNALS,
        "every_verb",
    ),
    "signals before the start": Guard(
        "seals.cli.__main__",
        "signal.signal(signal.SIGINT, signal.SIG_DFL)",
        "pass",
        SIGNALS,
        "before_the_program",
    ),
    "run folders without a name": Guard(
        "seals.cli.slips",
        'if word in (*_FOLDERS, "out="):',
        "if False:",
        REFUSALS,
        "run.dir",
    ),
    "prior of a calibration": Guard(
        "seals.sysid.calibration.application",
        '    check_value("prior", config.prior, parameters_of(CalibrateSettings)["prior"])\n',
        "",
        REFUSALS,
        "prior",
    ),
    "files that a recording would replace": Guard(
        "seals.learn.demonstrations.application",
        "            refuse_taken(str(config[key]), key=key)\n",
        "            pass\n",
        REFUSALS,
        "record",
        "torchrl",
    ),
    "files in the place of a page": Guard(
        "seals.experiments.water_validation",
        "    checked_folder(given.out)\n",
        "",
        REFUSALS,
        "hydrostatics",
    ),
    "names in place of numbers of a list": Guard(
        "seals.config.refusal",
        "        _refuse_key_of_list(error, overrides)\n",
        "",
        REFUSALS,
        "position.z",
    ),
}
"""Every one of them by name."""
