"""The reference of plug-ins: a list a kind and a page each, made from the classes themselves."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import typing
from collections.abc import Iterator
from typing import Any

from docstrings import Words, words_of

from seals import registry
from seals.cli.describe import describe_robot
from seals.cli.listing import TITLES as TITLE
from seals.robot.robot_file import read_robot
from seals.schema import Parameter, parameters_of

OURS = "aam-seals"
TITLES = {kind: TITLE[kind] for kind in registry.GROUPS if kind != "conf"}
_HEAD = ["| field | default | bounds | tolerance | what it is; *source* |", "|---|---|---|---|---|"]


def pages() -> dict[str, str]:
    """Return the pages in Markdown by their place on the site, an overview first."""
    found = {"reference/index.md": _overview()}
    for kind, title in TITLES.items():
        parts = [f"# {title}", f"`seals describe {kind} NAME` prints what each page contains."]
        found[f"reference/{kind}.md"] = "\n\n".join([*parts, _listed(kind)]) + "\n"
        for plugin in installed(kind):
            found[f"reference/{kind}/{plugin.name}.md"] = _page(plugin) + "\n"
    return found


def installed(kind: str) -> list[registry.Plugin]:
    """Return the plug-ins of one kind that come with SEALS, by name."""
    return [p for p in registry.plugins(kind).values() if p.distribution == OURS]


def _overview() -> str:
    parts = [
        "# Plug-ins",
        "Everything that is installed with SEALS, read from its registry as this site is built. "
        "`seals list` shows what is installed at home, packages of others included. A name is what "
        "configurations use: `robot=aam`, `+effect@effects.breeze=wind`, `guide=hover`.",
    ]
    for kind, title in TITLES.items():
        parts += [f"## {title}", _listed(kind)]
    return "\n\n".join(parts) + "\n"


def _listed(kind: str) -> str:
    """The plug-ins of one kind, each with its page."""
    rows = [f"| [`{p.name}`]({kind}/{p.name}.md) | {_cell(p.summary)} |" for p in installed(kind)]
    return "\n".join(["| name | |", "|---|---|", *rows])


def _page(plugin: registry.Plugin) -> str:
    """One plug-in: its own words, and the table of its fields."""
    head = f"# {plugin.name}"
    if plugin.kind in registry.FOLDER_KINDS:
        room = f"{plugin.kind}s"
        page = f"[Sources of its numbers](../../{room}/{plugin.name}/README.md)"
        found = read_robot(plugin.folder(), name=plugin.name)
        heading = f"{plugin.kind} {plugin.name}  ({plugin.origin})"
        told = describe_robot(found, heading, folder=False)
        return f"{head}\n\n{plugin.summary.rstrip('.')}. {page}.\n\n```text\n{told}\n```"
    cls = plugin.load()
    words = words_of(inspect.getdoc(cls) or "")
    rows = list(_rows(cls, words))
    parts = [head, words.summary, f"`{plugin.value}`"]
    parts += ["\n".join([*_HEAD, *rows])] if rows else ["No fields."]
    parts += [words.section(name) for name in words.sections if name != "Args"]
    return "\n\n".join(parts)


def _rows(cls: Any, words: Words, prefix: str = "") -> Iterator[str]:
    """The fields of a plug-in's dataclass; those of a part within it stand under its name."""
    declared = parameters_of(cls)
    hints = typing.get_type_hints(cls)
    meanings = words.arguments()
    for field in dataclasses.fields(cls):
        if not field.init:
            continue
        default = _default(field)
        if dataclasses.is_dataclass(default) and not isinstance(default, type):
            part = type(default)
            within = words_of(inspect.getdoc(part) or "")
            yield from _rows(part, within, prefix=f"{prefix}{field.name}.")
            continue
        meaning = meanings.get(field.name, "")
        yield _row(f"{prefix}{field.name}", default, hints[field.name], meaning, declared)


def _row(name: str, default: Any, hint: Any, meaning: str, declared: dict[str, Parameter]) -> str:
    meta = declared.get(name.rpartition(".")[2])
    if meta is None:
        bounds, tolerance, source = _kind(hint), "", ""
        shown = f"`{_text(default)}`"
    else:
        low, high = meta.bounds
        bounds = f"{low:g} to {high:g}"
        amount = f"{meta.tolerance * 100:g} %" if meta.relative else f"{meta.tolerance:g}"
        tolerance = amount if meta.tolerance else ""
        source = f" *{_cell(meta.source)}*"
        unit = "" if meta.unit == "1" else f" {meta.unit}"
        shown = f"{default:g}{unit}" if isinstance(default, float) else f"`{_text(default)}`{unit}"
    return (
        f"| `{name}` | {_cell(shown)} | {_cell(bounds)} | {tolerance} | {_cell(meaning)}{source} |"
    )


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default is not dataclasses.MISSING:
        return field.default
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return "(required)"


def _text(value: Any) -> str:
    """A default as one writes it in YAML."""
    value = value.value if isinstance(value, enum.Enum) else value
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return "''" if value == "" else str(value)


def _kind(hint: Any) -> str:
    """The type of a field that is no physical parameter; an enumeration by its values."""
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return ", ".join(f"`{item.value}`" for item in hint)
    return f"`{getattr(hint, '__name__', None) if isinstance(hint, type) else hint}`".replace(
        "typing.", ""
    )


def _cell(text: str) -> str:
    """Text that stays within its cell of a table."""
    return text.replace("|", "\\|").replace("\n", " ")
