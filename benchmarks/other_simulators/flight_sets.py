"""Cases of a set of flights: log, truth, robot folders, maps and the list of what made them."""

from __future__ import annotations

import argparse
import gzip
import importlib.metadata
import io
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Columns = dict[str, Floats]


@dataclass(frozen=True)
class Noise:
    """White noise of position [m], attitude [rad], gyroscope [rad/s], accelerometer [m/s^2]."""

    position: float = 0.003
    attitude: float = 0.004
    rate: float = 0.01
    force: float = 0.08


@dataclass(frozen=True)
class Case:
    """One flight.

    Args:
        name: of its folder.
        hidden: what acts that the robot folder does not state, in words with numbers.
        answers: those that are right, as the scorer reads them.
        robot: folder of ``robots/``.
        settings: keyword arguments of the flight.
        map: file that maps the columns.
        convert: further words for ``seals convert``.
        rate: rows a second of the converted log.
    """

    name: str
    hidden: tuple[str, ...]
    answers: tuple[str, ...]
    robot: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    map: str = "map.yaml"
    convert: tuple[str, ...] = ()
    rate: int = 100

    def truth(self) -> dict[str, Any]:
        """Return what the scorer and the runner read."""
        known: dict[str, Any] = {"name": self.name, "hidden": list(self.hidden)}
        known |= {"robot": self.robot, "answers": list(self.answers)}
        if self.map != "map.yaml":
            known["map"] = self.map
        if self.rate != 100:
            known["rate"] = self.rate
        return known | ({"convert": list(self.convert)} if self.convert else {})


def cases_of(
    path: Path, paths: Mapping[str, Callable[..., Any]], *, robot: str, **same: Any
) -> tuple[Case, ...]:
    """Return the cases of a YAML file.

    Args:
        path: of the file: ``paths`` by name, and ``cases`` with ``hidden``, ``answers``, ``path``
            and, where they are not as in most cases, ``robot``, ``map``, ``convert`` and ``acts``.
        paths: functions that make a path.
        robot: folder of most cases.
        same: fields of all cases.
    """
    read = yaml.safe_load(path.read_text(encoding="utf-8"))
    found = []
    for name, told in read["cases"].items():
        way = dict(read["paths"][told["path"]] if isinstance(told["path"], str) else told["path"])
        settings = {"path": paths[way.pop("of")](**way), **told.pop("acts", {})}
        hidden, answers = told.pop("hidden"), tuple(told.pop("answers"))
        del told["path"]
        fields = {"robot": robot, **same, **told}
        fields["convert"] = tuple(fields.get("convert", ()))
        found.append(Case(name, (hidden,) if hidden else (), answers, settings=settings, **fields))
    return tuple(found)


def write_set(
    cases: Sequence[Case],
    fly: Callable[..., Columns],
    *,
    seed: int,
    robots: Mapping[str, Mapping[str, str]],
    maps: Mapping[str, Mapping[str, Any]],
    packages: Sequence[str],
) -> None:
    """Fly all cases and write the folder that the runner and the scorer take.

    The command line names the folder, whose files are overwritten, and with ``--only`` some cases.

    Args:
        cases: of the set.
        fly: of the simulator; gets the settings of a case and ``rng``.
        seed: of the set; each case has its own random numbers from it and its place in the list.
        robots: files of every robot folder.
        maps: columns of the logs, a file each.
        packages: whose versions are written beside the logs.
    """
    asked = command_line("out")
    out, only = asked.out, asked.only
    for robot, files in robots.items():
        place = out / "robots" / robot
        place.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (place / name).write_text(text, encoding="utf-8")
    for name, columns in maps.items():
        (out / name).write_text(yaml.safe_dump(dict(columns)), encoding="utf-8")
    made = {p: importlib.metadata.version(p) for p in packages}
    made["seed"] = str(seed)
    (out / "made_by.yaml").write_text(yaml.safe_dump(made), encoding="utf-8")
    for place_in_list, case in enumerate(cases):
        if only and case.name not in only:
            continue
        rng = np.random.default_rng([seed, place_in_list])
        place = out / "cases" / case.name
        place.mkdir(parents=True, exist_ok=True)
        write_table(place / "log.csv.gz", fly(rng=rng, **case.settings))
        words = yaml.safe_dump(case.truth(), sort_keys=False, width=1000)
        (place / "truth.yaml").write_text(words, encoding="utf-8")
        print(case.name, flush=True)


