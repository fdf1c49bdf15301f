"""``seals doctor``: check the installation and its plug-ins."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from seals import registry
from seals.cli.installed_files import NAME, overwritten
from seals.config.roots import conf_folders, experiments
from seals.errors import ConfigError, SealsError
from seals.text_table import table

Remark = tuple[str, ...]
"""Line of the report: ``ok``, ``note`` or ``FAULT``; what was looked at; what was found."""


def doctor(arguments: list[str]) -> int:
    """Check Python, packages, plug-ins and configuration; print the report, return 1 on a fault.

    Robots and experiments of this package compose as it was tested; ``full=true`` composes them
    again, which takes a quarter of a second each.
    """
    full = arguments == ["full=true"]
    if arguments and not full:
        raise ConfigError(
            f"doctor does not take {' '.join(arguments)}.\nWrite: seals doctor, or full=true"
        )
    remarks: list[Remark] = []
    for look in LOOKS:
        try:
            remarks.extend(look(full) if look is configuration else look())
        except Exception as error:  # what is broken on this machine must not stop the other looks
            text = " ".join(str(error).split())
            remarks.append(("FAULT", look.__name__, f"{type(error).__name__}: {text}"))
    print(table(remarks, indent=""))
    faults = sum(state == "FAULT" for state, _, _ in remarks)
    print(f"\n{faults} fault(s)." if faults else "\nAll is well.")
    return 1 if faults else 0


def python() -> Iterator[Remark]:
    """Report the interpreter and the machine."""
    fits = sys.version_info[:2] >= (3, 10)
    words = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    yield "ok" if fits else "FAULT", "Python", words
    yield "ok", "cores", str(os.cpu_count() or 1)
    free = shutil.disk_usage(Path.cwd()).free / 1e9
    yield "ok" if free > 2 else "note", "disk", f"{free:.1f} GB free in {Path.cwd()}"


def packages() -> Iterator[Remark]:
    """Report the versions of the dependencies and whether they meet the requirements."""
    try:
        from packaging.requirements import Requirement  # comes with Hydra
    except ImportError:
        yield "FAULT", "packages", "not installed; install them: pip install aam-seals"
        return
    for text in requires("aam-seals") or []:
        wanted = Requirement(text)
        if wanted.marker is not None and "extra" in str(wanted.marker):
            continue
        if wanted.marker is not None and not wanted.marker.evaluate():
            yield "note", wanted.name, "not available for this Python version or machine"
            continue
        try:
            found = version(wanted.name)
        except PackageNotFoundError:
            words = f"missing; install it: pip install '{wanted.name}{wanted.specifier}'"
            yield "FAULT", wanted.name, words
            continue
        fits = wanted.specifier.contains(found, prereleases=True)
        words = found if fits else f"{found}, but {wanted.specifier} is required"
        yield "ok" if fits else "FAULT", wanted.name, words


def files() -> Iterator[Remark]:
    """Report files of the package that another one wrote over, and that one's name."""
    words = overwritten().words
    yield "FAULT" if words else "ok", "files", words or "as they were installed"


def plug_ins() -> Iterator[Remark]:
    """Report plug-ins that cannot be imported, and names that two packages claim."""
    from seals.config.derive import schema_of
    from seals.robot.robot_file import read_robot

    count = 0
    for package, words in registry.damaged_lists().items():
        yield "FAULT", f"package {package}", words
    for kind in registry.GROUPS:
        for name in registry.names(kind):
            subject = f"{kind} {name}"
            try:
                plugin = registry.get(kind, name)
                if kind in ("robot", "animal"):
                    read_robot(plugin.folder(), name=name)
                broken = ""
                if kind not in registry.FOLDER_KINDS:
                    schema_of(plugin)
                elif not plugin.folder().is_dir():
                    broken = f"{plugin.folder()} is not a folder."
            except SealsError as refusal:
                broken = str(refusal)
            if broken:
                yield "FAULT", subject, _short(broken)
            else:
                count += 1
    yield "ok", "plug-ins", f"{count} usable"


def configuration(full: bool = False) -> Iterator[Remark]:
    """Report robots and experiments that do not compose.

    Args:
        full: those of this package, too, and not only one of them.
    """
    from seals.config.compose import compose
    from seals.config.source import robot_names

    whole = [(f"robot={name}", "run") for name in robot_names()]
    whole += [(f"experiment={name}", root) for name, root in experiments().items()]
    if not full:
        # the names of the robots and experiments of this package
        kinds = [*registry.plugins("robot").values(), *registry.plugins("animal").values()]
        robots = {plugin.name for plugin in kinds if plugin.distribution == NAME}
        folders = [folder for plugin, folder in conf_folders() if plugin.distribution == NAME]
        ours = robots | {
            path.stem for folder in folders for path in folder.glob("experiment/*.yaml")
        }
        others = [one for one in whole if one[0].partition("=")[2] not in ours]
        whole = [*others, *whole[:1]]
    sound = 0
    for override, root in whole:
        try:
            compose([override], root=root)
            sound += 1
        except SealsError as refusal:
            yield "FAULT", override, _short(str(refusal))
    more = "" if full else "; all: seals doctor full=true"
    yield "ok", "compositions", f"{sound} of {len(whole)} compose{more}"


def data() -> Iterator[Remark]:
    """Report the folder of offline data sets."""
    folder = os.environ.get("SEALS_DATA")
    found = bool(folder) and Path(str(folder)).is_dir()
    words = str(folder) if found else "SEALS_DATA is not set to a folder: data sets are downloaded"
    yield "ok" if found else "note", "data", words


def _short(words: str) -> str:
    """Return the first line of an error, without the name shown beside it."""
    first = words.partition("\n")[0]
    return first.partition(" cannot be used: ")[2] or first


LOOKS = (python, packages, files, plug_ins, configuration, data)
"""What the doctor looks at, in order."""
