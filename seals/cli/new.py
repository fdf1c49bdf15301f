"""``seals new``: generates a robot folder, a data sheet, hydrodynamics or a plug-in package."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from seals.cli.words import key_among
from seals.config.overrides import override, typed
from seals.config.refusal import own_robot
from seals.errors import ConfigError, nearest, refuse_unlisted, suggestion

if TYPE_CHECKING:
    from seals.robot.model import RobotModel
    from seals.scaffold.robot import NewRobot

PLUGINS = ("effect", "sensor", "controller", "guide", "task", "reader")
KINDS = ("robot", "datasheet", "hydrodynamics", *PLUGINS)
TAKES = {"robot": ("urdf",), "datasheet": ("robot", "log"), "hydrodynamics": ("robot",)}
"""Options of which a value may stand without its key."""
OPTIONS = {
    "robot": ("urdf", "package", "density", "medium", "missing-meshes", "forward", "arg"),
    "datasheet": ("log", "robot", "replace"),
    "hydrodynamics": ("robot", "link", "method", "panels", "density", "replace"),
    **dict.fromkeys(PLUGINS, ()),
}
"""Options after the name; each may be written ``urdf=FILE`` or ``--urdf FILE``."""


def new(arguments: list[str]) -> int:
    """Create a new item in the working directory, and print the next steps."""
    words, options = _sorted(arguments)
    kind = words[0] if words else ""
    for word in words[1:]:
        # the name of a robot is the only word that stays without a key
        key = key_among(TAKES.get(kind, ()), word)
        if key and key not in options:
            words.remove(word)
            options[key] = [word]
    if kind not in KINDS:
        robot = f"Write: seals new robot {kind or 'NAME'} urdf=FILE.  "
        meant = "urdf" in options and nearest(kind, KINDS) is None
        hint = (robot if meant else "") + suggestion(kind, KINDS, label="Kinds")
        what = f"'{kind}' is not a kind that seals new can create" if kind else "no kind is given"
        raise ConfigError(f"{what}.\n{hint}")
    if kind in ("robot", *PLUGINS) and len(words) != 2:
        urdf = " urdf=FILE" if kind == "robot" else ""
        what = (
            "has no name" if len(words) < 2 else f"has more than one name: {', '.join(words[1:])}"
        )
        raise ConfigError(f"the new {kind} {what}.\nWrite: seals new {kind} NAME{urdf}")
    for key in options:
        label = f"Options of new {kind}"
        refuse_unlisted(key, OPTIONS[kind], f"there is no option '{key}'", label=label)
    if kind == "robot":
        return _robot(words[1], options)
    given = {key: values[-1] for key, values in options.items()}
    if kind == "datasheet":
        return _datasheet(words[1:], given)
    if kind == "hydrodynamics":
        return _new_hydrodynamics(words[1:], given)
    from seals.scaffold.writing import scaffold_plugin

    print("\n".join(scaffold_plugin(kind, words[1], parent=Path())))
    return 0


def _datasheet(words: list[str], given: Mapping[str, str]) -> int:
    """Write the data sheet of a robot folder from a flight, and print its values."""
    if words or not (given.get("log") and given.get("robot")):
        raise ConfigError(
            "a data sheet needs a flight and a robot folder.\n"
            "Write: seals new datasheet LOG ROBOT, or log=FLIGHT robot=FOLDER"
        )
    folder = own_robot(given["robot"])
    from seals.logs import read_native, refuse_if_bad
    from seals.logs.shipped import find_log
    from seals.run.equipment_metadata import DATASHEET, vehicle_of
    from seals.scaffold.datasheet import write_datasheet
    from seals.sysid.data.robot_description import describe_robot
    from seals.sysid.report.given_logs import without_start

    found = describe_robot(str(folder))
    vehicle = vehicle_of(found.robot, found.actuators)
    log = read_native(find_log(given["log"]))
    refuse_if_bad(log, vehicle)
    place = folder / DATASHEET
    print("\n".join(write_datasheet(log, vehicle, place, replace=_replacing(given))))
    print(f"{place}\nNext:\n  review it, and replace the assumed values")
    again = f"{typed('log', given['log'])} {typed('robot', str(folder))}"
    print(f"  {without_start(log) or f'seals diagnose {again} out=answer'}")
    return 0


def _replacing(given: Mapping[str, str]) -> bool:
    return given.get("replace", "false").lower() == "true"


def _sorted(arguments: list[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Separate positional words from options with all their values."""
    words: list[str] = []
    options: dict[str, list[str]] = {}
    rest = iter(arguments)
    for word in rest:
        key, equals, value = word.lstrip("-").partition("=")
        if word.startswith("-") and not equals:
            value = next(rest, "")
            if not value or value.startswith("--"):
                raise ConfigError(f"{word} has no value.\nWrite: {word} VALUE")
        if word.startswith("-") or equals:
            options.setdefault(key, []).append(value)
        else:
            words.append(word)
    return words, options