def command_line(*folders: str, **more: Any) -> argparse.Namespace:
    """Read a command line: folders, names of cases after ``--only``, and options by default.

    Args:
        folders: names of what must be given.
        more: options with their defaults.
    """
    parser = argparse.ArgumentParser()
    for name in folders:
        parser.add_argument(name, type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    for name, default in more.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    return parser.parse_args()


def cases_in(given: Path, only: Sequence[str]) -> list[Path]:
    """Return the folders of a set's cases, or of those that are named."""
    cases = sorted(path.parent for path in given.resolve().glob("cases/*/truth.yaml"))
    return [case for case in cases if not only or case.name in only]


def lay_out(case: Path, place: Path) -> tuple[list[str], list[str]]:
    """Copy a case's log, robot and maps into a folder; return the words that ready its log.

    Those of ``seals convert``, and those of ``seals new datasheet``.
    """
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    given = case.parents[1]
    shutil.copytree(given / "robots" / truth["robot"], place / "robot")
    (place / "log.csv").write_bytes(gzip.decompress((case / "log.csv.gz").read_bytes()))
    for chart in sorted(given.glob("*.yaml")):
        shutil.copy(chart, place)
    words = ["log=log.csv", f"map={truth.get('map', 'map.yaml')}", "robot=robot", "out=flight"]
    words += [f"rate={truth.get('rate', 100)}", *truth.get("convert", [])]
    return ["convert", *words], ["new", "datasheet", "log=flight", "robot=robot"]


def urdf(
    name: str, mass: float, inertia: Sequence[float], box: Sequence[float], height: float = 0.0
) -> str:
    """Return the URDF of a body with the shape of a box [kg, kg m^2, m].

    Args:
        name: of the robot.
        mass: of the body.
        inertia: about its axes, at the origin.
        box: its edges.
        height: of the middle of the box above the origin.
    """
    moments = " ".join(f'i{a}{a}="{v}"' for a, v in zip("xyz", inertia, strict=True))
    edges = " ".join(str(v) for v in box)
    return f"""<?xml version="1.0"?>
<robot name="{name}">
  <link name="base_link">
    <inertial>
      <origin xyz="0 0 0"/><mass value="{mass}"/>
      <inertia {moments} ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision>
      <origin xyz="0 0 {height}"/><geometry><box size="{edges}"/></geometry>
    </collision>
  </link>
</robot>
"""


def write_table(path: Path, columns: Columns) -> None:
    """Write the columns as CSV, packed, the same bytes each time."""
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.6f", delimiter=",")
    path.write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product of two vectors, quicker than that of NumPy."""
    x, y, z = a
    u, v, w = b
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def split_sensors(changes: dict[str, Any]) -> dict[str, Any]:
    """Take what concerns the sensors out of what acts in a flight, and return it."""
    of_sensors = ("acc_", "gyro_", "imu_", "pose_")
    return {k: changes.pop(k) for k in [*changes] if k.startswith(of_sensors)}


def at_times(times: Floats, values: Floats, late: float) -> Floats:
    """Return the values as a channel shows them that is late [s]."""
    if not late:
        return values
    return np.column_stack([np.interp(times - late, times, v) for v in values.T])


def turned_by(q_xyzw: Floats, angles: Floats) -> Floats:
    """Return the attitudes after small turns in body axes [rad]."""
    x, y, z, w = q_xyzw.T
    a, b, c = angles.T / 2.0
    turned = np.column_stack(
        [
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
            w - x * a - y * b - z * c,
        ]
    )
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def measured(
    rng: np.random.Generator,
    times: Floats,
    states: Mapping[str, Floats],
    *,
    noise: Noise = Noise(),
    acc_bias: Sequence[float] = (0.0, 0.0, 0.0),
    gyro_bias: Sequence[float] = (0.0, 0.0, 0.0),
    imu_place: Sequence[float] = (0.0, 0.0, 0.0),
    imu_late: float = 0.0,
    pose_late: float = 0.0,
) -> dict[str, Floats]:
    """Return what sensors say of the true motion.

    Args:
        rng: source of noise.
        times: of the rows [s].
        states: ``position`` [m], ``q_xyzw``, ``rate`` [rad/s], ``turning`` (its derivative),
            ``force`` (specific force at the origin, body axes [m/s^2]).
        noise: of the sensors.
        acc_bias: of the accelerometer [m/s^2].
        gyro_bias: of the gyroscope [rad/s].
        imu_place: of the inertial sensor in body axes [m].
        imu_late: delay of gyroscope and accelerometer [s].
        pose_late: delay of position and attitude [s].
    """
    rows, rate, arm = len(times), states["rate"], np.asarray(imu_place)
    force = states["force"] + np.cross(states["turning"], arm)
    force = force + np.cross(rate, np.cross(rate, arm))
    pose = at_times(times, states["position"], pose_late)
    attitude = at_times(times, states["q_xyzw"], pose_late)
    attitude = attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    return {
        "position": pose + rng.normal(0.0, noise.position, (rows, 3)),
        "q_xyzw": turned_by(attitude, rng.normal(0.0, noise.attitude, (rows, 3))),
        "force": at_times(times, force, imu_late)
        + acc_bias
        + rng.normal(0.0, noise.force, (rows, 3)),
        "rate": at_times(times, rate, imu_late)
        + gyro_bias
        + rng.normal(0.0, noise.rate, (rows, 3)),
    }
