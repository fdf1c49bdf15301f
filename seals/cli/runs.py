"""``seals runs``: lists, filters and compares run folders."""

from __future__ import annotations

from seals.cli.hydra_app import Application, launch

_TEXTS = ("folder", "where", "metric", "sort", "table", "plot", "against", "by")


def runs(arguments: list[str]) -> int:
    """Run ``seals runs``: compose the configuration, then call its application."""
    # looking leaves nothing behind
    task = Application("seals.sweep.application", tidy=True)
    return launch("runs", [_quoted(word) for word in arguments], task)


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
