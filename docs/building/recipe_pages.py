"""Pages of what comes with SEALS as data: recipes, and the channels of a log."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from seals.config.roots import recipe_groups
from seals.logs.channels import CHANNELS

GROUPS = {
    "experiment": "`seals run experiment=NAME`; those that choose a reader: `seals compare`",
    "water": "`water=NAME`",
    "senses": "`+senses=NAME`, sets of sensors",
    "cameras": "`+cameras=NAME`",
    "sonar": "`+sonar=NAME`",
    "controller": "`controller=NAME`, beside the plug-ins",
    "env": "`seals train env=NAME`, and `evaluate`, `record`",
    "learner": "`learner=NAME`, beside the plug-ins",
    "grid": "`seals evaluate grid=NAME`",
}
"""How a recipe of each group is chosen; a group that is not here is listed by its name alone."""


def page() -> str:
    """Return the page of the recipes in Markdown, one chapter a group."""
    ours = Path(str(files("seals.conf")))
    parts = ["# Recipes", "Settings that have a name. `--cfg job` shows what one of them sets."]
    for group, paths in sorted(recipe_groups().items()):
        rows = [f"| `{path.stem}` | {_words(path)} |" for path in paths if ours in path.parents]
        if rows:
            table = "\n".join(["| name | |", "|---|---|", *rows])
            parts += [f"## {group}", GROUPS.get(group, f"`{group}=NAME`"), table]
    return "\n\n".join(parts) + "\n"


def channels() -> str:
    """Return the page of the channels of a log in Markdown."""
    rows = []
    for stem, channel in CHANNELS.items():
        ends = ["_1 .. _n"] if channel.numbered else [f"_{s}" for s in channel.suffixes]
        kind = "command" if channel.command else "aside" if channel.aside else "measured"
        rows.append(
            f"| `{stem}` | {', '.join(ends)} | {channel.unit} | {kind} | {channel.meaning} |"
        )
    head = ["| channel | components | unit | | meaning |", "|---|---|---|---|---|"]
    words = (
        "A column is a channel's name and a component, `position_x`. *Command*: an order that was "
        "sent, held until the next row. *Aside*: carried along; its noise need not be stated."
    )
    return "\n\n".join(["# Channels of a log", words, "\n".join([*head, *rows])]) + "\n"


def _words(path: Path) -> str:
    """The comment that a recipe begins with, up to its first full stop."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if "@package" not in line:
            lines.append(line.lstrip("# "))
    return " ".join(lines).split(". ")[0].replace("|", "\\|")
