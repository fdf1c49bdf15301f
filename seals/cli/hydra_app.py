"""Start of a command as a Hydra application, with overrides, ``--multirun`` and launchers."""

from __future__ import annotations

import argparse
import contextlib
import errno
import importlib
import io
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.cli.slips import (
    RESUME,
    folder_key,
    refuse_slips,
    refuse_unknown_flags,
    with_folder,
)
from seals.cli.sweep import MULTIRUN, begun, own_words, with_objective
from seals.config import roots
from seals.config.overrides import flag_parser, joined, parsed, value_of
from seals.config.strangers import TRUST, untrusted
from seals.errors import ConfigError, SealsError
from seals.logs.room import told_full
from seals.logs.run_folder import LOCK
from seals.run.stopping import stoppable

Task = Callable[[Any], "int | None"]
_JOB = "hydra_app"
"""Name of every job, for launchers."""
_FOLDER_FLAGS = ("--config-dir", "--config-path")
_DENIED = (errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST, errno.ENOTDIR)


@dataclass(frozen=True)
class Application:
    """Task of a verb: a function that is imported once the configuration stands.

    Args:
        module: that holds the function.
        name: of the function, which takes the configuration and may return an exit code.
        logs: whether the configuration may give logs by their short names.
        folder: whether ``out`` is a folder; else a file, or one that the function looks at.
        run: whether a run is configured, which is refused before anything heavy is imported.
    """

    module: str
    name: str = "execute"
    logs: bool = False
    folder: bool = True
    run: bool = False

    def __call__(self, config: Any) -> int | None:
        """Call the function."""
        from hydra.core.hydra_config import HydraConfig

        if self.folder and config.get("out"):
            # refuse an output folder that is a file, or below one, before anything is computed
            out = Path(str(config.out))
            file = next((place for place in (out, *out.parents) if place.is_file()), None)
            if file is not None:
                raise ConfigError(
                    f"out={out} must be a folder, but {file} is a file.\n"
                    "Give another name: out=FOLDER"
                )
        if self.logs:
            from seals.sysid.report.given_logs import place_logs

            place_logs(config)
        if self.run:
            from seals.config.build import build
            from seals.run.build import build_run

            build_run(config)
            if "reader" in config:
                build(config.reader, where="reader")
        try:
            code: int | None = getattr(importlib.import_module(self.module), self.name)(config)
            return code
        finally:
            # what has a folder of its own leaves none here; a live view begins its run later
            live = config.get("show") is not None and config.run is None
            if not live and (config.get("out") or not self.run):
                _discard(Path(HydraConfig.get().runtime.output_dir))


def run(arguments: list[str]) -> int:
    """Run ``seals run``: compose and check the configuration, then call its application.

    A manoeuvre that ``seals plan`` wrote is flown with the vehicle and controller of its file.
    """
    if (value_of(arguments, "experiment") or "").endswith((".yaml", ".yml")):
        from seals.sysid.experiment_design.simulated import run as fly

        return fly(arguments)
    return launch("run", arguments, Application("seals.run.application", run=True))


def diagnose(arguments: list[str]) -> int:
    """Run ``seals diagnose``: compose the configuration, then call its application.

    The runs of an experiment are those that ``seals compare`` takes.
    """
    if value_of(arguments, "experiment") is not None:
        return launch("compare", arguments, Application("seals.sysid.report.runs_application"))
    return launch("diagnose", arguments, Application("seals.sysid.report.application", logs=True))


def channelled(arguments: list[str]) -> list[str]:
    """Return the words of ``seals autopilot`` with its controller, over the one of the robot."""
    given = value_of(arguments, "controller")
    return [*arguments, "controller=channels"] if given is None else arguments


def viewed(arguments: list[str]) -> list[str]:
    """Return the words of ``seals view``; ``replay=`` is another name of ``run=``."""
    return [f"run={w[7:]}" if w.startswith("replay=") else w for w in arguments]


def rendered(arguments: list[str]) -> list[str]:
    """Return the words of ``seals render``: the renderer is an option of the group of viewers."""
    return [f"viewer@{word}" if word.startswith("renderer=") else word for word in arguments]


