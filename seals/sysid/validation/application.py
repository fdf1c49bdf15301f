"""Execution of ``seals add`` and ``seals verify``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.compose import output_folder
from seals.config.overlay import Overlay, find_overlay, load_overlay, overlay_names, read_overlay
from seals.config.overrides import typed
from seals.errors import ConfigError, MissingExtra, SealsError, printable, refuse_absent, suggestion
from seals.field_roles import Role, roles_of
from seals.file_names import refuse_taken
from seals.logs.atomic import atomic_path, write_json
from seals.logs.log import Log
from seals.report.style import CYCLE, MUTED
from seals.run.progress import progress
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.data.robot_description import name_in
from seals.sysid.data.supply import supply_words
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.report.given_logs import GivenLogs, given_logs, make_folder, robot_name, sources
from seals.sysid.validation.ablation import (
    Ablation,
    compare_ends,
    numbers_in_question,
    replay_count,
    replay_variants,
)
from seals.sysid.validation.answer import logs_of, noted_logs, read_answer
from seals.sysid.validation.drawing import canvas, draw_ablation, print_table
from seals.sysid.validation.verification import Verification, judge, sentences
from seals.sysid.validation.writing import overlay_of, timed_words, withdraw, write_overlay

RESULT, PICTURE, ACCELERATION = "verify.json", "ladder.png", "acceleration.png"


def add(config: Any) -> int:
    """Write the overlay of a diagnosis and return the exit code.

    Raises:
        ConfigError: something is missing, or the diagnosis gives nothing to add.
        LogError: the diagnosed log cannot be used.
    """
    refuse_absent(config.diagnosis, "diagnosis", "seals add diagnosis=FOLDER name=MY_MODEL")
    target = _target(config)
    robot = f" {typed('robot', robot_name(config))}" if config.robot.folder else ""
    finding = read_answer(
        str(config.diagnosis), choose=config.choose, accept=config.accept, robot=robot
    )
    answer, logs = finding.answer, finding.answer.tables
    if config.log is None and not logs:
        raise ConfigError(f"{finding.file} does not name its log.\nGive it: log=FOLDER")
    given = given_logs(config, config.log or noted_logs(logs), noted=answer.without)
    if list(given.without) != list(answer.without):
        raise ConfigError(
            f"{typed('without', given.without)}: the diagnosis left out {list(answer.without)}.\n"
            "Leave without= out, or diagnose the log again with it."
        )
    source = sources(given.places)
    _refuse_other_logs(logs, logs_of({"log": source}))
    content = overlay_of(finding, _base(config.base), source=source)
    overlay = read_overlay({"name": target.stem, "file": str(target), **content})
    parts: list[Any] = [*overlay.effects.values(), *filter(None, [overlay.waves])]
    for part in parts:
        kind: Any = type(part)
        for name, role in roles_of(kind).items():
            if role is not Role.data and getattr(part, name) != getattr(kind(), name):
                raise ConfigError(
                    f"the diagnosis sets {name} of {kind.__name__}, which is not data.\n"
                    "Diagnose the log again; answers set only data."
                )
    option = target.stem if target.parent == Path("models") else str(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_overlay(
        target, option, content, robot=robot or " robot=MY_ROBOT", given=given.robot_words
    )
    print(f"{content['summary']}: written to {target}")
    for effect in finding.effects:
        if effect.active:
            print(
                f"{effect.name} acts {timed_words(effect)} of the log; in the model it acts at "
                "all times. Leave the effect out of runs before it begins or after it ends."
            )
    if finding.chosen:
        print("The log cannot distinguish this effect from others: it was chosen by the user.")
    if finding.formula is not None:
        print(f"A force without a name, accepted by the user: {finding.formula.text}")
    command = f"seals verify log=ANOTHER_LOG {typed('model', option)}{given.robot_words}"
    print(f"Next, on a log that was not fitted:\n  {command}")
    return 0


def _refuse_other_logs(diagnosed: Mapping[str, str], given: Mapping[str, str]) -> None:
    """Refuse logs whose contents are not those that were diagnosed.

    Args:
        diagnosed: paths with the SHA-256 of each table; empty if it is not known.
        given: likewise.

    Raises:
        ConfigError: it says which log differs.
    """
    if len(given) != len(diagnosed) and diagnosed:
        raise ConfigError(
            f"log={','.join(given)}: {len(diagnosed)} logs were diagnosed, {len(given)} given.\n"
            f"Give the diagnosed logs: {typed('log', list(diagnosed))}; or diagnose the given ones."
        )
    known = [digest for digest in diagnosed.values() if digest]
    for place, digest in given.items():
        if len(known) == len(diagnosed) > 0 and digest not in known:
            raise ConfigError(
                f"log={place} is not the log that was diagnosed: its content differs.\n"
                "Give the diagnosed log, or diagnose this one."
            )


def verify(config: Any) -> int:
    """Verify a model: replay a log in the simulator with every variant; return the exit code.

    Raises:
        ConfigError: something is missing, or the model does not fit the log.
        LogError: a log cannot be used.
    """
    from omegaconf import OmegaConf

    refuse_absent(config.log, "log", "seals verify log=FOLDER model=MY_MODEL")
    if config.model is None:
        names = overlay_names()
        first = "Write one from a diagnosis: seals add diagnosis=FOLDER name=NAME"
        hint = suggestion("", names, label="In models/") if names else first
        raise ConfigError(f"model is not given.\n{hint}")
    raw: Any = OmegaConf.to_container(config.model)
    overlay = read_overlay(raw)
    overlay.refuse_withdrawn(force=bool(config.force))
    if not overlay.parts:
        raise ConfigError(
            f"model '{overlay.name}' adds no effect.\nGive it one under effects, or add one again."
        )
    noted = overlay.provenance.get("without")
    noted = [name for name in noted if isinstance(name, str)] if isinstance(noted, list) else []
    places = [given_logs(config, noted=noted)]
    places += [given_logs(config, [old], key="older", noted=noted) for old in config.older]
    problems: dict[str, Problem] = {}
    logs: list[Log] = []
    for given in places:
        log, robot = given.read()
        own = overlay.provenance.get("vehicle")
        other = name_in(log.meta)
        if own and other and own != other:
            raise ConfigError(
                f"model '{overlay.name}' was found on the vehicle '{own}', log '{log.name}' is of "
                f"'{other}'.\nGive a log of the same vehicle."
            )
        logs.append(log)
        name = given.places[0].name if len(given.places) == 1 else log.name
        with trials():
            problems[name] = prepare(log, robot=robot)
    known = overlay.provenance.get("log_sha256")
    known = known if isinstance(known, list) else [known]
    digests = logs_of({"log": sources(places[0].places)}).values()
    found = verified(overlay, problems, fitted=any(d in known for d in digests if d))
    out = output_folder(config.out)
    _write(out, found, logs[0])
    print_table(found)
    print("\n".join(sentences(found)))
    for name, problem in problems.items():
        samples = problem.samples
        words = supply_words(samples.command, problem.vehicle) if samples.voltage is None else ""
        if words:
            print(f"{name}: {words}")
    if found.withdrawn and _lies_in(overlay.file, raw):
        withdraw(Path(overlay.file), found.withdrawn)
        print(f"{overlay.file}: marked as withdrawn.")
    print(_commands(found, places[0], next(iter(problems.values()))), end="")
    print(f"\n{out / RESULT}")
    return found.exit_code


def _commands(found: Verification, given: GivenLogs, problem: Problem) -> str:
    """Return what would settle more, as commands."""
    known = {c.name for c in problem.plant.candidate_set.candidates}
    effects = [n for n in found.overlay.provenance.get("confidence") or {} if n in known]
    numbers = numbers_in_question(problem, found.overlay, effects, given.robot)
    words = f"{given.log_words}{given.robot_words}"
    out = ""
    vehicle = problem.vehicle
    # a body that is thrown through the air has no manoeuvre
    if effects and (len(vehicle.lag) or vehicle.has_water):
        command = f"seals plan {typed('effects', effects)} {words}"
        out += f"The flight that shows {' and '.join(effects)} best:\n  {command}\n"
    if numbers:
        command = f"seals calibrate {words} {typed('parameters', numbers)}"
        out += f"To calibrate the stated numbers that it changes or resembles:\n  {command}\n"
    return out


def _lies_in(file: str, model: Mapping[str, Any]) -> bool:
    """Return true where a file holds a model; a configuration may claim any other file."""
    try:
        return bool(file) and load_overlay(Path(file)) == dict(model)
    except SealsError:
        return False


@trials()
def verified(overlay: Overlay, problems: Mapping[str, Problem], *, fitted: bool) -> Verification:
    """Verify a model on one log by all variants, on older logs by first and last variant.

    Args:
        overlay: the model.
        problems: logs made ready, by name: the first is replayed on all variants.
        fitted: whether the model was fitted on the first.

    Raises:
        LogError: no error can be computed.
    """
    (first, problem), *rest = problems.items()
    ablation = _with_bar(first, problem, overlay, whole=True)
    older = [_with_bar(name, other, overlay, whole=False) for name, other in rest]
    for one in (ablation, *older):
        refuse_undefined("error", [one.first.level, one.last.level])
    return judge(overlay, ablation, older, fitted=fitted)


def _with_bar(name: str, problem: Problem, overlay: Overlay, *, whole: bool) -> Ablation:
    count = problem.fitter.windows.count
    replays = replay_count(overlay) if whole else 2 + bool(overlay.nominal)
    with progress(f"replaying {name}", count * replays) as tell:
        return (replay_variants if whole else compare_ends)(name, problem, overlay, tell=tell)


def _target(config: Any) -> Path:
    name = str(config.name)
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]*", name):
        shown = f"name={name} cannot name a model" if name else "name is not given"
        raise ConfigError(
            f"{shown}.\nAllowed: letters, digits, '_', '-' and '.', for instance name=my_model"
        )
    target = Path(str(config.folder)) / f"{name}.yaml"
    refuse_taken(target, replace=config.replace)
    return target


def _base(name: str | None) -> dict[str, Any]:
    if name is None:
        return {}
    path = find_overlay(str(name))
    if path is None:
        raise ConfigError(
            f"base={name}: there is no such model.\n"
            f"{suggestion(str(name), overlay_names(), label='In models/')}"
        )
    raw = load_overlay(path)
    read_overlay(raw).refuse_withdrawn(force=False)
    return raw


def _write(out: Path, found: Verification, log: Log) -> None:
    make_folder(out)
    write_json(out / RESULT, found.to_dict())
    try:
        draw_ablation(out / PICTURE, found)
        felt = acceleration_of(found, log)
        if felt is not None:
            draw_acceleration(out / ACCELERATION, felt, found)
    except MissingExtra as missing:
        print(f"No picture: {' '.join(str(missing).split())}")


COLOURS = CYCLE[1], CYCLE[0]
"""Colours of the model before and after."""


@dataclass(frozen=True, kw_only=True)
class AccelerationTrack:
    """Specific force of a log along one axis of the inertial sensor, measured and simulated.

    Args:
        axis: x, y or z: the one with the largest residual of the first variant.
        time: of the rows that the windows share [s], shape (W, K).
        measured: [m/s^2], shape (W, K); NaN for no sample.
        simulated: of the first and the last variant [m/s^2], each (W, K).
    """

    axis: str
    time: Floats
    measured: Floats
    simulated: tuple[Floats, Floats]

    @property
    def levels(self) -> tuple[float, float]:
        """Root mean square residual before and after [m/s^2]."""
        before, after = (
            float(np.sqrt(np.nanmean((self.measured - s) ** 2))) for s in self.simulated
        )
        return before, after


def acceleration_of(found: Verification, log: Log) -> AccelerationTrack | None:
    """Compare the accelerometer of a log with its replays; None without readings.

    Args:
        found: with the replays of the first and the last variant.
        log: that was replayed.
    """
    if not log.has("specific_force"):
        return None
    parts = log.segments()
    rows = found.ablation.first.track.rows
    seen = np.concatenate([p.channel("specific_force") for p in parts])[rows]
    before, after = (
        m.track.reading[:, :, 3:6] for m in (found.ablation.first, found.ablation.last)
    )
    given = np.isfinite(seen)
    if not given.all(axis=2).any():
        return None
    left = np.nansum((seen - before) ** 2, axis=(0, 1))
    k = int(np.argmax(left))
    return AccelerationTrack(
        axis="xyz"[k],
        time=np.concatenate([p.time for p in parts])[rows],
        measured=seen[:, :, k],
        simulated=(before[:, :, k], after[:, :, k]),
    )


def draw_acceleration(path: Path, track: AccelerationTrack, found: Verification) -> None:
    """Draw measured and simulated acceleration before and after, the residuals below.

    Raises:
        MissingExtra: there is no matplotlib.
    """
    figure = canvas((9.0, 6.4))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    added = " and ".join(printable(part).replace("_", " ") for part in found.overlay.parts)
    names = f"stated model: {track.levels[0]:.2g}", f"with {added}: {track.levels[1]:.2g}"
    upper.plot(*_line(track.time, track.measured), color=MUTED, linewidth=2.4, label="measured")
    for simulated, colour, name in zip(track.simulated, COLOURS, names, strict=True):
        label = f"{name} m/s² left"
        upper.plot(*_line(track.time, simulated), color=colour, linewidth=1.1, label=label)
        residual = track.measured - simulated
        lower.plot(*_line(track.time, residual), color=colour, linewidth=1.1)
    upper.set_ylabel(f"specific force {track.axis} [m/s²]")
    lower.set_ylabel("measured less\nsimulated [m/s²]")
    lower.set_xlabel("time [s]")
    lower.axhline(0.0, color=MUTED, linewidth=0.8)
    upper.legend(loc="best", frameon=False, fontsize=9)
    upper.set_title(printable(f"{found.overlay.name} on {found.ablation.name}"), fontsize=11)
    for axes in (upper, lower):
        axes.spines[["top", "right"]].set_visible(False)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=130, format="png")


def _line(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Windows as one line with a gap between them; rows without a sample are left out."""
    gap = np.full((len(x), 1), np.nan)
    time, value = (np.concatenate([a, gap], axis=1).ravel() for a in (x, y))
    given = np.isfinite(value) | ~np.isfinite(time)
    return time[given], value[given]
