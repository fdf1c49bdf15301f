"""The page of the verbs: the very words of ``seals VERB --help``."""

from __future__ import annotations

import contextlib
import io

from seals.cli.main import VERBS, main


def page() -> str:
    """Return the page in Markdown, one chapter a verb."""
    parts = [
        "# Verbs",
        "What `seals VERB --help` prints. Keys are Hydra overrides: `KEY=VALUE`, `+KEY=VALUE` for "
        "one that is not there, `--multirun` for several values, `--cfg job` to see what is set.",
    ]
    for name in VERBS:
        parts += [f"## {name}", f"```text\n{_help(name)}\n```"]
    return "\n\n".join(parts) + "\n"


def _help(name: str) -> str:
    """What the command prints."""
    words = io.StringIO()
    with contextlib.redirect_stdout(words):
        main([name, "--help"])
    return words.getvalue().rstrip()