def launch(
    root: str,
    arguments: list[str],
    task: Task,
    *,
    own: Sequence[str] | None = None,
    source: str = "",
) -> int:
    """Run a task as a Hydra application.

    Args:
        root: name of the root configuration, one of `seals.config.roots.VERBS`.
        arguments: overrides and Hydra's own flags.
        task: takes the composed configuration; may return an exit code.
        own: those of the command line, where others come from a file; None for all.
        source: the file, for the message when it sets more than data.

    Returns:
        The exit code of the task, 0 by default.

    Raises:
        SealsError: the overrides, or the task, were refused; no run folder is left behind.
    """
    from hydra import initialize_config_dir, initialize_config_module
    from hydra.core.global_hydra import GlobalHydra

    from seals.config.refusal import refusals
    from seals.config.roots import experiments
    from seals.config.source import install
    from seals.sweep.job import checked_by_value
    from seals.sweep.watch import Sweep, watched

    sweeping = any(word in MULTIRUN for word in arguments)
    arguments = with_folder(root, joined(arguments), several=sweeping)
    refuse_unknown_flags(arguments)
    # Hydra's parser takes no flag between two overrides
    arguments = sorted(with_objective(arguments), key=lambda word: not word.startswith("-"))
    kept = [word for word in arguments if word == RESUME]
    trusting = TRUST in arguments
    checked = _refuse_flags([word for word in arguments if word != RESUME])
    own = checked if own is None else own
    folders = [w for w in checked if w.startswith(_FOLDER_FLAGS)]
    arguments, resumed, note = begun(root, [*kept, *checked])
    source = "" if trusting else source or note or ", ".join(folders)
    experiment = value_of(arguments, "experiment")
    verb = root if experiment is None else experiments().get(experiment, root)
    if verb not in (root, "run" if root == "view" else root):
        raise ConfigError(
            f"experiment '{experiment}' is not one for seals {root}.\n"
            f"Write: seals {verb} experiment={experiment}"
        )
    refuse_slips(root, arguments)
    given = parsed(arguments)
    sweep = Sweep(root, own_words(arguments), resumed=resumed)
    outcome = _Outcome(task, sweep.claim, root, list(own), source)
    with (
        _endings(sweep, "sweep" if sweeping else "run", folder_key(root, several=sweeping)),
        stoppable(),
        refusals(
            given.overrides,
            root=root,
            several=given.multirun or "hydra.mode=MULTIRUN" in given.overrides,
        ),
        watched(sweep),
        checked_by_value(),
    ):
        install(given.config_dir)
        GlobalHydra.instance().clear()
        where = given.config_path or "pkg://seals.conf"
        with (
            initialize_config_module(where.removeprefix("pkg://"), _JOB, version_base="1.3")
            if where.startswith("pkg://")
            else initialize_config_dir(
                os.path.abspath(where.removeprefix("file://")), _JOB, version_base="1.3"
            )
        ):
            _perform(given, given.config_name or root, outcome)
    if outcome.error is not None:
        raise outcome.error
    if sweep.folder is None:
        return outcome.code
    code: int = sweep.report()
    _discard(sweep.folder.absolute())
    return code


def _perform(given: argparse.Namespace, root: str, outcome: _Outcome) -> None:
    """Let Hydra run a task, once or many times, or show what the flags ask for."""
    from hydra.core.global_hydra import GlobalHydra
    from hydra.types import RunMode

    from seals.sweep.job import sets_mode

    hydra: Any = GlobalHydra.instance().hydra
    words = given.overrides
    if given.hydra_help:
        hydra.hydra_help(config_name=root, args_parser=flag_parser(), args=given)
    elif given.cfg:
        shown = {"cfg_type": given.cfg, "package": given.package, "resolve": given.resolve}
        hydra.show_cfg(config_name=root, overrides=words, **shown)
    elif given.shell_completion:
        hydra.shell_completion(root, words)
    elif given.info:
        hydra.show_info(given.info, config_name=root, overrides=words)
    else:
        # a composition for the mode alone takes a quarter of a second
        files = given.config_dir or given.config_path or given.config_name
        stated = hydra.get_mode(root, words) if files or sets_mode(words) else None
        several = given.multirun or stated == RunMode.MULTIRUN
        mode = RunMode.MULTIRUN if several else RunMode.RUN
        words = words if stated == mode else [*words, f"hydra.mode={mode.name}"]
        (hydra.multirun if several else hydra.run)(root, outcome, words)


