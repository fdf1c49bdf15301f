"""``seals convert``: conversion of a foreign log to a SEALS log folder."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.config.overrides import typed
from seals.errors import ConfigError, LogError, SealsError, refuse_absent
from seals.file_names import refuse_taken
from seals.logs.axes import with_axes
from seals.logs.check import check_log
from seals.logs.false_readings import without_false_readings
from seals.logs.finding import Severity, lines_of
from seals.logs.log import Log
from seals.logs.motor_curve import motor_curve, with_rotor_speeds, with_thruster_forces
from seals.logs.native import TABLES, write_native
from seals.logs.reader import foreign_reader_of, logs_by
from seals.logs.resample import even_rows
from seals.logs.shipped import find_log
from seals.schema import read
from seals.untrusted_io import read_bytes, read_json, read_yaml

_QUOTES = "'\""
_HEAD = ("format", "format_version")
_MOST_URDF = 1 << 24
_MOST_FINDINGS = 12


def convert(arguments: list[str]) -> int:
    """Convert a log; the reader is chosen by the content unless it is named."""
    from seals.cli.hydra_app import Application, launch

    words = list(arguments)
    given = dict(word.partition("=")[::2] for word in words if not word.startswith("-"))
    if len(given) == len(words) and "experiment" not in given:
        bare = next((word for word in words if "=" not in word), "FILE")
        refuse_absent(given.get("log") or None, "log", f"seals convert log={bare} out=FOLDER")
        named = read_yaml(given["map"]).get("reader") if given.get("map") else None
        if named is not None and given.get("reader", named) != named:
            raise ConfigError(f"map={given['map']} is for reader={named}.\nLeave reader= out.")
        if "reader" not in given:
            words.append(f"reader={named or _reader_of(find_log(given['log'].strip(_QUOTES)))}")
    return launch("convert", words, Application("seals.cli.convert", folder=False))


def _reader_of(place: Path) -> str:
    """Return the reader chosen by the content of the file or folder."""
    found = foreign_reader_of(place)
    if found is not None:
        return found
    if place.is_dir() and (place / "meta.yaml").is_file():
        line, robot = f"seals diagnose {typed('log', str(place))}", _robot_of_run(place)
        own = f"; or, with the robot as its folder states it: {line} {typed('robot', robot)}"
        raise ConfigError(
            f"log={place} is already a log folder; there is nothing to convert.\n"
            f"Use it as it is: {line} out=answer{own + ' out=answer' if robot else ''}; "
            "or give reader=native"
        )
    if place.is_dir() and not any(place.iterdir()):
        raise ConfigError(f"log={place} is an empty folder.\nGive the file or folder of a log.")
    raise ConfigError(
        f"log={place}: its content does not show which reader to use.\n"
        "Name the reader: reader=csv, reader=witmotion ... See: seals list reader"
    )


def _robot_of_run(place: Path) -> str:
    """Return the value of ``robot=`` for the robot of a run folder; empty if it is not there."""
    from seals.config.source import is_robot_folder
    from seals.sysid.report.given_logs import robot_word

    path = place / "run.json"
    try:
        run = read_json(path) if path.is_file() else None
    except LogError:
        # the run of another program, or a damaged one: its robot is not known
        return ""
    stated = run.get("robot") if isinstance(run, Mapping) else None
    if not isinstance(stated, Mapping):
        return ""
    name, folder = (str(stated.get(key) or "") for key in ("name", "folder"))
    return robot_word(name, Path(folder)) if is_robot_folder(folder) else ""


def execute(config: Any) -> int:
    """Run one composed conversion and return its exit code.

    Raises:
        ConfigError: a setting is missing or wrong.
        LogError: the log cannot be used.
    """
    from seals.config.build import build

    for key, value in (("log", config.log), ("out", config.out)):
        refuse_absent(value or None, key, "seals convert log=FILE out=FOLDER")
    out = Path(str(config.out))
    refuse_taken(out, key="out", replace=config.replace)
    # anything but a log folder is kept
    marks = (out / name for name in (*TABLES, "meta.yaml"))
    if out.exists() and not (out.is_dir() and any(mark.is_file() for mark in marks)):
        raise ConfigError(
            f"out={out} is not a log folder, so it is not overwritten.\nChoose another name."
        )
    reader = build(_with_map(config), where="reader")
    given = read_yaml(config.meta) if config.meta else {}
    meta = {key: value for key, value in given.items() if key not in _HEAD}
    urdf = None
    if config.urdf:
        try:
            urdf = read_bytes(config.urdf, most=_MOST_URDF).decode("utf-8")
        except UnicodeDecodeError as error:
            raise ConfigError(f"urdf={config.urdf} is not UTF-8 text ({error.reason}).") from error
    logs = logs_by(reader, str(find_log(config.log)))
    sheet, vehicle = _robot(config)
    for log in logs:
        place = out if len(logs) == 1 else out / re.sub(r"[^\w.+-]", "_", log.name).lstrip(".")
        known = sheet | _of_log(log.meta, vehicle) | meta
        whole, said = adapted(replace(log, meta=known), config, vehicle)
        for words in said:
            print(f"recognised: {words}")
        # print the findings of the log check; refuse a log that no verb can use
        found = check_log(whole, vehicle)
        grave = [finding for finding in found if finding.severity is Severity.REFUSE]
        if grave:
            words = grave[0].message.rstrip(".")
            join = ", or correct" if "\n" in words else "\nCorrect"
            raise SealsError(
                f"log '{whole.name}' cannot be used: {grave[0].channel or 'all'}: {words}"
                f"{join} this column in the file or in the map: seals help convert"
            )
        for line in lines_of(found)[:_MOST_FINDINGS]:
            print(line)
        write_native(whole, place, urdf=urdf, table=str(config.table), replace=config.replace)
        print(f"{place}: {whole.rows} rows, {', '.join(whole.channels())}")
        if len(logs) == 1:
            print(_next(config, whole, place), end="")
    return 0


def _next(config: Any, log: Log, place: Path) -> str:
    """Return the command that takes a converted log, or what the log lacks for one."""
    from seals.config.source import robot_names
    from seals.run.equipment_metadata import DATASHEET
    from seals.sysid.report.given_logs import robot_name, without_start

    words = typed("log", str(place))
    if not config.robot.folder:
        stated = log.meta.get("vehicle")
        if not isinstance(stated, Mapping) or "inertia" not in stated:
            return "Next: the same command with robot=NAME or robot=FOLDER and replace=true\n"
    elif lacking := without_start(log):
        return f"{lacking}\n"
    else:
        robot = robot_name(config)
        if robot not in robot_names() and not (Path(config.robot.folder) / DATASHEET).is_file():
            sheet = shlex.join([f"log={place}", f"robot={robot}"])
            return f"Next:\n  seals new datasheet {sheet}\n"
        words += f" {typed('robot', robot)}"
    return f"Next:\n  seals diagnose {words} out=answer\n"


def _with_map(config: Any) -> Any:
    """Return the node of the reader, with the fields that the map file states."""
    from omegaconf import OmegaConf, open_dict

    from seals.config.refusal import refusals
    from seals.untrusted_io import refuse_references

    if not config.map:
        return config.reader
    fields = read_yaml(config.map)
    fields.pop("reader", None)
    if "_target_" in fields:
        raise ConfigError(
            f"map={config.map} states _target_.\nA map contains fields of the reader."
        )
    refuse_references(fields, where=f"map={config.map}")
    with refusals([f"map={config.map}"]), open_dict(config):
        for key, value in fields.items():
            OmegaConf.update(config.reader, str(key), value, merge=True)
    return config.reader


def _robot(config: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the data sheet in a robot's folder, and the vehicle that the folder describes."""
    from seals.run.equipment_metadata import datasheet_of, vehicle_of
    from seals.sysid.data.robot_description import described

    found = described(config)
    if found is None:
        return {}, {}
    sheet = datasheet_of(config.robot.folder)
    sheet = {key: value for key, value in sheet.items() if key not in _HEAD}
    return sheet, vehicle_of(found.robot, found.actuators)


