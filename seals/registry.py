"""Registry of the installed plug-ins, found by entry points.

A plug-in is one object behind an entry point of the group ``seals.<kind>s``. Its module is imported
only when it is chosen, so one broken package never stops the others.
"""

from __future__ import annotations

import ast
import functools
import importlib
import importlib.util
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import (
    Distribution,
    EntryPoint,
    EntryPoints,
    distributions,
    entry_points,
)
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

from seals.errors import (
    BrokenPlugin,
    ConfigError,
    RobotError,
    SealsError,
    UnknownPlugin,
    refuse_unlisted,
)

GROUPS: Mapping[str, str] = MappingProxyType(
    {
        "backend": "seals.backends",
        "fluid": "seals.fluids",
        "wave": "seals.waves",
        "effect": "seals.effects",
        "robot": "seals.robots",
        "animal": "seals.animals",
        "actuator": "seals.actuators",
        "sensor": "seals.sensors",
        "controller": "seals.controllers",
        "guide": "seals.guides",
        "learner": "seals.learners",
        "task": "seals.tasks",
        "reader": "seals.readers",
        "viewer": "seals.viewers",
        "live": "seals.live",
        "conf": "seals.conf",
    }
)
"""Entry-point group of each kind of plug-in."""

FOLDER_KINDS = ("robot", "animal", "conf")
"""Kinds whose entry point names a package folder instead of a class."""


@dataclass(frozen=True, kw_only=True)
class Plugin:
    """One installed plug-in: name, location, package.

    Args:
        kind: singular kind, a key of ``GROUPS``.
        name: the name that configurations use.
        value: ``module:Class``, or a package folder for robots, animals and conf.
        distribution: name of the installed package that declares it.
        version: version of that package.
    """

    kind: str
    name: str
    value: str
    distribution: str
    version: str

    @property
    def origin(self) -> str:
        """Return the package and its version as text."""
        return f"{self.distribution} {self.version}"

    @property
    def summary(self) -> str:
        """Return the first docstring line, read from the source without importing the module.

        Raises:
            BrokenPlugin: the module, the class or the folder is missing.
        """
        if self.kind in FOLDER_KINDS:
            return _folder_summary(self)
        return _class_summary(self)

    def load(self) -> Any:
        """Import the module and return the plug-in's class.

        Raises:
            BrokenPlugin: the import fails; the cause is kept.
            MissingExtra: the plug-in says which optional dependency it needs.
        """
        module, _, attribute = self.value.partition(":")
        try:
            found: Any = importlib.import_module(module)
            for part in attribute.split(".") if attribute else ():
                found = getattr(found, part)
        except (SealsError, KeyboardInterrupt):
            raise
        except BaseException as cause:  # whatever a stranger's module raises, an exit among it
            raise self.broken(cause) from cause
        return found

    def folder(self) -> Path:
        """Return the package folder of a robot, an animal or a conf tree.

        Raises:
            BrokenPlugin: there is no such package.
        """
        try:
            return Path(str(files(self.value)))
        except KeyboardInterrupt:
            raise
        except BaseException as cause:  # importing the parent package runs foreign code
            raise self.broken(cause) from cause

    def broken(self, cause: BaseException) -> BrokenPlugin:
        """Return the error that names this plug-in, its package and the cause."""
        return BrokenPlugin(
            f"{self.kind} '{self.name}' ({self.value}) of {self.origin} cannot be used: "
            f"{type(cause).__name__}: {_one_line(cause)}.\n"
            f"Reinstall {self.distribution}, or see all broken plug-ins with: seals doctor"
        )


def plugins(kind: str) -> Mapping[str, Plugin]:
    """Return the installed plug-ins of one kind by name, sorted.

    Raises:
        ConfigError: there is no such kind, or two packages declare one name.

    Example:
        >>> "quadratic_drag" in plugins("effect")
        True
    """
    declared = _declared(kind)
    for name, candidates in declared.items():
        if len(candidates) > 1:
            owners = " and ".join(plugin.origin for plugin in candidates)
            raise ConfigError(
                f"{kind} '{name}' is declared by two packages: {owners}.\n"
                "Uninstall one of them, or ask its author for another name."
            )
    return MappingProxyType({name: candidates[0] for name, candidates in declared.items()})


def get(kind: str, name: str) -> Plugin:
    """Return one installed plug-in by kind and name, not yet imported.

    Raises:
        UnknownPlugin: nothing of that name is installed.
        ConfigError: there is no such kind, or two packages declare this name.

    Example:
        >>> get("effect", "gravity").name
        'gravity'
    """
    declared = _declared(kind)
    refuse_unlisted(
        name, declared, f"{kind} '{name}' is not installed", label="Installed", error=UnknownPlugin
    )
    return plugins(kind)[name] if len(declared[name]) > 1 else declared[name][0]


