"""Report of one run: configuration, motion, loads, and how to repeat it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np

from seals.config.overrides import typed
from seals.config.plugin_lookup import plugin_name
from seals.file_names import REPORT
from seals.report import Block, Code, Facts, Fold, Paragraph, Section, Table, write_page
from seals.report.pictures import write_picture
from seals.report.style import unit_text
from seals.run.goals import goal_blocks
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record
from seals.run.views import Views, first_touch
from seals.schema import parameters_of, vector_groups

_FILES = (
    ("log.parquet, meta.yaml", "motion and readings, in the format of a measured log"),
    ("ledger.parquet", "force and torque of every effect on every link at every step"),
    ("fluid.parquet", "particles, compression, momentum balance and gauges, with a fluid"),
    ("surface/", "meshes of the water surface, with surface=SECONDS"),
    ("particles/", "a subset of the particles, with particles=SECONDS"),
    ("checkpoint/", "the last state of an interrupted run, for resume=FOLDER"),
    ("robot/robot.yaml", "the robot as simulated"),
    ("run.json", "versions, seed, revision, time"),
    (".hydra/", "the configuration, resolved"),
    ("plots/", "the charts as pictures"),
)


def write_report(
    folder: Path,
    record: Record,
    settings: RunSettings,
    views: Views,
    facts: dict[str, Any],
    *,
    run: Path,
) -> Path:
    """Write ``report.html`` of a robot into the folder of its log.

    Args:
        folder: of the log.
        record: of the robot.
        settings: of the run, as the robot has them.
        views: charts.
        facts: noted when the run began.
        run: folder of the run.
    """
    aims = goal_blocks(record)
    sections = [
        Section(title="Summary", blocks=_overview(record, settings)),
        *([Section(title="Wanted and achieved", blocks=aims)] if aims else []),
        Section(title="Motion", blocks=[*views.motion, *views.joints]),
        _load_section(record, views, settings),
        Section(title="Inertial sensor", blocks=list(views.imu)),
        Section(title="Configuration", blocks=_settings(record, settings), wide=True),
        Section(title="Repeat the run", blocks=_again(run, facts), wide=True),
    ]
    subtitle = (
        f"{settings.robot.name}: {settings.robot.summary}"
        if settings.robot.summary
        else settings.robot.name
    )
    return write_page(
        folder / REPORT,
        settings.name,
        sections,
        subtitle=f"{subtitle}. {facts['started'][:16].replace('T', ' ')}",
        badge=record.ending.value,
    )


def write_plots(folder: Path, views: Views) -> list[Path]:
    """Write the charts as pictures below ``plots``.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    loads = [chart for chart in views.loads if chart.title.startswith("Force")]
    subjects = {"motion": views.motion, "loads": loads, "imu": views.imu, "joints": views.joints}
    return [
        write_picture(folder / "plots" / f"{name}.png", charts)
        for name, charts in subjects.items()
        if charts
    ]


def _overview(record: Record, settings: RunSettings) -> list[Block]:
    blocks: list[Block] = []
    if record.ending is Ending.failed:
        blocks.append(Paragraph(text=f"The run failed: {record.error}", tone="bad"))
    elif record.ending is Ending.interrupted:
        blocks.append(
            Paragraph(
                text="The run was interrupted; the report covers the part before.", tone="warn"
            )
        )
    return [*blocks, Facts(values=_key_figures(record, settings)), *_clipped(record, settings)]


def _clipped(record: Record, settings: RunSettings) -> list[Block]:
    """Return a remark on sensors that reached the end of their range."""
    fields = {"specific_force": "accelerometer_range", "angular_velocity": "gyroscope_range"}
    found: list[Block] = []
    for stem, field in fields.items():
        source = record.log.meta["sensors"]["channels"].get(stem, {}).get("sensor")
        end = getattr(settings.sensors.get(source), field, None)
        if end and np.nanmax(np.abs(record.log.channel(stem)), initial=0.0) >= 0.999 * end:
            words = f"saturated in {stem} ({end:g})"
            text = f"Sensor '{source}' {words}: its peaks are clipped."
            found.append(Paragraph(text=text, tone="warn"))
    return found


