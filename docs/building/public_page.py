"""The reference page of the public names of the package ``seals``, made from their docstrings."""

from __future__ import annotations

import ast
import enum
import inspect
import itertools
import re
from importlib import import_module
from typing import Any

from docstrings import Words, words_of

import seals

CHAPTERS = {
    "Simulation": (
        "make",
        "make_batch",
        "simulate",
        "World",
        "BatchDynamics",
        "Ledger",
        "load_robot",
        "RobotModel",
        "list_plugins",
    ),
    "Identification": ("MissingEffect", "calibrate", "Calibrator"),
    "Logs": ("load_log", "load_logs", "write_log", "Log", "check_reader"),
    "Effects of your own": (
        "Effect",
        "param",
        "setting",
        "check_effect",
        "MediumKind",
        "Motion",
        "Medium",
        "Joints",
        "by_joint",
        "Inputs",
        "Wrench",
        "Parameters",
        "Identification",
        "Array",
        "namespace",
        "columns",
        "cross",
    ),
    "Controllers, guides and tasks of your own": (
        "Plant",
        "RobotState",
        "Reference",
        "ActuatorCommand",
        "Goal",
        "ControllerOptions",
        "Allocation",
        "state_record",
        "check_controller",
        "check_guide",
        "check_task",
    ),
    "Sensors of your own": ("Instrument", "SensorInput", "Noise", "check_sensor"),
    "Errors": ("SealsError", "ConfigError", "LogError", "RobotError", "PhysicsError"),
}
"""Public names by chapter of the page; ``__version__`` stands in the introduction."""

_INTRODUCTION = """\
# Public names

Everything on this page is imported from `seals`:

```python
from seals import MissingEffect, World, load_log, make
```

**Stability.** These names, the command line (verbs, options, exit codes, names of plug-ins), the
groups of entry points and the [file formats](../formats.md) are the public interface. A patch
version (the third number) keeps all of it. Until 1.0 a minor version (the second number) may change
it, after 1.0 a major version alone; the [changelog](../changelog.md) lists each change with what to
do. Every other module, class and function, even where a page shows it, may move or change without
notice. `seals.__version__` is the version as
text. A name is imported when it is first used: `import seals` loads no other module."""


def page() -> str:
    """Return the page in Markdown."""
    parts = [_INTRODUCTION]
    for title, names in CHAPTERS.items():
        parts += [f"## {title}", *(_chapter(name) for name in names)]
    return "\n\n".join(parts) + "\n"


def _chapter(name: str) -> str:
    """One name: its signature, then its docstring."""
    found: Any = getattr(seals, name)
    words = words_of(_docstring(name, found))
    head = f"### `{name}` {{ #{name} }}"
    parts = [head, f"```python\n{_signature(name, found)}\n```", words.summary]
    parts += [
        _section(words, key) for key, text in words.sections.items() if text and key != "Args"
    ]
    rows = [f"| `{key}` | {text} |" for key, text in words.arguments().items()]
    if rows:
        parts.insert(3, "\n".join(["| argument | |", "|---|---|", *rows]))
    if inspect.isclass(found):
        parts += _methods(found)
    return "\n\n".join(parts)


def _section(words: Words, name: str) -> str:
    """One section; entries such as errors and attributes as a list."""
    if name not in ("Raises", "Attributes"):
        return words.section(name)
    lines = re.sub(r"\n\s+", " ", words.sections[name]).splitlines()
    return "\n".join([f"**{name}**", "", *(f"- {line}" for line in lines)])


def _methods(cls: type) -> list[str]:
    """Public methods and properties that a class defines itself, with their first line."""
    rows = []
    for name, member in vars(cls).items():
        text = inspect.getdoc(member) if callable(member) or isinstance(member, property) else None
        if text and not name.startswith("_") and not inspect.isclass(member):
            call = name if isinstance(member, property) else f"{name}()"
            rows.append(f"| `{call}` | {words_of(text).summary.partition(chr(10))[0]} |")
    return ["\n".join(["| member | |", "|---|---|", *rows])] if rows else []


def _signature(name: str, found: Any) -> str:
    """The call of a function or class, wrapped by argument where it is long."""
    text = re.sub(r"(: |-> )'([^']+)'", r"\1\2", _as_inspected(name, found))
    return re.sub(r"ForwardRef\('([^']+)'\)", r"\1", text)


def _as_inspected(name: str, found: Any) -> str:
    """The signature with annotations as `inspect` gives them: in quotes."""
    if inspect.isclass(found) and issubclass(found, Exception):
        return f"class {name}({found.__base__.__name__})"
    if inspect.isclass(found) and issubclass(found, enum.Enum):
        return f"{name}: {', '.join(member.name for member in found)}"
    if _is_alias(found):
        return name
    signature = inspect.signature(found)
    line = f"{name}{signature}"
    if len(line) <= 88:
        return line
    arguments = [str(p) for p in signature.parameters.values()]
    kinds = [p.kind for p in signature.parameters.values()]
    if inspect.Parameter.KEYWORD_ONLY in kinds:
        arguments.insert(kinds.index(inspect.Parameter.KEYWORD_ONLY), "*")
    gives = signature.return_annotation
    back = "" if gives is inspect.Signature.empty else f" -> {gives}"
    return "\n".join([f"{name}(", *(f"    {argument}," for argument in arguments), f"){back}"])


def _docstring(name: str, found: Any) -> str:
    """The docstring; of a type alias, the text below its assignment."""
    if not _is_alias(found):
        return inspect.getdoc(found) or ""
    body = ast.parse(inspect.getsource(import_module(seals._HOMES[name]))).body
    for before, after in itertools.pairwise(body):
        target = getattr(before, "target", None)
        if getattr(target, "id", None) == name and isinstance(after, ast.Expr):
            return inspect.cleandoc(ast.literal_eval(after.value))
    return ""


def _is_alias(found: Any) -> bool:
    """Return whether a name stands for a type of another package."""
    return not str(getattr(found, "__module__", "")).startswith("seals.")
