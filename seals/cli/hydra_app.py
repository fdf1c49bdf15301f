"""Start of a command as a Hydra application, with overrides, ``--multirun`` and launchers."""

from __future__ import annotations

import contextlib
import errno
import importlib
import io
import os
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.cli.slips import (
    folder_key,
    question,
    refuse_cut,
    refuse_slips,
    refuse_unknown_flags,
    with_folder,
)
from seals.cli.sweep import MULTIRUN, RESUME, begun, own_words, with_objective
from seals.config import roots
from seals.config.overrides import joined
from seals.config.strangers import TRUST, untrusted
from seals.errors import ConfigError, SealsError
from seals.logs.room import told_full
from seals.logs.run_folder import LOCK
from seals.run.stopping import stoppable

Task = Callable[[Any], "int | None"]
_FOLDER_FLAGS = ("--config-dir", "--config-path")
_DENIED = (errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST, errno.ENOTDIR)


@dataclass(frozen=True)
class Application:
    """Task of a verb: a function that is imported once the configuration stands.

    Args:
        module: that holds the function.
        name: of the function, which takes the configuration and may return an exit code.
        logs: whether the configuration may give logs by their short names.
        tidy: whether the folder of the command goes when nothing was written into it.
    """

    module: str
    name: str = "execute"
    logs: bool = False
    tidy: bool = False

    def __call__(self, config: Any) -> int | None:
        """Call the function."""
        from hydra.core.hydra_config import HydraConfig

        if self.logs:
            from seals.sysid.report.given_logs import place_logs

            place_logs(config)
        try:
            code: int | None = getattr(importlib.import_module(self.module), self.name)(config)
            return code
        finally:
            if self.tidy:
                discard(Path(HydraConfig.get().runtime.output_dir))


def run(arguments: list[str]) -> int:
    """Run ``seals run``: compose and check the configuration, then call its application.

    A manoeuvre that ``seals plan`` wrote is flown with the vehicle and controller of its file.
    """
    for word in arguments:
        key, _, value = word.partition("=")
        if key == "experiment" and value.endswith((".yaml", ".yml")):
            from seals.sysid.experiment_design.simulated import run as fly

            return fly(arguments)
    return launch("run", arguments, _run_task)


def compare(arguments: list[str]) -> int:
    """Run ``seals compare``: compose and check the configuration, then call its application."""
    return launch("compare", arguments, _compare_task)


def diagnose(arguments: list[str]) -> int:
    """Run ``seals diagnose``: compose the configuration, then call its application.

    The runs of an experiment are those that ``seals compare`` takes.
    """
    # many small matrices: threads inside the linear algebra only get into each other's way
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if any(word.partition("=")[0] == "experiment" for word in arguments):
        return launch("compare", arguments, Application("seals.sysid.report.runs_application"))
    return launch("diagnose", arguments, Application("seals.sysid.report.application", logs=True))


def calibrate(arguments: list[str]) -> int:
    """Run ``seals calibrate``: compose the configuration, then call its application."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    return launch(
        "calibrate", arguments, Application("seals.sysid.calibration.application", logs=True)
    )


def add(arguments: list[str]) -> int:
    """Run ``seals add``: compose the configuration, then call its application."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # the model itself says where it comes from
    task = Application("seals.sysid.validation.application", "add", logs=True, tidy=True)
    return launch("add", arguments, task)


def verify(arguments: list[str]) -> int:
    """Run ``seals verify``: compose the configuration, then call its application."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    return launch(
        "verify", arguments, Application("seals.sysid.validation.application", "verify", logs=True)
    )


def plan(arguments: list[str]) -> int:
    """Run ``seals plan``: compose the configuration, then call its application."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    task = Application("seals.sysid.experiment_design.application", logs=True)
    return launch("plan", question(arguments), task)


def teleop(arguments: list[str]) -> int:
    """Run ``seals teleop``: compose the configuration, then call its application."""
    return launch("teleop", arguments, Application("seals.teleop.application"))


def autopilot(arguments: list[str]) -> int:
    """Run ``seals autopilot``: compose the configuration, then call its application."""
    if not any(word.partition("=")[0] == "controller" for word in arguments):
        # over the one that a robot chooses
        arguments = [*arguments, "controller=channels"]
    return launch("autopilot", arguments, Application("seals.teleop.autopilot.application"))


