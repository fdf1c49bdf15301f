"""``seals new``: generates a robot folder, a data sheet, hydrodynamics or a plug-in package."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from seals.config.overrides import override, typed
from seals.config.whereabouts import own_robot
from seals.errors import ConfigError, suggestion

if TYPE_CHECKING:
    from seals.robot.model import RobotModel
    from seals.scaffold.robot import NewRobot

PLUGINS = ("effect", "sensor", "controller", "guide", "task")
KINDS = ("robot", "datasheet", "hydrodynamics", *PLUGINS)
OPTIONS = {
    "robot": ("urdf", "package", "density", "medium", "missing-meshes", "forward", "arg"),
    "datasheet": ("log", "robot", "replace"),
    "hydrodynamics": ("robot", "link", "method", "panels", "density", "replace"),
    **dict.fromkeys(PLUGINS, ()),
}
"""Options after the name; each may be written ``--urdf FILE`` or ``urdf=FILE``."""


def new(arguments: list[str]) -> int:
    """Create a new item in the working directory, and print the next steps."""
    words, options = _sorted(arguments)
    kind = words[0] if words else ""
    if kind not in KINDS:
        robot = f"Write: seals new robot {kind or 'NAME'} --urdf FILE.  "
        hint = (robot if "urdf" in dict(options) else "") + suggestion(kind, KINDS, label="Kinds")
        raise ConfigError(f"'{kind}' is not a kind that can be made.\n{hint}")
    if kind == "datasheet":
        return _datasheet(words[1:], options)
    if kind == "hydrodynamics":
        _refuse_options(kind, options)

        return new_hydrodynamics(words[1:], dict(options))
    if len(words) != 2:
        urdf = " --urdf FILE" if kind == "robot" else ""
        what = (
            "has no name" if len(words) < 2 else f"has more than one name: {', '.join(words[1:])}"
        )
        raise ConfigError(f"the new {kind} {what}.\nWrite: seals new {kind} NAME{urdf}")
    _refuse_options(kind, options)
    if kind == "robot":
        return _robot(words[1], options)
    from seals.scaffold.writing import scaffold_plugin

    print("\n".join(scaffold_plugin(kind, words[1], parent=Path())))
    return 0


def _refuse_options(kind: str, options: list[tuple[str, str]]) -> None:
    for key, _ in options:
        if key not in OPTIONS[kind]:
            hint = suggestion(key, OPTIONS[kind], label=f"Options of new {kind}")
            raise ConfigError(f"there is no option '{key}'.\n{hint}")


def _datasheet(words: list[str], options: list[tuple[str, str]]) -> int:
    """Write the data sheet of a robot folder from a flight, and print its values."""
    _refuse_options("datasheet", options)
    given = dict(options)
    if words or not (given.get("log") and given.get("robot")):
        raise ConfigError(
            "a data sheet needs a flight and a robot folder.\n"
            "Write: seals new datasheet log=FLIGHT robot=FOLDER"
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
    replace = given.get("replace", "false").lower() == "true"
    for words_ in write_datasheet(log, vehicle, place, replace=replace):
        print(words_)
    print(f"{place}\nNext:\n  look through it, and replace what is assumed")
    lacking = without_start(log)
    if lacking:
        print(f"  {lacking}")
        return 0
    again = f"{typed('log', given['log'])} {typed('robot', str(folder))}"
    print(f"  seals diagnose {again} out=answer")
    return 0


def _sorted(arguments: list[str]) -> tuple[list[str], list[tuple[str, str]]]:
    """Separate positional words from options with their values, both in order."""
    words: list[str] = []
    options: list[tuple[str, str]] = []
    rest = iter(arguments)
    for word in rest:
        key, equals, value = word.lstrip("-").partition("=")
        if word.startswith("-"):
            options.append((key, value if equals else _value(word, rest)))
        elif equals:
            options.append((key, value))
        else:
            words.append(word)
    return words, options


def _value(flag: str, rest: Iterator[str]) -> str:
    value = next(rest, "")
    if not value or value.startswith("--"):
        raise ConfigError(f"{flag} has no value.\nWrite: {flag} VALUE")
    return value


def _robot(name: str, options: list[tuple[str, str]]) -> int:
    urdfs = [value for key, value in options if key == "urdf"]
    if len(urdfs) != 1:
        from seals.scaffold.takeover import urdfs_near

        hint = suggestion("", urdfs_near(Path()), label="URDF files near")
        raise ConfigError(f"give one URDF: --urdf FILE (given: {len(urdfs)}).\n{hint}")
    packages = {}
    for text in (value for key, value in options if key == "package"):
        package, equals, folder = text.partition("=")
        if not equals or not Path(folder).is_dir():
            raise ConfigError(
                f"--package {text} is not of the form NAME=FOLDER.\n"
                "Write: --package NAME=FOLDER, with a folder that exists"
            )
        packages[package] = Path(folder).resolve()
    values = {}
    for text in (value for key, value in options if key == "arg"):
        argument, equals, value = text.partition("=")
        if not (equals and argument.isidentifier()):
            raise ConfigError(
                f"--arg {text} is not of the form NAME=VALUE.\nWrite: --arg namespace=rov"
            )
        values[argument] = value
    from seals.scaffold.robot import scaffold_robot

    density = _density([value for key, value in options if key == "density"])
    medium = _medium([value for key, value in options if key == "medium"])
    made = scaffold_robot(
        name,
        Path(urdfs[0]),
        parent=Path(),
        packages=packages,
        arguments=values,
        density=density,
        medium=medium,
        boxes=_boxes([value for key, value in options if key == "missing-meshes"]),
        forward=_forward([value for key, value in options if key == "forward"]),
    )
    try:
        lines = list(_told(name, made))
    except ConfigError as cause:
        # a folder that no run can take is none
        shutil.rmtree(made.folder)
        raise ConfigError(f"{urdfs[0]} makes a robot that no run takes: {cause}") from cause
    print("\n".join(lines))
    return 0


def _forward(given: list[str]) -> str:
    """Axis of the base that points forward."""
    from seals.scaffold.mending import FORWARD

    if given and given[-1] not in FORWARD:
        raise ConfigError(
            f"--forward {given[-1]} is not allowed.\nAllowed: {', '.join(FORWARD)}; --forward=-x"
        )
    return given[-1] if given else "x"


def _boxes(given: list[str]) -> bool:
    """Whether boxes take the places of missing meshes."""
    if given and given[-1] != "boxes":
        raise ConfigError(f"--missing-meshes {given[-1]} is not allowed.\nAllowed: boxes.")
    return bool(given)


def _medium(given: list[str]) -> str | None:
    """Where the robot works; None when it was not said."""
    from seals.scaffold.effects import RobotMedium

    known = [each.value for each in RobotMedium]
    if given and given[-1] not in known:
        raise ConfigError(f"--medium {given[-1]} is not allowed.\n{suggestion(given[-1], known)}")
    return given[-1] if given else None


def _density(given: list[str]) -> float | None:
    """Density for links without mass [kg/m^3]."""
    if not given:
        return None
    try:
        density = float(given[-1])
    except ValueError:
        density = 0.0
    if not 1.0 <= density <= 30_000.0:
        raise ConfigError(
            f"--density {given[-1]} is not allowed.\nAllowed: 1 to 30000 kg/m^3; water has 1000."
        )
    return density


def _told(name: str, made: NewRobot) -> Iterator[str]:
    """Yield a summary of the new folder, remarks to look at, and the next steps."""
    robot = made.robot
    parts = [
        f"{robot.mass.sum():.4g} kg",
        f"{len(robot.links)} links",
        f"{len(robot.joints)} joints",
    ]
    parts += [f"{len(drives.links)} {drives.kind}s" for drives in made.drives]
    parts += [f"{len(made.limbs.arms)} arm(s)"] if made.limbs.arms else []
    parts += [f"{len(made.limbs.grippers)} gripper(s)"] if made.limbs.grippers else []
    yield f"{name}/robot.yaml: {', '.join(parts)}"
    for change in made.changes:
        yield f"  {change}"
    if made.unused:
        kinds = "1 kind" if made.unused == 1 else f"{made.unused} kinds"
        yield f"  {kinds} of entries of the file not used: {name}/README.md says why"
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


def new_hydrodynamics(words: Sequence[str], given: Mapping[str, str]) -> int:
    """Compute hydrodynamics of one link of a robot folder, write them, and print what was found."""
    if words or not given.get("robot"):
        raise ConfigError(
            "hydrodynamics need a robot folder.\n"
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
    if method not in names:
        hint = suggestion(method, names, label="Methods")
        raise ConfigError(f"method={method} is not a method.\n{hint}")
    panels = _number(given, "panels", 500.0, (60.0, 4000.0), "panels")
    density = _number(given, "density", FRESH_WATER, (500.0, 2000.0), "kg/m^3")
    robot = describe_robot(str(folder)).robot
    link = given.get("link") or robot.links[0]
    replace = given.get("replace", "false").lower() == "true"
    refuse_stated(folder, robot, link, replace=replace)
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


def _number(
    given: Mapping[str, str], key: str, default: float, span: tuple[float, float], unit: str
) -> float:
    """A number of the command line within bounds."""
    if key not in given:
        return default
    try:
        value = float(given[key])
    except ValueError:
        value = float("nan")
    if not span[0] <= value <= span[1]:
        raise ConfigError(
            f"{key}={given[key]} is not allowed.\nAllowed: {span[0]:g} to {span[1]:g} {unit}."
        )
    return value
