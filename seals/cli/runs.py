"""``seals runs``: lists, filters and compares run folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.cli.hydra_app import discard, launch

_TEXTS = ("folder", "where", "metric", "sort", "table", "plot", "against", "by")


def runs(arguments: list[str]) -> int:
    """Run ``seals runs``: compose the configuration, then call its application."""
    return launch("runs", [_quoted(word) for word in arguments], _task)


def _quoted(word: str) -> str:
    """Return a word with its value quoted, because conditions hold characters of Hydra's grammar.

    Example:
        >>> _quoted("where=seed<5, state=done"), _quoted("runs/a")
        ("where='seed<5, state=done'", "folder='runs/a'")
    """
    if word.startswith("-"):
        return word
    key, sign, value = word.partition("=")
    if not sign:
        key, value = "folder", word
    if key not in _TEXTS or value[:1] in "'\"":
        return word if sign else f"{key}={value}"
    escaped = value.replace("'", "\\'")
    return f"{key}='{escaped}'"


def _task(config: Any) -> int | None:
    from hydra.core.hydra_config import HydraConfig

    from seals.sweep.application import execute

    try:
        return execute(config)
    finally:
        # looking leaves nothing behind
        discard(Path(HydraConfig.get().runtime.output_dir))