def _robot(name: str, options: Mapping[str, list[str]]) -> int:
    from seals.scaffold.effects import RobotMedium
    from seals.scaffold.mending import FORWARD
    from seals.scaffold.robot import scaffold_robot
    from seals.scaffold.takeover import urdfs_near

    urdfs = options.get("urdf", [])
    if len(urdfs) != 1:
        hint = suggestion("", urdfs_near(Path()), label="URDF files near")
        what = "urdf is given more than once" if urdfs else "urdf is not given"
        raise ConfigError(f"{what}.\nWrite: seals new robot {name} urdf=FILE.  {hint}")
    if "://" in urdfs[0] and not urdfs[0].startswith("package:"):
        raise ConfigError(
            f"urdf={urdfs[0]} is a web address, but a file is needed.\n"
            f"Download it with its meshes, then: seals new robot {name} urdf=FILE"
        )
    packages = _pairs(options, "package", "FOLDER", "NAME=FOLDER, with a folder that exists")
    values = _pairs(options, "arg", "VALUE", "namespace=rov")
    last = {key: given[-1] for key, given in options.items()}
    density = None
    if "density" in last:
        given = f"density={last['density']}"
        density = _number(given, last["density"], (1.0, 30_000.0), "kg/m^3; water has 1000")
    media = [each.value for each in RobotMedium]
    medium = last.get("medium")
    choices = {
        "medium": (media, suggestion(medium or "", media)),
        "missing-meshes": (["boxes"], "Allowed: boxes."),
        "forward": (FORWARD, f"Allowed: {', '.join(FORWARD)}"),
    }
    for key, (allowed, hint) in choices.items():
        if key in last and last[key] not in allowed:
            raise ConfigError(f"{key}={last[key]} is not allowed.\n{hint}")
    made = scaffold_robot(
        name,
        Path(urdfs[0]),
        parent=Path(),
        packages={package: Path(folder).resolve() for package, folder in packages.items()},
        arguments=values,
        density=density,
        medium=medium,
        boxes="missing-meshes" in last,
        forward=last.get("forward", "x"),
    )
    try:
        lines = list(_told(name, made))
    except ConfigError as cause:
        # a folder that no run can take is none
        shutil.rmtree(made.folder)
        raise ConfigError(
            f"{urdfs[0]} describes a robot that cannot be simulated: {cause}"
        ) from cause
    print("\n".join(lines))
    return 0


def _pairs(options: Mapping[str, list[str]], flag: str, what: str, example: str) -> dict[str, str]:
    """Return the values of a flag of the form NAME=VALUE, or NAME=FOLDER of one that exists."""
    found = {}
    for text in options.get(flag, ()):
        name, equals, value = text.partition("=")
        if not equals or not (Path(value).is_dir() if what == "FOLDER" else name.isidentifier()):
            raise ConfigError(
                f"{flag}={text} is not of the form NAME={what}.\nWrite: {flag}={example}"
            )
        found[name] = value
    return found


def _told(name: str, made: NewRobot) -> Iterator[str]:
    """Yield a summary of the new folder, remarks warnings, and the next steps."""
    robot = made.robot
    parts = [
        f"{robot.mass.sum():.4g} kg",
        "1 link" if len(robot.links) == 1 else f"{len(robot.links)} links",
        f"{len(robot.joints)} joint{'' if len(robot.joints) == 1 else 's'}",
    ]
    parts += [f"{len(drives.links)} {drives.kind}s" for drives in made.drives]
    parts += [f"{len(made.limbs.arms)} arm(s)"] if made.limbs.arms else []
    parts += [f"{len(made.limbs.grippers)} gripper(s)"] if made.limbs.grippers else []
    yield f"{name}/robot.yaml: {', '.join(parts)}"
    for change in made.changes:
        yield f"  {change}"
    if made.unused:
        kinds = "1 kind" if made.unused == 1 else f"{made.unused} kinds"
        yield f"  {kinds} of entries in the file that are not used: {name}/README.md says why"
    if made.remarks:
        yield "Look at:"
        yield from (f"  {remark}" for remark in made.remarks)
    yield "Next:"
    yield f"  seals check {typed('robot', name)}"
    yield f"  seals run {typed('robot', name)} {_first_run(name)}"