def view(arguments: list[str]) -> int:
    """Run ``seals view``: compose the configuration, then call its application."""
    # with a flag before it, a folder is the flag's own
    words = [w if "=" in w or not Path(w).is_dir() else f"replay='{w}'" for w in joined(arguments)]
    return launch("view", words, _view_task)


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
        root: name of the root configuration: ``run``, ``compare`` or ``diagnose``.
        arguments: overrides and Hydra's own flags.
        task: takes the composed configuration; may return an exit code.
        own: those of the command line, where others come from a file; None for all.
        source: the file, for the message when it sets more than data.

    Returns:
        The exit code of the task, 0 by default.

    Raises:
        SealsError: the overrides, or the task, were refused; no run folder is left behind.
    """
    import hydra

    from seals.config.refusal import refusals
    from seals.config.source import install
    from seals.sweep.checking import checked_by_value, composed_once
    from seals.sweep.watch import Sweep, watched

    sweeping = any(word in MULTIRUN for word in arguments)
    arguments = with_folder(root, joined(arguments), several=sweeping)
    refuse_unknown_flags(arguments, _FLAGS)
    refuse_cut(arguments)
    # Hydra's parser takes no flag between two overrides
    arguments = sorted(with_objective(arguments), key=lambda word: not word.startswith("-"))
    kept = [word for word in arguments if word == RESUME]
    checked = _refuse_flags([word for word in arguments if word != RESUME])
    own = checked if own is None else own
    trusting = TRUST in arguments
    folders = [w for w in checked if w.startswith(_FOLDER_FLAGS)]
    arguments, resumed, note = begun(root, [*kept, *checked])
    source = "" if trusting else source or note or ", ".join(folders)
    _refuse_other_verb(root, arguments)
    refuse_slips(root, arguments)
    install()
    sweep = Sweep(root, own_words(arguments), resumed=resumed)
    outcome = _Outcome(_measured(task, root, list(own), source), sweep.claim)
    application = hydra.main(version_base="1.3", config_path="pkg://seals.conf", config_name=root)
    overrides = [word for word in arguments if not word.startswith("-")]
    with (
        _endings(sweep, "sweep" if sweeping else "run", folder_key(root, several=sweeping)),
        _hydra_process(root, arguments),
        stoppable(),
        refusals(overrides, root=root),
        watched(sweep),
        checked_by_value(),
        composed_once(arguments),
    ):
        application(outcome)()
    if outcome.error is not None:
        raise outcome.error
    return outcome.code if sweep.folder is None else _ended(sweep)


@contextlib.contextmanager
def _endings(sweep: Any, kind: str, place: str) -> Iterator[None]:
    """Explain an error of Hydra or a launcher; remove the folder of a refused sweep."""
    try:
        yield
    except SealsError:
        if sweep.folder is not None:
            sweep.discard()
            discard(sweep.folder.absolute())
        raise
    except KeyboardInterrupt:
        if sweep.folder is not None:
            print("To go on: the same command with --resume.", file=sys.stderr)
        raise
    except Exception as error:
        # those have words of their own
        if told_full(error) or (isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG):
            raise
        if isinstance(error, FileExistsError | NotADirectoryError) and sweep.folder is None:
            raise ConfigError(
                f"the {kind} folder cannot be made: '{error.filename}' is a file or below one.\n"
                f"Give another name: {place}=FOLDER"
            ) from error
        if isinstance(error, OSError) and (sweep.folder is None or error.errno in _DENIED):
            raise ConfigError(
                f"the {kind} folder cannot be made: {error}.\n"
                f"Go to a folder in which you may write, or say {place}=FOLDER."
            ) from error
        if sweep.folder is None:
            raise
        refusal = sweep.cut_short(error)
        discard(sweep.folder.absolute())
        raise refusal from error


def _ended(sweep: Any) -> int:
    """Report on a sweep, and remove its folder if it is empty."""
    code: int = sweep.report()
    discard(sweep.folder.absolute())
    return code


def _measured(task: Task, root: str, own: list[str], source: str) -> Task:
    """Return a task that refuses references without end, and what a file may not set."""

    def perform(config: Any) -> int | None:
        from seals.config.checks import refuse_growth
        from seals.config.foreign_values import refuse_values

        refuse_growth(config)
        if source:
            refuse_values(config, root=root, words=own, where=source)
        return task(config)

    return perform


class _Outcome:
    """Runner of the task that keeps its error from Hydra, which would print it again."""

    def __init__(self, task: Task, claim: Any) -> None:
        self.task, self.claim = task, claim
        self.code = 0
        self.error: Exception | None = None

    def __call__(self, config: Any) -> float | tuple[float, ...] | None:
        from hydra.core.hydra_config import HydraConfig
        from hydra.types import RunMode

        from seals.sweep.metrics import objective_of

        settings = HydraConfig.get()
        if settings.mode == RunMode.MULTIRUN:
            from seals.sweep.job import perform
            from seals.sweep.watch import Stopped

            # a launcher may run this in another process: what happens is noted on disk
            perform(self.task, config)
            try:
                return objective_of(settings)
            except ConfigError as wrong:
                # in one job as in every other
                raise Stopped(wrong) from None
        try:
            self.code = self.task(config) or 0
            found = objective_of(settings)
            if found is not None:
                print(f"objective: {found}")
        except Exception as error:
            if isinstance(error, SealsError):
                discard(Path(settings.runtime.output_dir))
            self.claim.give_back()
            self.error = error
        except KeyboardInterrupt:
            discard(Path(settings.runtime.output_dir))
            raise
        return None


def discard(folder: Path) -> None:
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


def _run_task(config: Any) -> int | None:
    from seals.run.build import build_run

    build_run(config)  # refuse before anything heavy is imported
    return Application("seals.run.application")(config)


def _compare_task(config: Any) -> int | None:
    from seals.config.build import build
    from seals.run.build import build_run

    build_run(config)
    build(config.reader, where="reader")
    return Application("seals.compare.application")(config)


def _view_task(config: Any) -> int | None:
    # a replay that started no run has nothing to keep
    return Application("seals.view.application", tidy=config.replay is not None)(config)


_FLAGS = (
    "--multirun",
    RESUME,
    "--cfg",
    "--resolve",
    "--package",
    "--config-dir",
    "--config-path",
    "--config-name",
    "--info",
    "--help",
    "--hydra-help",
    "--version",
    TRUST,
)


def _refuse_flags(arguments: list[str]) -> list[str]:
    """Check the flags by Hydra's parser, and report its error in two lines.

    Returns:
        The arguments that are Hydra's.
    """
    from hydra._internal.utils import get_args_parser

    if "--resolve" in arguments and not {"--cfg", "-c"} & {w.partition("=")[0] for w in arguments}:
        raise ConfigError("--resolve prints nothing by itself.\nWrite: --cfg job --resolve")
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            given = get_args_parser().parse_args([word for word in arguments if word != TRUST])
    except SystemExit as stop:
        verdict = said.getvalue().strip().rpartition("error: ")[2].partition("\n")[0]
        raise ConfigError(
            f"{' '.join(arguments)}: {verdict}.\n"
            "Allowed: KEY=VALUE, --multirun, --resume, --cfg job|hydra|all, --package KEY, "
            "--config-dir DIR"
        ) from stop
    if given.config_dir and not Path(given.config_dir).is_dir():
        raise ConfigError(
            f"--config-dir {given.config_dir}: there is no such folder.\n"
            "Give a folder of configurations: seals run --config-dir FOLDER experiment=theirs"
        )
    if given.config_name in roots.NAMES:
        raise ConfigError(
            f"--config-name {given.config_name}: that is the schema of a configuration, not one.\n"
            f"Leave it out: seals {given.config_name.removesuffix('_schema')} KEY=VALUE"
        )
    return untrusted(arguments)


def _refuse_other_verb(root: str, arguments: list[str]) -> None:
    """Refuse an experiment that belongs to the other verb."""
    from seals.config.recipes import experiments

    for word in arguments:
        key, _, name = word.partition("=")
        verb = experiments().get(name, root) if key == "experiment" else root
        if verb not in (root, "run" if root == "view" else root):
            raise ConfigError(
                f"experiment '{name}' is not one for seals {root}.\n"
                f"Write: seals {verb} experiment={name}"
            )


@contextlib.contextmanager
def _hydra_process(root: str, arguments: list[str]) -> Iterator[None]:
    """Set the arguments for Hydra, and raise its errors instead of printing them."""
    argv, full = sys.argv, os.environ.get("HYDRA_FULL_ERROR")
    sys.argv = [f"seals {root}", *arguments]
    os.environ["HYDRA_FULL_ERROR"] = "1"
    try:
        with warnings.catch_warnings():
            # Hydra warns that --multirun overrides its own default mode
            warnings.filterwarnings("ignore", message=".*--multirun.*")
            yield
    finally:
        sys.argv = argv
        if full is None:
            del os.environ["HYDRA_FULL_ERROR"]
        else:
            os.environ["HYDRA_FULL_ERROR"] = full
