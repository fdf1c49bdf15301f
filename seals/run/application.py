"""``seals run``: simulates a composed configuration and writes its run folder."""

from __future__ import annotations

import contextlib
import datetime
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.config.compose import job_overrides, output_folder
from seals.config.strangers import lookup_in
from seals.errors import ConfigError, MissingExtra, SealsError
from seals.file_names import short_path
from seals.logs.run_folder import (
    ROBOT,
    RUN_ID,
    bring_back,
    held,
    id_of_log,
    log_folder,
    new_id,
    set_aside,
)
from seals.run.build import build_run
from seals.run.checkpoint import Checkpoints, checkpoint_of, interval_of
from seals.run.fleet import fleet_of, key_of
from seals.run.folder import write_config, write_cut, write_end, write_log, write_start
from seals.run.goals import missed
from seals.run.live_output import opened
from seals.run.particle_snapshots import Thinned
from seals.run.provenance import compiled_of, differences, provenance, version_changes
from seals.run.recorder import Recorder
from seals.run.replay_config import recalled
from seals.run.report import write_plots, write_report
from seals.run.settings import RunSettings
from seals.run.settings_remarks import find_conflicts, find_left_out, find_unused
from seals.run.simulation import Ending, Record, simulate
from seals.run.stopping import stoppable
from seals.run.surface import Surfaces
from seals.run.views import views_of


def execute(config: Any) -> int | None:
    """Simulate a composed configuration and write Hydra's run folder.

    Args:
        config: composed by Hydra from the root ``run``.

    Returns:
        An exit code, None for success.

    Raises:
        SealsError: the run cannot start, or failed on the way; what there is has been written.
        KeyboardInterrupt: the run was interrupted; what there is has been written.
    """
    from omegaconf import OmegaConf

    folder, overrides = output_folder(), job_overrides()
    original, cut = (
        None if config.get(key) is None else Path(str(config[key])) for key in ("repeat", "resume")
    )
    if original is not None or cut is not None:
        key, source = ("repeat", original) if original is not None else ("resume", cut)
        assert source is not None
        # a job of a sweep is taken up in its own folder, by the words that began it
        if source != folder:
            others = [word for word in overrides if word.partition("=")[0].lstrip("+") != key]
            if others:
                raise ConfigError(
                    f"{key}= repeats a run unchanged; it cannot be combined with {others[0]}.\n"
                    f"Leave out the other arguments, or start a new run without {key}=."
                )
        config = recalled(source, key=key)
    settings = build_run(config)
    if cut is not None:
        # before the first byte is written
        checkpoint_of(cut)
    if original is None and cut is None and lookup_in(OmegaConf.to_container(config)) is not None:
        # what it looked up is part of what ran: a repeat finds it even where it has changed
        write_config(folder, OmegaConf.create(OmegaConf.to_container(config, resolve=True)))
    if original is not None or cut is not None:
        write_config(folder, config)
    run_into(folder, settings, overrides=overrides, original=original, cut=cut).checked()
    return None


def run_into(
    folder: Path,
    settings: RunSettings,
    *,
    overrides: list[str] | None = None,
    original: Path | None = None,
    cut: Path | None = None,
    recorders: Sequence[Recorder] = (),
) -> Record:
    """Simulate a run and write its folder.

    Args:
        folder: where to; made when it does not exist.
        settings: of the run.
        overrides: what the user wrote, for the report.
        original: folder of the run that this one repeats, to be compared with.
        cut: folder of the run whose last checkpoint this one takes up.
        recorders: called after every step, beside those that write the folder.

    Raises:
        SealsError: the run cannot start, or its files cannot be written.
        ConfigError: another run that is alive writes into the folder.
    """
    beginning = _Beginning(list(overrides or []), original, cut)
    with stoppable(), held(folder) as fresh:
        aside = None
        if fresh and (cut is None or cut.resolve() != folder.resolve()):
            aside = set_aside(folder, notes=False)
        if (folder / ROBOT).exists() and not (folder / "meta.yaml").exists():
            raise ConfigError(
                f"{folder} holds a folder '{ROBOT}' of your own, in the place where a run "
                "writes its robot.\n"
                "Choose another folder: out=NAME"
            )
        try:
            return _run_into(folder, settings, beginning, recorders)
        except BaseException as cause:
            if not beginning.facts and aside is not None:
                bring_back(aside)
            if beginning.facts and not beginning.ended:
                # where there is no time or no room for it, the lock tells
                with contextlib.suppress(SealsError, OSError):
                    write_cut(folder, beginning.facts, cause)
            raise


