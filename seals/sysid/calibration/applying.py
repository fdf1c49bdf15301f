"""Writing of calibrated values: as a diff of the robot folder, or as a new robot folder."""

from __future__ import annotations

import difflib
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.logs.atomic import atomic_folder, write_text
from seals.robot.model import RobotModel
from seals.robot.yaml_edit import figure, holds, with_entry, with_number
from seals.sysid.calibration.calibration import Calibration
from seals.sysid.calibration.stated import ACTUATORS, EFFECTS, SENSORS, StatedNumber
from seals.untrusted_io import read_text

ROBOT, DIFF = "robot.yaml", "robot.diff"
_MOST_FILES, _MOST_BYTES = 2000, 500_000_000
"""A robot folder that is larger is not copied."""


@dataclass(frozen=True, kw_only=True)
class Edited:
    """Files of a robot folder with calibrated numbers.

    Args:
        folder: of the robot.
        before: text of every file that changes, by its path in the folder.
        after: the same with calibrated numbers.
        notes: what could not be written, and why.
    """

    folder: Path
    before: Mapping[str, str]
    after: Mapping[str, str]
    notes: tuple[str, ...] = ()

    @property
    def diff(self) -> str:
        """The change as a unified diff."""
        lines: list[str] = []
        for name, text in self.after.items():
            old, new = self.before[name].splitlines(True), text.splitlines(True)
            lines += difflib.unified_diff(old, new, f"a/{name}", f"b/{name}")
        return "".join(line if line.endswith("\n") else f"{line}\n" for line in lines)


def edited(found: Calibration, folder: Path, robot: RobotModel) -> Edited:
    """Return the text of a robot folder's files with the values that the logs determine.

    Args:
        found: the calibration.
        folder: of the robot.
        robot: its model, with all links of the URDF.
    """
    urdf = Path(robot.urdf).resolve()
    inside = urdf.is_relative_to(folder.resolve()) and urdf.is_file()
    name = urdf.relative_to(folder.resolve()).as_posix() if inside else ""
    before = {ROBOT: read_text(folder / ROBOT)}
    after, notes = dict(before), []
    for number in found.numbers:
        if found.at_bound(number):
            notes.append(f"{number.name} stays as stated: the estimate is outside its bounds.")
        elif not found.determined(number):
            notes.append(f"{number.name} stays as stated: the logs do not determine it.")
        elif "." in number.name:
            try:
                after[ROBOT] = _with(after[ROBOT], number, found.value(number))
            except ConfigError as refusal:
                notes.append(str(refusal).replace("\n", " "))
    whole = [
        n
        for n in found.numbers
        if "." not in n.name and found.determined(n) and not found.at_bound(n)
    ]
    if whole and name:
        before[name] = read_text(folder / name)
        try:
            change = {
                n.name: found.value(n) - n.value for n in found.numbers if found.determined(n)
            }
            turn = np.array([change.get(f"inertia_{a}{a}", 0.0) for a in "xyz"])
            centre = found.problem.vehicle.robot.centre[0]
            mass, middle, inertia = base_inertial(robot, change.get("mass", 0.0), turn, centre)
            after[name] = with_inertial(before[name], robot.links[0], mass, middle, inertia)
        except ConfigError as refusal:
            notes.append(str(refusal).replace("\n", " "))
    elif whole:
        notes.append("the URDF is outside the robot folder: change mass and inertia by hand.")
    changed = {k: v for k, v in after.items() if v != before.get(k)}
    return Edited(
        folder=folder, before={k: before[k] for k in changed}, after=changed, notes=tuple(notes)
    )


def _with(text: str, number: StatedNumber, value: float) -> str:
    """Return the text of `robot.yaml` with one number set; a missing key is added."""
    path = number.name.split(".")
    if path[0] == SENSORS:
        # a fault of a sensor is an effect of the model
        path = [EFFECTS, *path[1:]]
        if not holds(text, path[:2]):
            entry = f"{{effect: {path[1]}, {path[2]}: {figure(value)}}}"
            return with_entry(text, path[:2], entry)
    if not holds(text, path):
        entry = figure(value)
        return with_entry(text, path, f"[{entry}]" if _listed(number) else entry)
    # a list with one number a drive keeps the ratios between them
    factor = value / number.value if number.value else 1.0
    one = _listed(number) or path[0] == ACTUATORS
    return with_number(text, path, lambda old: old * factor if one else value)


