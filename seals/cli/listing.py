"""``seals list``: installed plug-ins, read without importing them."""

from __future__ import annotations

from pathlib import Path

from seals import registry
from seals.config.roots import recipe_groups
from seals.errors import BrokenPlugin, ConfigError, suggestion
from seals.text_table import table

TITLES = {
    "backend": "Backends: rigid bodies and free motion",
    "fluid": "Fluids: simulated water",
    "wave": "Waves",
    "effect": "Effects: forces, inertias, faults",
    "actuator": "Actuators",
    "sensor": "Sensors",
    "controller": "Controllers",
    "guide": "Guides: reference generators",
    "task": "Tasks for learners",
    "learner": "Learners",
    "reader": "Readers of logs",
    "viewer": "Viewers and renderers",
    "live": "Live outputs to other programs",
    "robot": "Robots",
    "animal": "Animals",
    "conf": "Packages of configurations",
    "cameras": "Sets of cameras of a robot: +cameras=NAME",
    "senses": "Sets of sensors of a robot: +senses=NAME",
    "sonar": "Presets of a sonar: +sonar=NAME",
    "water": "Models of water",
    "env": "Learning environments: task, robot and world",
    "grid": "World variants in which a policy is evaluated: grid=NAME",
    "experiment": "Recipes of runs and comparisons",
}
"""What the kinds of plug-ins, and of files of configuration, are."""


def list_installed(arguments: list[str]) -> int:
    """Print the installed plug-ins of one kind, or of all kinds, with their package and summary."""
    recipes = recipe_groups()
    kinds = list(dict.fromkeys([*registry.GROUPS, *recipes]))
    if len(arguments) > 1:
        raise ConfigError(
            f"'{' '.join(arguments)}' contains more than one kind.\n"
            f"Write: seals list {arguments[0]}, or seals describe {' '.join(arguments[:2])}"
        )
    if arguments and singular(arguments[0]) not in kinds:
        raise ConfigError(
            f"'{arguments[0]}' is not a kind of "
            f"plug-in.\n{suggestion(arguments[0], kinds, label='Kinds')}"
        )
    chosen = [singular(arguments[0])] if arguments else kinds
    blocks = []
    for kind in chosen:
        rows = _rows(kind, recipes.get(kind, []))
        if rows or arguments:
            head = f"{kind}   {TITLES.get(kind, '')}".rstrip()
            blocks.append(f"{head}\n" + (table(rows) if rows else "  (none installed)"))
    print("\n\n".join(blocks))
    return 0


def _rows(kind: str, recipes: list[Path]) -> list[tuple[str, ...]]:
    """Plug-ins of a kind, and recipes: files of values for one of them, or for several."""
    found: list[tuple[str, str]] = []
    for path in recipes:
        words = [
            line.lstrip("# ")
            for line in path.read_text(encoding="utf-8").splitlines()[:3]
            if line.startswith("#") and "@package" not in line
        ]
        found.append((path.stem, words[0] if words else ""))
    if kind not in registry.GROUPS:
        return [*found]
    rows: list[tuple[str, ...]] = []
    for name, plugin in registry.plugins(kind).items():
        try:
            # marks of code are for the documentation
            summary = plugin.summary.replace("``", "")
        except BrokenPlugin as broken:
            summary = "broken: " + str(broken).partition("cannot be used: ")[2].partition("\n")[0]
        rows.append((name, plugin.origin, summary))
    return [*rows, *((name, "recipe", words) for name, words in found)]


def singular(word: str) -> str:
    """Return the singular of a kind: both ``effect`` and ``effects`` are accepted.

    Example:
        >>> singular("effects"), singular("dvls")
        ('effect', 'dvls')
    """
    return word[:-1] if word.endswith("s") and word[:-1] in registry.GROUPS else word
