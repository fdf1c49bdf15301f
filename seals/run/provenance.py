"""Provenance of a run: versions, revision, machine, checksums of the robot's files."""

from __future__ import annotations

import hashlib
import os
import platform
import stat
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import seals
from seals.backend import BackendOptions, compiles
from seals.errors import LogError
from seals.logs.table import read_parquet
from seals.plugin_options import options_of
from seals.robot.settings import RobotSettings
from seals.robot.urdf import mesh_names
from seals.run.assembly import step_count
from seals.run.settings import RunSettings
from seals.untrusted_io import MOST_BYTES, read_bytes, read_json

PACKAGES = (
    *("numpy", "scipy", "pybullet", "mujoco", "torch", "hydra-core", "pyarrow"),
    *("taichi", "quadrants", "llvmlite"),
)
"""Packages whose version can change a result."""


OWN = "robot.yaml"
"""File of a robot folder that says what it is."""


def versions() -> dict[str, str]:
    """Return the versions of SEALS, Python and the packages that affect results."""
    found = {"seals": seals.__version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def revision(folder: Path) -> str | None:
    """Return the git revision of a checkout, ``-dirty`` when changed, or None without one.

    The checkout is the parent of the folder and no other above it: settings of a repository may
    start programs, and an installation may lie in a stranger's.
    """
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        done = subprocess.run(
            [*command, "--exclude=*"],
            env={**os.environ, "GIT_CEILING_DIRECTORIES": str(folder.parent.parent)},
            capture_output=True,
            text=True,
            timeout=5.0,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None  # no git on this machine, or a checkout too large to ask
    return done.stdout.strip() or None if done.returncode == 0 else None


def provenance(settings: RunSettings) -> dict[str, Any]:
    """Return the provenance of a run: versions, revision, machine, checksums."""
    return {
        "versions": versions(),
        "git": revision(Path(seals.__file__).resolve().parent),
        "machine": f"{platform.system()} {platform.machine()}",
        "seed": settings.seed,
        "engine": f"{type(settings.backend).__module__}.{type(settings.backend).__qualname__}",
        "compiled": compiled_of(settings),
        **({"robot": _named_files(settings.robot)} if settings.robot.urdf else {}),
        **({"robots": _fleet_files(settings)} if settings.robots else {}),
        **({"objects": _object_files(settings)} if settings.objects else {}),
    }


def compiled_of(settings: RunSettings) -> bool:
    """Return whether the laws of a run are compiled; false for a run that fell back to NumPy."""
    choice = options_of(settings.backend, BackendOptions).compiled
    return settings.fluid is None and compiles(choice, step_count(settings))


def _named_files(robot: RobotSettings) -> dict[str, Any]:
    return {"name": robot.name, "folder": robot.folder, "files": _robot_files(robot)}


def _whole_files(robot: RobotSettings) -> dict[str, Any]:
    """Return folder and checksums of a robot whose values the configuration does not repeat."""
    files = {**_robot_files(robot), OWN: digest(Path(robot.folder) / OWN)}
    return {"folder": robot.folder, "files": files}


def _fleet_files(settings: RunSettings) -> dict[str, Any]:
    return {name: _whole_files(own.robot) for name, own in settings.robots.items()}


def _object_files(settings: RunSettings) -> dict[str, Any]:
    """Return folder and checksums of every object's robot, by the object's name."""
    from seals.config.source import find_robot
    from seals.run.objects import object_robot

    robots = {name: object_robot(find_robot(o.robot)) for name, o in settings.objects.items()}
    return {name: _whole_files(robot) for name, robot in robots.items()}


def _robot_files(robot: RobotSettings) -> dict[str, str | None]:
    """Return the checksums of the URDF and of all meshes, by relative path."""
    folder = Path(robot.folder)
    urdf = Path(robot.urdf)
    # meshes lie beside the URDF, which may itself lie below the robot's folder
    names = [str(urdf), *(str(urdf.parent / name) for name in mesh_names(robot.urdf_path))]
    names += [shape.file for hull in robot.hulls.values() for shape in hull.shapes if shape.file]
    return {name: digest(folder / name) for name in dict.fromkeys(names)}


def digest(path: Path) -> str | None:
    """Return the SHA-256 of a file, or None when it does not exist, or is no ordinary one.

    Raises:
        LogError: it is larger than any file of a robot.
    """
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    if not stat.S_ISREG(status.st_mode):
        return None
    # some of the system's files say that they are empty, and have no end
    raw = read_bytes(path, most=MOST_BYTES, packed=True) if status.st_size else b""
    return hashlib.sha256(raw).hexdigest()


def noted_digest(folder: Path, name: str) -> str | None:
    """Return the SHA-256 of a file of a robot that ``run.json`` names.

    Raises:
        LogError: the name leads elsewhere than into its folder or into one beside it.
    """
    try:
        near = (folder / name).resolve().is_relative_to(folder.resolve().parent)
    except (OSError, RuntimeError, ValueError):
        near = False
    if not near or Path(name).is_absolute():
        raise LogError(
            f"run.json names '{name[:80]}' as a file of the robot in {folder}, which is in "
            "another folder.\nRestore it, or run again."
        )
    return digest(folder / name)


TABLES = ("log.parquet", "ledger.parquet")


def differences(folder: Path, original: Path) -> list[str]:
    """Return the columns in which the logs of two run folders differ."""
    found: list[str] = []
    for table in TABLES:
        if not (original / table).is_file():
            found.append(f"{table} (missing)")
            continue
        new, old = read_parquet(folder / table), read_parquet(original / table)
        found += [
            f"{table}:{name}"
            for name in dict.fromkeys([*old, *new])
            if name not in old or name not in new or new[name].tobytes() != old[name].tobytes()
        ]
    return found


def version_changes(original: Path) -> list[str]:
    """Return the packages whose version differs from an earlier run."""
    path = original / "run.json"
    if not path.is_file():
        return []
    noted: dict[str, Any] = read_json(path).get("versions", {})
    now = versions()
    return [
        f"{name} {noted.get(name, 'absent')} then, {now.get(name, 'absent')} now"
        for name in sorted({*noted, *now})
        if noted.get(name) != now.get(name)
    ]