def _key_figures(record: Record, settings: RunSettings) -> dict[str, str]:
    """Return the key figures of a run."""
    log = record.log
    end, touch = float(log.time[-1]), first_touch(record, settings)
    height = log.channel("position")[:, 2]
    speed = np.linalg.norm(log.channel("velocity"), axis=1)
    felt = np.linalg.norm(log.channel("specific_force"), axis=1)
    figures = {"simulated": f"{end:.4g} s"}
    if touch is not None:
        figures["touches water at"] = f"{touch:.3f} s" if touch > 0.0 else "the start"
    if settings.environment.water_level is not None:
        deepest = settings.environment.water_level - float(np.nanmin(height))
        figures["maximum depth of the origin"] = (
            f"{deepest:.3f} m" if deepest > 0.0 else "stays above"
        )
    figures["greatest speed"] = f"{np.nanmax(speed):.3g} m/s"
    if np.isfinite(felt).any():
        figures["greatest specific force"] = f"{np.nanmax(felt):.3g} m/s²"
    figures["height at the end"] = f"{height[-1]:.3f} m"
    figures["wall time"] = f"{record.seconds:.3g} s"
    figures["pace"] = f"{end / max(record.seconds, 1e-9):.3g} × real time"
    return figures


def _load_section(record: Record, views: Views, settings: RunSettings) -> Section:
    blocks: list[Block] = list(views.loads)
    for name, charts in views.further_loads.items():
        blocks.append(Fold(title=f"Loads on {name}", blocks=charts))
    if not blocks:
        blocks = [Paragraph(text="No effect acted on the robot.")]
    silent = [name for name in settings.effects if name not in record.ledger.effects]
    more = (
        f" These effects are not forces and are not shown: {', '.join(silent)}." if silent else ""
    )
    return Section(
        title="Forces",
        lead="Contributions of the effects, stacked, about the origin of the link in link axes; "
        "the line is their sum. Contact forces are computed by the rigid-body engine and are "
        "not included."
        f"{more}",
        blocks=blocks,
        wide=len(views.loads) == 1,
    )


def _settings(record: Record, settings: RunSettings) -> list[Block]:
    rows = [
        (name, plugin_name("effect", type(effect)), _values(effect), ", ".join(effect.links))
        for name, effect in settings.effects.items()
    ]
    e = settings.environment
    environment = {
        key: (f"{getattr(e, key):.6g}", unit_text(meta.unit))
        for key, meta in parameters_of(e).items()
        if getattr(e, key) is not None
    }
    robot = record.robot
    links = [
        (name, f"{robot.mass[k]:.6g}", "-" if hull is None else f"{hull.volume * 1e3:.5g}")
        for k, (name, hull) in enumerate(zip(robot.links, robot.hulls, strict=True))
    ]
    return [
        Table(head=("name", "effect", "parameters other than zero", "links"), rows=rows),
        Fold(
            title="Robot, environment and time",
            blocks=[
                Table(head=("link", "mass [kg]", "hull [litre]"), rows=links, right=(1, 2)),
                Table(
                    head=("environment", "value", "unit"),
                    rows=[(key, *values) for key, values in environment.items()],
                    right=(1,),
                ),
                Paragraph(
                    text=f"{record.steps:,} steps of {settings.time.step:g} s, "
                    f"seed {settings.seed}, {record.rate:,.0f} steps a second."
                ),
            ],
        ),
    ]


def _values(plugin: Any) -> str:
    """Parameters of a plug-in in one line, vectors joined, zeros left out."""
    known = parameters_of(plugin)
    groups = {members[0]: (stem, members) for stem, members in vector_groups(known).items()}
    inside = {name for _, members in groups.values() for name in members[1:]}
    words = []
    for name, meta in known.items():
        stem, members = groups.get(name, (name, (name,)))
        numbers = [float(getattr(plugin, member)) for member in members]
        if name in inside or not any(numbers):
            continue
        shown = ", ".join(f"{number:.6g}" for number in numbers)
        value = f"({shown})" if len(numbers) > 1 else shown
        words.append(f"{stem} {value} {unit_text(meta.unit)}".strip())
    return "; ".join(words) or "-"


def _again(folder: Path, facts: dict[str, Any]) -> list[Block]:
    versions = ", ".join(f"{name} {number}" for name, number in facts["versions"].items())
    given = shlex.join(facts["overrides"])
    return [
        Code(text=f"seals run {typed('repeat', str(folder))}\n# was: seals run {given}"),
        Table(head=("file", "what it holds"), rows=list(_FILES)),
        Paragraph(text=f"{versions}; revision {facts['git'] or 'unknown'}; {facts['machine']}."),
    ]