@dataclass
class _Beginning:
    """Start of a run: words, configuration and time.

    Args:
        overrides: what the user wrote.
        original: folder of the run that this one repeats, or None.
        cut: folder of the run that this one takes up, or None.
        facts: noted when it began; empty before.
        ended: whether its end is noted, too.
    """

    overrides: list[str]
    original: Path | None
    cut: Path | None
    facts: dict[str, Any] = field(default_factory=dict)
    ended: bool = False


def _run_into(
    folder: Path, settings: RunSettings, beginning: _Beginning, recorders: Sequence[Recorder]
) -> Record:
    overrides, facts = beginning.overrides, beginning.facts
    original, cut = beginning.original, beginning.cut
    kept = None if cut is None else checkpoint_of(cut)
    checkpoints = Checkpoints(folder, interval_of(settings))
    watching = [*recorders]
    if settings.surface > 0.0:
        watching.append(Surfaces(settings.surface, settings.fluid))
    if settings.particles > 0.0:
        watching.append(Thinned(settings.particles, settings.fluid))
    # last: what is written beside a step is there when the step is kept
    watching.append(checkpoints)

    def begin() -> None:
        found = {
            "name": settings.name,
            "started": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
            "overrides": overrides,
            "repeat_of": None if original is None else str(original),
            "resume_of": None if cut is None else str(cut),
            **provenance(settings),
        }
        facts.update({RUN_ID: id_of_log(folder) or new_id(), **found})
        write_start(folder, facts)

    with opened(settings.live, settings, folder) as outputs:
        watching += outputs
        record = simulate(
            settings,
            label=settings.name,
            started=begin,
            recorders=watching,
            kept=kept,
            folder=folder,
        )
    facts["compiled"] = compiled_of(settings)
    remarks, reports = find_conflicts(settings), []
    for name, own in fleet_of(settings).items():
        said, report = _written(folder, name, record.fleet[name], own, beginning)
        remarks += said
        reports.append(report)
    remarks += [] if original is None else _verdict(folder, original, record.fleet)
    remarks += [] if cut is None else [f"Continued from the last checkpoint of {cut}."]
    write_end(folder, facts, record, remarks)
    beginning.ended = True
    if record.ending is Ending.done:
        checkpoints.clear()
    _say(record, settings, remarks, reports)
    return record


def _written(
    folder: Path, name: str, record: Record, settings: RunSettings, beginning: _Beginning
) -> tuple[list[str], Path]:
    """Write log, ledger and report of one robot; return remarks and the report."""
    place, facts = log_folder(folder, name), beginning.facts
    record.log.meta["simulated"][RUN_ID] = facts[RUN_ID]
    write_log(place, record, settings)
    remarks = missed(record) + find_unused(settings, beginning.overrides) + find_left_out(settings)
    views = views_of(record, settings)
    report = write_report(place, record, settings, views, facts, run=folder)
    try:
        write_plots(place, views)
    except MissingExtra as missing:
        remarks.append(f"No pictures: {' '.join(str(missing).split())}")
    return [f"{key_of(name)}: {r}" if key_of(name) else r for r in remarks], report


def _verdict(folder: Path, original: Path, robots: Iterable[str]) -> list[str]:
    """Print whether a repeated run is identical to the original."""
    places = [(log_folder(folder, name), log_folder(original, name)) for name in robots]
    found = [column for new, old in places for column in differences(new, old)]
    if not found:
        return [f"The log and the ledger are those of {original}, bit for bit."]
    causes = version_changes(original)
    because = f" Versions differ: {', '.join(causes)}." if causes else ""
    return [f"Differs from {original} in {', '.join(found[:6])}.{because}"]


def _say(record: Record, settings: RunSettings, remarks: list[str], reports: list[Path]) -> None:
    """Print a summary of the run; the last lines give the paths of the reports."""
    end = float(record.log.time[-1])
    verb = {
        Ending.done: "simulated",
        Ending.interrupted: "interrupted at",
        Ending.failed: "failed at",
    }
    times = end / max(record.seconds, 1e-9)
    print(
        f"{settings.name}: {verb[record.ending]} {end:.4g} s in {record.seconds:.2f} s "
        f"({record.steps:,} steps, {times:.3g} times real time)"
    )
    for remark in remarks:
        print(remark)
    for report in reports:
        print(f"report: {short_path(report)}")
