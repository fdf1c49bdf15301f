"""Filling in of the templates of ``seals new``."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from seals.errors import printable


def flow(value: Any) -> str:
    """Return a value as YAML in one line.

    Example:
        >>> flow({"type": "box", "size": [1.0, 0.5]})
        '{type: box, size: [1.0, 0.5]}'
    """
    import yaml

    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6)
    return text.removesuffix("...\n").strip()


def rendered(template: str, facts: Mapping[str, Any]) -> str:
    """Return a template of ``seals/scaffold/templates`` filled with values."""
    import jinja2

    source = (files("seals.scaffold.templates") / template).read_text(encoding="utf-8")
    environment = jinja2.Environment(
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
        autoescape=False,
        # no name of a file, a link or a plug-in begins a line of its own
        finalize=lambda value: printable(value) if isinstance(value, str) else value,
    )
    environment.filters["flow"] = flow
    return environment.from_string(source).render(**facts)