def _of_log(meta: Mapping[str, Any], vehicle: Mapping[str, Any]) -> dict[str, Any]:
    """Metadata of a log; without its vehicle if that is only a name or mass beside a robot."""
    stated = meta.get("vehicle")
    part = bool(vehicle) and isinstance(stated, Mapping) and "inertia" not in stated
    return {k: v for k, v in meta.items() if not (part and k == "vehicle")}


def adapted(log: Log, config: Any, vehicle: Mapping[str, Any]) -> tuple[Log, list[str]]:
    """Return a log in ENU and FLU with drive commands and even rows, and remarks on it.

    Args:
        log: as the reader gives it, with what is known of the vehicle in its metadata.
        config: composed configuration of a conversion: ``span``, ``axes``, ``motors``, ``late``,
            ``rate``.
        vehicle: of the robot; empty without one.

    Raises:
        LogError: a channel that is needed is not there, or its values cannot be understood.
    """
    from omegaconf import OmegaConf

    axes: Any = OmegaConf.to_object(config.axes)
    log, held = without_false_readings(_cut(log, list(config.span)))
    log, said = with_axes(log, axes)
    said = [*held, *said]
    motors: Any = OmegaConf.to_container(config.motors)
    stated = {k: v for k, v in motors.items() if v is not None}
    curve = motor_curve(log.meta.get("motors"), stated)
    own = log.meta.get("vehicle")
    rotors = vehicle.get("rotors") or (own.get("rotors") if isinstance(own, Mapping) else None)
    commanded = log.has("rotor_speed_cmd") or log.has("thruster_cmd")
    if log.has("motor_pwm") and not commanded:
        if rotors:
            log, words = with_rotor_speeds(log, curve, rotors)
            said += words
        elif vehicle.get("thrusters"):
            log, words = with_thruster_forces(log, curve, vehicle["thrusters"])
            said += words
        else:
            said.append("motor commands, not converted: robot=FOLDER converts them")
    late = _shifts(config.late)
    log = even_rows(log, float(config.rate), late)
    said += [f"{stem} was late by {shift:g} s" for stem, shift in late.items()]
    return log, said


def _shifts(given: Any) -> dict[str, float]:
    """Return the delays of channels [s] that the option states."""
    try:
        return read(dict[str, float], given or {}, where="late")
    except ConfigError as cause:
        raise ConfigError(
            f"late={given} is not allowed.\n"
            "Allowed: the time of each channel in seconds, as in 'late={position: 0.03}'"
        ) from cause


def _cut(log: Log, span: list[float]) -> Log:
    if not span:
        return log
    if len(span) != 2 or not span[0] < span[1]:
        raise ConfigError(f"span={span} is not allowed.\nAllowed: [first,last], in seconds of t")
    kept = (log.time >= span[0]) & (log.time <= span[1])
    if not kept.any():
        first, last = log.time.min(), log.time.max()
        raise ConfigError(f"span={span} holds no row.\nThe log runs from {first:g} to {last:g} s.")
    return log.select(kept)
