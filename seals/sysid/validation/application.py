"""Execution of ``seals add`` and ``seals verify``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.config.overlay import Overlay, find_overlay, load_overlay, overlay_names, read_overlay
from seals.errors import ConfigError, MissingExtra, SealsError, suggestion
from seals.logs.atomic import write_json
from seals.logs.log import Log
from seals.run.progress import progress
from seals.sysid.data.robot_description import RobotDescription, describe_run, described
from seals.sysid.data.supply import supply_words
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.report.given_logs import read_log
from seals.sysid.validation.ablation import Ablation, compare_ends, replay_count, replay_variants
from seals.sysid.validation.acceleration import acceleration_of, draw_acceleration
from seals.sysid.validation.answer import log_digest, read_answer
from seals.sysid.validation.drawing import draw_ablation, print_table
from seals.sysid.validation.refit import refit
from seals.sysid.validation.verification import Verification, judge, sentences
from seals.sysid.validation.writing import overlay_of, timed_words, withdraw, write_overlay

RESULT, PICTURE, ACCELERATION = "verify.json", "ladder.png", "acceleration.png"


def add(config: Any) -> int:
    """Write the overlay of a diagnosis and return the exit code.

    Raises:
        ConfigError: something is missing, or the diagnosis gives nothing to add.
        LogError: the diagnosed log cannot be used.
    """
    if config.diagnosis is None:
        raise ConfigError(
            "diagnosis is not given.\nSay which: seals add diagnosis=FOLDER name=MY_MODEL"
        )
    target = _target(config)
    finding = read_answer(str(config.diagnosis), choose=config.choose, accept=config.accept)
    place = str(config.log or finding.log)
    if not place:
        raise ConfigError(f"{finding.file} does not say which log it is of.\nGive it: log=FOLDER")
    log, digest = _read(config, place, "log"), log_digest(place)
    if finding.sha256 and finding.sha256 != digest:
        raise ConfigError(
            f"log={place} is not the log that was diagnosed: its content differs.\n"
            "Give the very log, or diagnose this one."
        )
    base = _base(config.base)
    found = refit(log, finding, robot=_robot(config, place))
    content = overlay_of(finding, found, base, log=str(Path(place).resolve()), sha256=digest)
    content["provenance"]["vehicle"] = str((log.meta.get("vehicle") or {}).get("name", ""))
    read_overlay({"name": target.stem, "file": str(target), **content})
    target.parent.mkdir(parents=True, exist_ok=True)
    write_overlay(target, target.stem, content)
    print(f"{content['summary']}: written to {target}")
    for effect in finding.effects:
        if "active" in effect:
            print(
                f"{effect['name']} acts {timed_words(effect)} of the log; in the model it acts "
                "throughout. Leave the effect out of runs before it begins or after it ends."
            )
    if finding.chosen:
        print("The log cannot tell this effect from others: it was chosen by you.")
    if finding.formula is not None:
        print(f"An unnamed force, accepted by you: {finding.formula['text']}")
    option = target.stem if target.parent == Path("models") else target
    print(f"Next, on a log that was not fitted: seals verify log=FOLDER model={option}")
    return 0


def verify(config: Any) -> int:
    """Verify a model: replay a log in the simulator with every variant; return the exit code.

    Raises:
        ConfigError: something is missing, or the model does not fit the log.
        LogError: a log cannot be used.
    """
    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf

    if config.log is None:
        raise ConfigError("log is not given.\nSay which: seals verify log=FOLDER model=MY_MODEL")
    if config.model is None:
        names = overlay_names()
        raise ConfigError(f"model is not given.\n{suggestion('', names, label='In models/')}")
    raw: Any = OmegaConf.to_container(config.model)
    overlay = read_overlay(raw)
    overlay.refuse_withdrawn(force=bool(config.force))
    if not overlay.parts:
        raise ConfigError(
            f"model '{overlay.name}' adds no effect.\nGive it one under effects, or add one anew."
        )
    logs = {p: _read(config, p, k) for p, k in _places(config)}
    for log in logs.values():
        _same_vehicle(overlay, log)
    problems = {p: prepare(log, robot=_robot(config, p)) for p, log in logs.items()}
    found = verified(overlay, problems, str(config.log))
    out = Path(config.out or HydraConfig.get().runtime.output_dir)
    _write(out, found, logs[str(config.log)])
    print_table(found)
    print("\n".join(sentences(found)))
    _tell_supply(problems)
    if found.withdrawn and _lies_in(overlay.file, raw):
        withdraw(Path(overlay.file), found.withdrawn)
        print(f"{overlay.file}: marked as withdrawn.")
    print(f"\n{out / RESULT}")
    return found.exit_code


def _tell_supply(problems: Mapping[str, Problem]) -> None:
    """Print which logs do not tell the voltage that limits their drives."""
    for place, problem in problems.items():
        samples = problem.samples
        words = supply_words(samples.command, problem.vehicle) if samples.voltage is None else ""
        if words:
            print(f"{Path(place).name}: {words}")


def _lies_in(file: str, model: Mapping[str, Any]) -> bool:
    """Return true where a file holds a model; a configuration may claim any other file."""
    try:
        return bool(file) and load_overlay(Path(file)) == dict(model)
    except SealsError:
        return False


def verified(overlay: Overlay, problems: Mapping[str, Problem], first: str) -> Verification:
    """Verify a model on one log by all variants, on older logs by first and last variant.

    Args:
        overlay: the model.
        problems: logs made ready, by folder.
        first: folder of the log on which all variants are replayed; the others are older ones.
    """
    fitted = log_digest(first) == overlay.provenance.get("log_sha256")
    ablation = _with_bar(first, problems[first], overlay, whole=True)
    older = [
        _with_bar(place, problem, overlay, whole=False)
        for place, problem in problems.items()
        if place != first
    ]
    return judge(overlay, ablation, older, fitted=fitted)


def _with_bar(place: str, problem: Problem, overlay: Overlay, *, whole: bool) -> Ablation:
    name, count = Path(place).name, problem.fitter.windows.count
    replays = replay_count(overlay) if whole else 2 + bool(overlay.nominal)
    with progress(f"replaying {name}", count * replays) as tell:
        return (replay_variants if whole else compare_ends)(name, problem, overlay, tell=tell)


def _places(config: Any) -> list[tuple[str, str]]:
    """Paths of all logs, and the keys of the configuration that name them."""
    return [(str(config.log), "log"), *((str(p), "older") for p in config.older)]


def _robot(config: Any, place: str) -> RobotDescription | None:
    """Return the given robot, else that of a simulated run, else None for a vehicle by log."""
    return described(config) or describe_run(Path(place))


def _read(config: Any, place: str, key: str) -> Log:
    if not Path(place).exists():
        raise ConfigError(f"{key}={place}: there is no such file or folder.\nGive a log folder.")
    return read_log(config, Path(place))


def _same_vehicle(overlay: Overlay, log: Log) -> None:
    """Refuse a log of another vehicle."""
    own, other = overlay.provenance.get("vehicle"), (log.meta.get("vehicle") or {}).get("name")
    if own and other and own != other:
        raise ConfigError(
            f"model '{overlay.name}' was found on the vehicle '{own}', log '{log.name}' is of "
            f"'{other}'.\nGive a log of the same vehicle."
        )


def _target(config: Any) -> Path:
    name = str(config.name)
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]*", name):
        shown = f"name={name} cannot name a model" if name else "name is not given"
        raise ConfigError(
            f"{shown}.\nAllowed: letters, digits, '_', '-' and '.', for instance name=my_model"
        )
    target = Path(str(config.folder)) / f"{name}.yaml"
    if target.exists() and not config.replace:
        raise ConfigError(
            f"{target} exists already.\nTake another name, or write over it with replace=true"
        )
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
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"out={out} is not a folder: {error}.\nGive another folder.") from error
    write_json(out / RESULT, found.to_dict())
    try:
        draw_ablation(out / PICTURE, found)
        felt = acceleration_of(found, log)
        if felt is not None:
            draw_acceleration(out / ACCELERATION, felt, found)
    except MissingExtra as missing:
        print(f"No picture: {' '.join(str(missing).split())}")
