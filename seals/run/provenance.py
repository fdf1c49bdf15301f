"""Where a run comes from: versions, revision, machine, checksums of the robot's files."""

from __future__ import annotations

import hashlib
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import seals
from seals.config.run import RunSettings
from seals.robot.meshes import mesh_names

PACKAGES = ("numpy", "scipy", "pybullet", "taichi", "torch", "hydra-core", "pyarrow")
"""Packages whose version can change a result."""


def versions() -> dict[str, str]:
    """Return the versions of this program, Python and the packages that matter to results."""
    found = {"seals": seals.__version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def revision(folder: Path) -> str | None:
    """Return the git revision of a checkout, ``-dirty`` when changed, or None without one."""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        done = subprocess.run(
            [*command, "--exclude=*"], capture_output=True, text=True, timeout=5.0, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None  # no git on this machine, or a checkout too large to ask
    return done.stdout.strip() or None if done.returncode == 0 else None


def provenance(settings: RunSettings) -> dict[str, Any]:
    """Return what is needed to know, and to repeat, where a run came from."""
    return {
        "versions": versions(),
        "git": revision(Path(seals.__file__).resolve().parent),
        "machine": f"{platform.system()} {platform.machine()}",
        "seed": settings.seed,
        "robot": {
            "name": settings.robot.name,
            "folder": settings.robot.folder,
            "files": robot_files(settings),
        },
    }


def robot_files(settings: RunSettings) -> dict[str, str | None]:
    """Return the checksums of the URDF and of all meshes, by relative path."""
    folder = Path(settings.robot.folder)
    urdf = Path(settings.robot.urdf)
    # meshes lie beside the URDF, which may itself lie below the robot's folder
    names = [str(urdf), *(str(urdf.parent / name) for name in mesh_names(settings.robot.urdf_path))]
    names += [
        shape.file for hull in settings.robot.hulls.values() for shape in hull.shapes if shape.file
    ]
    return {name: digest(folder / name) for name in dict.fromkeys(names)}


def digest(path: Path) -> str | None:
    """Return the SHA-256 of a file, or None when there is none."""
    if not path.is_file():
        return None
    return hashlib.sha256(path.read_bytes()).hexdigest()