def _first_run(name: str) -> str:
    """Words of a run in which the new robot does what it can, by the facts of ``seals check``."""
    from seals.check.reach import reach_of
    from seals.config.compose import compose
    from seals.robot.build import build_robot
    from seals.run.build import build_run

    run = build_run(compose([override("robot", name)]))
    robot = build_robot(run.robot)
    if robot.legs:
        return _first_stand(name, robot)
    reach = reach_of(robot, run.actuators, run.effects)
    if reach is not None:
        return reach.first_run()
    water = [] if robot.tree.fixed_base else ["water=fossen"]
    moving = ["controller=direct guide=hover guide.arm=sweep"] if robot.arms else []
    return " ".join([*water, *moving]) or "water=fossen"


def _first_stand(name: str, robot: RobotModel) -> str:
    """Words of a run in which legs stand on the ground; in water where no gait takes them."""
    from seals.check.floating import FloatingBody
    from seals.config.compose import compose
    from seals.run.assembly import build_world
    from seals.run.build import build_run

    height = math.ceil(-1e3 * FloatingBody(robot).lowest()) / 1e3
    ground = f"environment.ground_level=0 initial.position=[0,0,{height:g}]"
    words = f"guide=march guide.speed=0 {ground}"
    try:
        build_world(build_run(compose([override("robot", name), *words.split()]))).close()
    except ConfigError:
        return "water=fossen"
    return words


def _new_hydrodynamics(words: Sequence[str], given: Mapping[str, str]) -> int:
    """Compute hydrodynamics of one link of a robot folder, write them, and print what was found."""
    if words or not given.get("robot"):
        raise ConfigError(
            "hydrodynamics needs a robot folder.\n"
            "Write: seals new hydrodynamics robot=FOLDER method=bem"
        )
    folder = own_robot(given["robot"])
    from seals.environment.seawater import FRESH_WATER
    from seals.run.progress import progress
    from seals.scaffold.hydrodynamics import has_boundary_elements
    from seals.scaffold.hydrodynamics.link import (
        Method,
        hydrodynamics_of,
        problems_of,
        refuse_stated,
        write_hydrodynamics,
    )
    from seals.sysid.data.robot_description import describe_robot

    names = [one.value for one in Method]
    method = given.get("method") or ("bem" if has_boundary_elements() else "ellipsoid")
    refuse_unlisted(method, names, f"method={method} is not a method", label="Methods")
    numbers = {"panels": 500.0, "density": FRESH_WATER}
    spans = {"panels": ((60.0, 4000.0), "panels"), "density": ((500.0, 2000.0), "kg/m^3")}
    for key, (span, unit) in spans.items():
        if key in given:
            numbers[key] = _number(f"{key}={given[key]}", given[key], span, unit)
    panels, density = numbers["panels"], numbers["density"]
    robot = describe_robot(str(folder)).robot
    link = given.get("link") or robot.links[0]
    refuse_stated(folder, robot, link, replace=_replacing(given))
    with progress(f"radiation of {link}", problems_of(robot, link, density)) as tell:
        found = hydrodynamics_of(
            robot, link, Method(method), density=density, panels=round(panels), tell=tell
        )
    written = write_hydrodynamics(folder, robot, found)
    print("\n".join(found.words))
    print(f"{folder / 'robot.yaml'}: effects {', '.join(written)}\nNext:")
    again = typed("robot", str(folder))
    print(f"  seals check {again}\n  seals run {again} water=fossen")
    return 0


def _number(given: str, text: str, span: tuple[float, float], unit: str) -> float:
    """Return a number of the command line within bounds."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not span[0] <= value <= span[1]:
        raise ConfigError(f"{given} is not allowed.\nAllowed: {span[0]:g} to {span[1]:g} {unit}.")
    return value
