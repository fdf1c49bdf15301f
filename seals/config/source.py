"""Hydra config source of the installed plug-ins; only the chosen ones are imported.

Hydra's own ConfigStore needs every schema imported beforehand, copies all of them whenever it
composes and sends them with every job of a sweep. This source answers Hydra's questions from the
registry's names and derives a schema when its option is chosen, so that a heavy or broken package
costs nothing until it is wanted.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import os
from pathlib import Path
from typing import Any, cast

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.core.plugins import Plugins
from hydra.plugins.config_source import ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import Container, OmegaConf

from seals import registry
from seals.config import roots
from seals.config.derive import schema_of
from seals.config.overlay import find_overlay, load_overlay, overlay_names
from seals.config.roots import OPEN, conf_folders
from seals.errors import ConfigError
from seals.file_names import checked_name
from seals.robot.robot_file import PARTS, RobotFile, read_robot

ROBOT_KINDS = ("robot", "animal")
CLASS_GROUPS = tuple(kind for kind in registry.GROUPS if kind not in registry.FOLDER_KINDS)
"""Hydra groups, one for each kind of plug-in; animals are options of the group ``robot``."""
MODEL = "model"
"""Hydra group of the models that diagnoses made: ``models/NAME.yaml`` is ``model=NAME``."""

SURROUNDING = ("effects", "gravity", "gravity")
"""Effect that the folder of a robot as it was used states; every run chooses it itself."""

OWN = "of."
"""In front of a robot's name: the controller that its ``robot.yaml`` chooses, with its values."""


class PluginSource(ConfigSource):
    """Hydra config source of plug-ins and robots: ``effect/gravity``, ``robot/ball``.

    The schemas of the root configurations, such as ``run_schema``, are configurations of no group.
    """

    @staticmethod
    def scheme() -> str:
        """Return the scheme that search paths name this source by."""
        return "seals"

    def available(self) -> bool:
        """Return True: the registry is always available."""
        return True

    def is_group(self, config_path: str) -> bool:
        """Return whether a path is one of the groups of plug-ins."""
        return config_path.rstrip("/") in ("", "robot", MODEL, *CLASS_GROUPS)

    def is_config(self, config_path: str) -> bool:
        """Return whether a path is an installed plug-in or a robot folder."""
        group, _, name = config_path.partition("/")
        if config_path in roots.NAMES:
            return True
        if group == "robot":
            return name in robot_names() or is_robot_folder(name)
        if group == MODEL:
            return find_overlay(name) is not None
        if group == "controller" and name.startswith(OWN):
            robot = name.removeprefix(OWN)
            return robot in robot_names() or is_robot_folder(robot)
        return group in CLASS_GROUPS and name in registry.names(group)

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Return the options of a group, or the groups."""
        group = config_path.rstrip("/")
        if group == "":
            groups = [] if results_filter == ObjectType.CONFIG else ["robot", MODEL, *CLASS_GROUPS]
            return sorted(groups if results_filter == ObjectType.GROUP else [*groups, *roots.NAMES])
        if results_filter == ObjectType.GROUP:
            return []
        if group == MODEL:
            return overlay_names()
        return robot_names() if group == "robot" else registry.names(group)

    def load_config(self, config_path: str) -> ConfigResult:
        """Return the typed config node of the chosen plug-in or robot."""
        group, _, name = config_path.partition("/")
        if config_path in roots.NAMES:
            node = _typed_node(roots.root_schema(config_path))
        elif group == "robot":
            node = _robot_option(name)
        elif group == MODEL:
            # a model overlay as a Hydra option
            path = find_overlay(name)
            if path is None:
                raise ConfigError(
                    f"model '{name}' no longer exists.\nModels are in the folder models/"
                )
            node = OmegaConf.create(load_overlay(path))
        elif group == "controller" and name.startswith(OWN):
            ((plugin, values),) = find_robot(name.removeprefix(OWN)).parts["controller"].values()
            typed = _typed_node(schema_of(registry.get("controller", plugin)))
            merged: Any = OmegaConf.merge({"controller": typed}, {"controller": values})
            node = cast(Container, merged.controller)
        else:
            node = _typed_node(schema_of(registry.get(group, name)))
        return ConfigResult(
            provider=self.provider,
            path=f"{self.scheme()}://{config_path}",
            config=node,
            header={"package": "_global_" if group == "robot" else None},
        )


class ConfSearchPath(SearchPathPlugin):
    """Hydra search path with the conf packages of all installed distributions and the plug-ins.

    Attributes:
        folder: of the command line, after them.
    """

    folder: str | None = None

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Add ``pkg://`` paths of the ``seals.conf`` entry points and the source ``seals://``."""
        known = {entry.path for entry in search_path.get_path()}
        for plugin, folder in conf_folders():
            if f"pkg://{plugin.value}" not in known and folder.is_dir():
                search_path.append(plugin.name, f"pkg://{plugin.value}")
        search_path.append("plug-ins", "seals://")
        if self.folder is not None:
            search_path.append("command-line", f"file://{os.path.abspath(self.folder)}")


