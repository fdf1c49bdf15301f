"""``seals describe``: prints docstring and fields of a plug-in, with units and bounds."""

from __future__ import annotations

import dataclasses
import inspect
import textwrap
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from seals import registry
from seals.cli.listing import singular
from seals.cli.options import allowed, choices, default_of, entries
from seals.cli.words import names_of
from seals.config.derive import schema_of
from seals.config.roots import recipe_groups
from seals.config.source import is_robot_folder
from seals.errors import ConfigError, close_names, suggestion
from seals.robot.robot_file import RobotFile, read_robot
from seals.schema import parameters_of
from seals.text_table import table


def describe(arguments: list[str]) -> int:
    """Print one plug-in's docstring and the table of its fields, or the file of a recipe.

    A name alone is enough where one kind has it; ``KIND=NAME`` is read as ``KIND NAME``.
    """
    words = " ".join(arguments).replace("=", " ").split()
    kind, name = (singular(words[0]), words[1]) if len(words) == 2 else _alone(words)
    recipe = next((x for x in recipe_groups().get(kind, []) if x.stem == name), None)
    if recipe is not None and name not in registry.names(kind):
        print(f"{kind} {name}  (recipe, {recipe})\n\n{recipe.read_text(encoding='utf-8').strip()}")
        return 0
    if kind == "robot" and is_robot_folder(name):
        print(describe_robot(read_robot(Path(name)), f"robot {name}  (folder)"))
        return 0
    plugin = registry.get(kind, name)
    if kind in ("robot", "animal"):
        found = read_robot(plugin.folder(), name=plugin.name)
        print(describe_robot(found, f"{kind} {name}  ({plugin.origin})"))
    elif kind == "conf":
        print(f"{name} ({plugin.origin})\n{plugin.folder()}")
    else:
        schema_of(plugin)
        cls = plugin.load()
        print(f"{kind} {name}  ({plugin.value}, {plugin.origin})\n")
        print(inspect.getdoc(cls) or "(no description)")
        for base, text in _inherited_fields(cls):
            print(f"\nFields of {base}:\n{text}")
        print("\n" + _fields_table(cls))
    return 0


def _alone(words: Sequence[str]) -> tuple[str, str]:
    """Return kind and name of a plug-in or a recipe that is given by its name alone.

    Raises:
        ConfigError: no kind has the name, several have it, or it is a kind itself.
    """
    kinds = list(dict.fromkeys([*registry.GROUPS, *recipe_groups()]))
    write = "Write: seals describe KIND NAME, for instance: seals describe effect quadratic_drag"
    if len(words) != 1:
        given = f"'{' '.join(words)}' is not a kind followed by a name"
        said = given if words else "nothing is named"
        raise ConfigError(f"{said}.\n{write}")
    word = words[0]
    if is_robot_folder(word):
        return "robot", word
    if singular(word) in kinds:
        hint = suggestion("", names_of(singular(word)), label="Names")
        raise ConfigError(f"the {singular(word)} is not given.\n{hint}")
    found = [f"{kind} {name}" for kind in kinds for name in close_names(word, names_of(kind))]
    same = [one for one in found if one.split()[1] == word]
    if len(same) == 1:
        return same[0].split()[0], word
    held = [one for one in found if word in one]
    hint = " or ".join(f"seals describe {one}" for one in (same or held or found)[:6])
    what = "several kinds have" if same else "no kind has"
    raise ConfigError(f"{what} the name '{word}'.\n{f'Write: {hint}' if hint else write}")


def _inherited_fields(cls: type) -> Iterator[tuple[str, str]]:
    """Yield the ``Args`` of the base classes by class; a field that stands twice is left out."""
    known = set(entries(cls))
    for base in cls.__mro__[1:-1]:
        new = {name: text for name, text in entries(base).items() if name not in known}
        if new:
            lines = (textwrap.fill(f"{name}: {text}", 92) for name, text in new.items())
            yield base.__name__, textwrap.indent("\n".join(lines), "    ")
        known |= set(new)


def _fields_table(cls: type) -> str:
    """Return the fields of a plug-in's dataclass as a table with units and bounds."""
    rows: list[tuple[str, ...]] = [("field", "default", "unit", "allowed", "tolerance", "source")]
    declared = parameters_of(cls)
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(typing.cast(Any, cls)):
        missing = dataclasses.MISSING
        required = field.default is missing and field.default_factory is missing
        text = "(required)" if required else default_of(field)
        meta = declared.get(field.name)
        if meta is None:
            hint = hints[field.name]
            kind = "" if choices(hint) else getattr(hint, "__name__", str(hint))
            facts = (kind, allowed(cls, field.name), "", "")
        else:
            low, high = meta.bounds
            tolerance = f"{meta.tolerance * 100:g} %" if meta.relative else f"{meta.tolerance:g}"
            facts = (meta.unit, f"{low:g} to {high:g}", tolerance, meta.source)
        rows.append((field.name, text, *facts))
    return table(rows) if len(rows) > 1 else "  (no fields)"


def describe_robot(found: RobotFile, heading: str, *, folder: bool = True) -> str:
    """Describe a robot or an animal: hulls, limbs, effects, drives, sensors.

    Args:
        found: the file of the robot or animal.
        heading: first line.
        folder: whether the place of its files on this machine is told.
    """
    settings = found.settings
    lines = [heading, "", settings.summary]
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