def _listed(number: StatedNumber) -> bool:
    """Return true if `robot.yaml` has a list with one number per drive."""
    return number.name.startswith(f"{ACTUATORS}.") and not number.key.endswith(
        number.name.rpartition(".")[2]
    )


def write_robot(edit: Edited, out: Path) -> Path:
    """Write a copy of the robot's folder with the calibrated numbers.

    Args:
        edit: of the robot's folder, which stays as it is.
        out: new folder.

    Raises:
        ConfigError: there is something already, or the folder is too large.
    """
    if out.exists():
        raise ConfigError(f"{out} already exists.\nGive another folder: out=FOLDER")
    files = [p for p in sorted(edit.folder.rglob("*")) if p.is_file() and not p.is_symlink()]
    if len(files) > _MOST_FILES or sum(p.stat().st_size for p in files) > _MOST_BYTES:
        raise ConfigError(
            f"{edit.folder} holds more than {_MOST_FILES} files or 500 MB.\n"
            "Copy it yourself and apply the diff: patch -p1 < robot.diff"
        )
    # whole or not at all: half a robot would be taken for one
    with atomic_folder(out) as beside:
        for file in files:
            name = file.relative_to(edit.folder).as_posix()
            target = beside / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if name in edit.after:
                write_text(target, edit.after[name])
            else:
                shutil.copyfile(file, target)
    return out


_INERTIAL = re.compile(r"<inertial\b.*?</inertial\s*>", re.DOTALL)


def base_inertial(
    robot: RobotModel, mass: float, turn: Floats, centre: Floats
) -> tuple[float, Floats, Floats]:
    """Return mass, centre and inertia of the base link under a change of the whole vehicle.

    Args:
        robot: with all links of its URDF.
        mass: change of the mass, at ``centre`` [kg].
        turn: change of the moments of inertia about the centre of gravity [kg m^2], shape (3,).
        centre: of gravity of the vehicle, base axes [m], shape (3,).

    Returns:
        Mass [kg], centre of mass [m] and inertia about it [kg m^2], base axes.

    Raises:
        ConfigError: other links are heavier than the whole vehicle would be.
    """
    own, new = float(robot.mass[0]), float(robot.mass[0]) + mass
    if new <= 0.0:
        raise ConfigError(
            f"the calibrated mass is less than that of the links other than '{robot.links[0]}'.\n"
            "Change their masses in the URDF by hand: the value is in calibration.json."
        )
    middle = (own * robot.centre[0] + mass * centre) / new
    inertia = robot.inertia[0] + np.diag(turn)
    inertia = inertia + own * _steiner(robot.centre[0] - middle)
    return new, middle, inertia + mass * _steiner(centre - middle)


def _steiner(arm: Floats) -> Floats:
    return (arm @ arm) * np.eye(3) - np.outer(arm, arm)


def with_inertial(text: str, link: str, mass: float, centre: Floats, inertia: Floats) -> str:
    """Return the text of a URDF with another mass, centre and inertia of one link.

    Args:
        text: of the file.
        link: its name.
        mass: [kg].
        centre: of mass, link axes [m], shape (3,).
        inertia: about it, link axes [kg m^2], shape (3, 3).

    Raises:
        ConfigError: the link has no inertial element of its own in this file.
    """
    start = re.search(rf"<link\s+name\s*=\s*[\"']{re.escape(link)}[\"'][^>]*>", text)
    end = text.find("</link", start.end()) if start else -1
    found = _INERTIAL.search(text, start.end(), end) if start and end > 0 else None
    if found is None:
        raise ConfigError(
            f'the URDF has no plain <inertial> in <link name="{link}">.\n'
            "Write mass and inertia by hand: the values are in calibration.json."
        )
    parts = {a + b: inertia["xyz".index(a), "xyz".index(b)] for a, b in _PAIRS}
    moments = " ".join(f'i{name}="{figure(value)}"' for name, value in parts.items())
    place = " ".join(figure(x) for x in centre)
    new = (
        f'<inertial><origin xyz="{place}" rpy="0 0 0"/><mass value="{figure(mass)}"/>'
        f"<inertia {moments}/></inertial>"
    )
    return text[: found.start()] + new + text[found.end() :]


_PAIRS = (("x", "x"), ("x", "y"), ("x", "z"), ("y", "y"), ("y", "z"), ("z", "z"))
"""Entries of an inertia matrix that a URDF states."""
