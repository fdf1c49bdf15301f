"""``seals describe``: prints docstring and fields of a plug-in, with units and bounds."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator
from typing import Any

from seals import registry
from seals.cli.listing import singular
from seals.config.derive import schema_of
from seals.config.recipes import recipe_groups
from seals.errors import ConfigError
from seals.schema import parameters_of
from seals.text_table import table

_ENTRY = re.compile(r"^    (\w+): ", re.MULTILINE)
"""Name of a field under ``Args``."""


def describe(arguments: list[str]) -> int:
    """Print one plug-in's docstring and the table of its fields, or the file of a recipe."""
    if len(arguments) != 2:
        raise ConfigError(
            f"'{' '.join(arguments)}' is not a kind and a name.\n"
            "Write: seals describe KIND NAME, for instance: seals describe effect quadratic_drag"
        )
    kind, name = singular(arguments[0]), arguments[1]
    recipe = next((x for x in recipe_groups().get(kind, []) if x.stem == name), None)
    if recipe is not None and name not in registry.names(kind):
        print(f"{kind} {name}  (recipe, {recipe})\n\n{recipe.read_text(encoding='utf-8').strip()}")
        return 0
    plugin = registry.get(kind, name)
    if kind in ("robot", "animal"):
        print(describe_robot(plugin))
    elif kind == "conf":
        print(f"{name} ({plugin.origin})\n{plugin.folder()}")
    else:
        schema_of(plugin)
        cls = plugin.load()
        print(f"{kind} {name}  ({plugin.value}, {plugin.origin})\n")
        print(inspect.getdoc(cls) or "(no description)")
        for base, text in inherited_fields(cls):
            print(f"\nFields of {base}:\n{text}")
        print("\n" + fields_table(cls))
    return 0


def inherited_fields(cls: type) -> Iterator[tuple[str, str]]:
    """Yield the ``Args`` of the base classes by class; a field that stands twice is left out."""
    known = set(_ENTRY.findall(inspect.getdoc(cls) or ""))
    for base in cls.__mro__[1:-1]:
        text = inspect.cleandoc(base.__dict__.get("__doc__") or "")
        block = re.split(r"\n\n|\n(?=\S)", text.partition("Args:\n")[2])[0]
        parts = [part for part in re.split(r"\n(?=    \w)", block) if _ENTRY.findall(part)]
        new = [part for part in parts if not known & set(_ENTRY.findall(part))]
        if new:
            yield base.__name__, "\n".join(new)
        known |= set(_ENTRY.findall(text))


def fields_table(cls: type) -> str:
    """Return the fields of a plug-in's dataclass as a table with units and bounds."""
    rows: list[tuple[str, ...]] = [("field", "default", "unit", "bounds", "tolerance", "source")]
    declared = parameters_of(cls)
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(typing.cast(Any, cls)):
        default = field.default
        if field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        text = (
            "(required)"
            if default is dataclasses.MISSING
            else str(getattr(default, "value", default))
        )
        meta = declared.get(field.name)
        if meta is None:
            facts = (getattr(hints[field.name], "__name__", str(hints[field.name])), "", "", "")
        else:
            low, high = meta.bounds
            tolerance = f"{meta.tolerance * 100:g} %" if meta.relative else f"{meta.tolerance:g}"
            facts = (meta.unit, f"{low:g} to {high:g}", tolerance, meta.source)
        rows.append((field.name, text, *facts))
    return table(rows) if len(rows) > 1 else "  (no fields)"


def describe_robot(plugin: registry.Plugin, *, folder: bool = True) -> str:
    """Describe a robot or an animal: hulls, limbs, effects, drives, sensors.

    Args:
        plugin: the robot or animal.
        folder: whether the place of its files on this machine is told.
    """
    from seals.robot.robot_file import read_robot

    found = read_robot(plugin.folder(), name=plugin.name)
    settings = found.settings
    lines = [f"{plugin.kind} {plugin.name}  ({plugin.origin})", "", settings.summary]
    lines += [f"  folder  {settings.folder}"] if folder else []
    lines.append(f"  urdf    {settings.urdf}" + ("  (base fixed)" if settings.fixed_base else ""))
    for link, hull in found.hulls.items():
        shapes = [str(shape.get("type")) for shape in (hull or {}).get("shapes") or []]
        lines.append(f"  hull    {link}: {', '.join(shapes) or 'no shapes'}")
    lines += [f"  arm     {name}: {_limb(arm)}" for name, arm in found.limbs["arms"].items()]
    lines += [f"  gripper {name}: {_limb(hand)}" for name, hand in found.limbs["grippers"].items()]
    for section, parts in found.parts.items():
        for part, (name, values) in parts.items():
            # rows of a table stand below
            plain = {
                k: v
                for k, v in values.items()
                if not (isinstance(v, list) and v and isinstance(v[0], list))
            }
            given = ", ".join(f"{key}={value}" for key, value in plain.items())
            lines.append(f"  {section}.{part}  {name}  {given}".rstrip())
            for key in values.keys() - plain.keys():
                lines.append(f"    {key}:")
                lines += [f"      {list(row)}" for row in values[key]]
    return "\n".join(lines)


def _limb(settings: Any) -> str:
    """Return the entries of an arm or a gripper as in robot.yaml."""
    return ", ".join(f"{key}={value}" for key, value in settings.items() if value not in ("", []))