def install(folder: str | None = None) -> None:
    """Register source, search path and resolver with Hydra; calling twice is harmless.

    Args:
        folder: of further configurations, as ``--config-dir`` names it.
    """
    ConfSearchPath.folder = folder
    OmegaConf.register_new_resolver("default_backend", registry.default_backend, replace=True)
    # a name comes from anybody's file, and Hydra makes its folder before a verb sees it
    OmegaConf.register_new_resolver("folder_name", folder_name, replace=True)
    hub = Plugins.instance()
    hub.register(PluginSource)
    hub.register(ConfSearchPath)


def folder_name(name: Any) -> str:
    """Return the name of a run as a part of its folder; ``seals add`` may have none.

    Raises:
        ConfigError: it cannot be part of a folder's name.
    """
    return checked_name(str(name), key="name") if name else ""


def robot_names() -> list[str]:
    """Return the names of installed robots and animals, sorted."""
    return sorted({name for kind in ROBOT_KINDS for name in registry.names(kind)})


def is_robot_folder(name: str) -> bool:
    """Return whether a value of ``robot=`` is a folder with a ``robot.yaml``."""
    return bool(name) and os.path.isfile(Path(name) / "robot.yaml")


def find_robot(name: str) -> RobotFile:
    """Read an installed robot by name, or a robot folder by path.

    Raises:
        UnknownPlugin: there is neither.
        RobotError: its ``robot.yaml`` cannot be used.
    """
    for kind in ROBOT_KINDS:
        if name in registry.names(kind):
            return read_robot(registry.get(kind, name).folder(), name=name)
    if is_robot_folder(name):
        return read_robot(Path(name))
    registry.get("robot", name)
    raise ConfigError(f"robot '{name}' no longer exists.\nSee: seals list robot")


def _robot_option(name: str) -> Container:
    """Return a robot as a Hydra option: its plug-ins as a defaults list, its values as the body.

    Every effect, sensor and actuator of the robot is thereby a typed node of its own, open to
    overrides such as ``effects.hull_drag.coefficient_x=4``.
    """
    found = find_robot(name)
    defaults: list[Any] = []
    overrides: list[Any] = []
    body: dict[str, Any] = {}
    for section, parts in found.parts.items():
        if section == "guide":
            # what it does as an object; a robot of a run is told by the run
            continue
        for part, (plugin, values) in parts.items():
            if section == "controller":
                # the root names the group already, with nothing chosen; the values come with the
                # option, so that they go when another controller is chosen
                overrides.append({"override /controller": f"{OWN}{name}"})
            elif (section, part, plugin) != SURROUNDING:
                defaults.append({f"/{PARTS.get(section, section)}@{section}.{part}": plugin})
                body.setdefault(section, {})[part] = values
    settings = found.settings
    body["robot"] = {
        "name": settings.name,
        "folder": settings.folder,
        "urdf": settings.urdf,
        "fixed_base": settings.fixed_base,
        "hulls": found.hulls,
        **found.limbs,
        "summary": settings.summary,
    }
    return OmegaConf.create({"defaults": [*defaults, "_self_", *overrides], **body})


def _typed_node(schema: type) -> Container:
    """Return a modifiable node of a schema, copied from a cache."""
    return copy.deepcopy(_read_schema(schema))


@functools.cache
def _read_schema(schema: type) -> Container:
    node: Container = OmegaConf.structured(schema)
    for key in OPEN.intersection(field.name for field in dataclasses.fields(schema)):
        OmegaConf.set_struct(node[key], False)
    return node