@contextlib.contextmanager
def _endings(sweep: Any, kind: str, place: str) -> Iterator[None]:
    """Explain an error of Hydra or a launcher; remove the folder of a refused sweep."""
    try:
        yield
    except SealsError:
        if sweep.folder is not None:
            sweep.discard()
            _discard(sweep.folder.absolute())
        raise
    except KeyboardInterrupt:
        if sweep.folder is not None:
            print("To continue: the same command with --resume.", file=sys.stderr)
        raise
    except Exception as error:
        # those have words of their own
        if told_full(error) or (isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG):
            raise
        if isinstance(error, FileExistsError | NotADirectoryError) and sweep.folder is None:
            raise ConfigError(
                f"the {kind} folder cannot be created: '{error.filename}' is a file or lies "
                "below a file.\n"
                f"Give another name: {place}=FOLDER"
            ) from error
        if isinstance(error, OSError) and (sweep.folder is None or error.errno in _DENIED):
            raise ConfigError(
                f"the {kind} folder cannot be created: {error}.\n"
                f"Change to a folder in which you may write, or give {place}=FOLDER."
            ) from error
        if sweep.folder is None:
            raise
        refusal = sweep.cut_short(error)
        _discard(sweep.folder.absolute())
        raise refusal from error


class _Outcome:
    """Runner of the task that keeps its error from Hydra, which would print it again.

    It refuses references without end, and what a file may not set.
    """

    def __init__(self, task: Task, claim: Any, root: str, own: list[str], source: str) -> None:
        self.task, self.claim = task, claim
        self.root, self.own, self.source = root, own, source
        self.code = 0
        self.error: Exception | None = None

    def checked(self, config: Any) -> int | None:
        """Call the task, once the configuration is checked."""
        from seals.config.checks import refuse_growth
        from seals.config.foreign_values import refuse_values

        refuse_growth(config)
        if self.source:
            refuse_values(config, root=self.root, words=self.own, where=self.source)
        return self.task(config)

    def __call__(self, config: Any) -> float | tuple[float, ...] | None:
        from hydra.core.hydra_config import HydraConfig
        from hydra.types import RunMode

        from seals.sweep.metrics import objective_of

        settings = HydraConfig.get()
        if settings.mode == RunMode.MULTIRUN:
            from seals.sweep.job import perform
            from seals.sweep.watch import Stopped

            # a launcher may run this in another process: what happens is noted on disk
            perform(self.checked, config)
            try:
                return objective_of(settings)
            except ConfigError as wrong:
                # in one job as in every other
                raise Stopped(wrong) from None
        try:
            self.code = self.checked(config) or 0
            found = objective_of(settings)
            if found is not None:
                print(f"objective: {found}")
        except Exception as error:
            if isinstance(error, SealsError):
                _discard(Path(settings.runtime.output_dir))
            self.claim.give_back()
            self.error = error
        except KeyboardInterrupt:
            _discard(Path(settings.runtime.output_dir))
            raise
        return None


def _discard(folder: Path) -> None:
    """Remove an empty run folder and its empty parent folders."""
    entries = {entry.name for entry in folder.iterdir()} if folder.is_dir() else {"absent"}
    if entries - {".hydra", LOCK}:
        return
    shutil.rmtree(folder / ".hydra", ignore_errors=True)
    (folder / LOCK).unlink(missing_ok=True)
    for level in (folder, *folder.parents):
        # parents outside the working directory are none of ours to tidy
        if level != folder and Path.cwd() not in level.parents:
            return
        try:
            level.rmdir()
        except OSError:
            return


def _refuse_flags(arguments: list[str]) -> list[str]:
    """Check the flags by Hydra's parser, and report its error in two lines.

    Returns:
        The arguments that are Hydra's.
    """
    if "--resolve" in arguments and not {"--cfg", "-c"} & {w.partition("=")[0] for w in arguments}:
        raise ConfigError("--resolve prints nothing on its own.\nWrite: --cfg job --resolve")
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            given = parsed([word for word in arguments if word != TRUST])
    except SystemExit as stop:
        verdict = said.getvalue().strip().rpartition("error: ")[2].partition("\n")[0]
        raise ConfigError(
            f"{' '.join(arguments)}: {verdict}.\n"
            "Allowed: KEY=VALUE, --multirun, --resume, --cfg job|hydra|all, --package KEY, "
            "--config-dir DIR"
        ) from stop
    for flag, folder in (("dir", given.config_dir), ("path", given.config_path)):
        if folder and "://" not in folder and not Path(folder).is_dir():
            raise ConfigError(
                f"--config-{flag} {folder}: there is no such folder.\n"
                "Give a folder of configurations: seals run --config-dir FOLDER experiment=NAME"
            )
    if given.config_name in roots.NAMES:
        raise ConfigError(
            f"--config-name {given.config_name}: this is a schema, not a configuration.\n"
            f"Leave it out: seals {given.config_name.removesuffix('_schema')} KEY=VALUE"
        )
    return untrusted(arguments)