def blame(fault: BaseException) -> BrokenPlugin | None:
    """Return an error that names the plug-in in whose code a fault arose; None for no plug-in."""
    found = None
    trace = fault.__traceback__
    while trace is not None:
        code = trace.tb_frame.f_code
        owners = _owners().get(str(trace.tb_frame.f_globals.get("__name__")), ())
        within = getattr(code, "co_qualname", code.co_name)
        for plugin in sorted(owners, key=lambda p: within.startswith(p.value.partition(":")[2])):
            found = plugin, f"{Path(code.co_filename).name}, line {trace.tb_lineno}"
        trace = trace.tb_next
    if found is None:
        return None
    plugin, place = found
    return BrokenPlugin(
        f"{plugin.kind} '{plugin.name}' ({plugin.value}) of {plugin.origin} failed: "
        f"{type(fault).__name__}: {_one_line(fault)} ({place}).\n"
        "Correct it there, or do not use it; SEALS_DEBUG=1 shows the traceback"
    )


@functools.cache
def _owners() -> Mapping[str, tuple[Plugin, ...]]:
    """Plug-ins by the module of their class."""
    found: dict[str, list[Plugin]] = {}
    for kind in GROUPS:
        for many in _declared(kind).values() if kind not in FOLDER_KINDS else ():
            for plugin in many:
                found.setdefault(plugin.value.partition(":")[0], []).append(plugin)
    return MappingProxyType({module: tuple(many) for module, many in found.items()})


def default_backend() -> str:
    """Return the default rigid-body engine.

    PyBullet where it is installed; MuJoCo where it is not, as PyBullet has no wheel for that Python
    or machine.
    """
    return "pybullet" if importlib.util.find_spec("pybullet") else "mujoco"


def names(kind: str) -> list[str]:
    """Return the sorted installed names of one kind, without importing anything."""
    return list(_declared(kind))


def refresh() -> None:
    """Clear the cache, after packages were installed in a running process."""
    _declared.cache_clear()
    _points.cache_clear()
    _owners.cache_clear()
    importlib.invalidate_caches()


@functools.cache
def _declared(kind: str) -> Mapping[str, tuple[Plugin, ...]]:
    refuse_unlisted(kind, GROUPS, f"'{kind}' is not a kind of plug-in", label="Kinds")
    found: dict[str, list[Plugin]] = {}
    for point in _points().select(group=GROUPS[kind]):
        name, version = _owner(point.dist)
        own = Plugin(
            kind=kind, name=point.name, value=point.value, distribution=name, version=version
        )
        found.setdefault(point.name, []).append(own)
    return MappingProxyType({name: tuple(found[name]) for name in sorted(found)})


@functools.cache
def _points() -> Any:
    """Entry points of all packages: a look at them reads every package's own."""
    try:
        return entry_points()
    except Exception:  # one package's damaged list hides no other package
        every = (point for package in distributions() for point in _listed(package))
        # a package may be found twice
        return EntryPoints({(p.group, p.name, p.value): p for p in every}.values())


def damaged_lists() -> dict[str, str]:
    """Return why the entry points of packages cannot be read, by name; most often none."""
    found: dict[str, str] = {}
    for package in distributions():
        _listed(package, found)
    return found


def _listed(package: Distribution, faults: dict[str, str] | None = None) -> Iterable[EntryPoint]:
    try:
        return package.entry_points
    except Exception as cause:  # text of a stranger, parsed by the standard library
        if faults is not None:
            faults[_owner(package)[0]] = f"its entry_points.txt is damaged: {_one_line(cause)}"
        return ()


@functools.cache
def _owner(distribution: Distribution | None) -> tuple[str, str]:
    """Name and version of a package; each look at them reads its metadata again."""
    return (distribution.name, distribution.version) if distribution else ("unknown package", "?")


def _class_summary(plugin: Plugin) -> str:
    module, _, attribute = plugin.value.partition(":")
    try:
        spec = importlib.util.find_spec(module)
        if spec is None or spec.origin is None:
            raise ModuleNotFoundError(f"No module named '{module}'")
        found = _source_summary(Path(spec.origin), module, attribute)
    except KeyboardInterrupt:
        raise
    except BaseException as cause:  # a foreign parent package may raise anything
        raise plugin.broken(cause) from cause
    if found is None:
        # the class is built at run time or comes from another package: only an import can tell
        found = (plugin.load().__doc__ or "").strip()
    return found.partition("\n")[0]


def _source_summary(path: Path, module: str, name: str) -> str | None:
    """Find a class's docstring in a source file, or in the module that the package imports."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return ast.get_docstring(node) or ""
        if (
            isinstance(node, ast.ImportFrom)
            and node.module
            and node.module.startswith(f"{module}.")
        ):
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    inner = path.parent.joinpath(*node.module[len(module) + 1 :].split("."))
                    file = inner.with_suffix(".py")
                    return _source_summary(
                        file if file.is_file() else inner / "__init__.py", node.module, alias.name
                    )
    return None


def _folder_summary(plugin: Plugin) -> str:
    folder = plugin.folder()
    if plugin.kind == "conf":
        return str(folder)
    from seals.untrusted_io import read_file

    try:
        content = read_file(dict[str, Any], folder / "robot.yaml", error=RobotError)
    except SealsError as cause:
        raise plugin.broken(cause) from cause
    return str(content.get("summary") or "")


def _one_line(cause: BaseException) -> str:
    return " ".join(str(cause).split()).rstrip(".") or "no message"
