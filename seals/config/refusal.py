"""Conversion of errors of Hydra and OmegaConf to two-line messages.

They say where a name that is out of place belongs (another group or section, an effect, a sensor),
and which folder a mistyped ``robot=`` may mean.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shlex import quote
from typing import Any

from seals import registry
from seals.config.overrides import value_of
from seals.config.roots import VERBS, recipe_groups, root_schema, roots_choosing
from seals.errors import ConfigError, SealsError, UnknownPlugin, nearest, suggestion
from seals.schema import parameters_of

_DRAWN = (".urdf", ".xacro", ".sdf", ".xml")
"""Endings of files that a robot can be made of."""
_MOST = 200
"""Neighbours that are looked at."""


def _unknown_robot(given: str, installed: Sequence[str]) -> UnknownPlugin:
    """Return the error for a robot that is neither installed nor a folder."""
    path = Path(given)
    urdf = path if path.is_file() and path.suffix in _DRAWN else None
    if path.is_dir():
        urdf = next(iter(sorted([*path.glob("*.urdf"), *path.glob("*/*.urdf")])), None)
    close = nearest(given, _folders(path.parent if "/" in given else Path()))
    if path.is_file() and (path.parent / "robot.yaml").is_file():
        what, advice = "is a file", f"Give its folder: robot={path.parent.as_posix()}"
    elif urdf is not None:
        name = urdf.stem.lower().replace("-", "_").replace(".", "_")
        what = "holds no robot.yaml"
        advice = f"Create a robot folder from the URDF first: seals new robot my_{name} urdf="
        advice += quote(str(urdf))
    elif given and path.exists():
        what = "exists here, but contains no robot.yaml"
        advice = "Create one from a URDF: seals new robot NAME urdf=FILE, or see: seals list robot"
    elif path.suffix in _DRAWN:
        what = "is neither installed nor an existing file"
        advice = "A robot is a folder. Create one from such a file: seals new robot NAME urdf=FILE"
    elif close is not None:
        what = "is neither installed nor a folder with robot.yaml"
        advice = f"Did you mean '{close}'?  Installed: {', '.join(installed)}"
    elif "/" in given:
        advice = suggestion(
            given, installed, label="Give such a folder, or the name of an installed robot"
        )
        return UnknownPlugin(
            f"robot={given}: there is no folder '{given}' with a robot.yaml.\n{advice}"
        )
    else:
        what, advice = "is not installed", suggestion(given, installed, label="Installed")
        if given and nearest(given, installed) is None:
            what = "is neither installed nor an existing folder"
            advice = f"Make your own: seals new robot NAME urdf=FILE.  {advice}"
    return UnknownPlugin(f"robot '{given}' {what}.\n{advice}")


def own_robot(given: str) -> Path:
    """Return a robot folder that can be written to.

    Raises:
        ConfigError: it is no robot folder; the nearest one beside it is named.
    """
    folder = Path(given)
    if (folder / "robot.yaml").is_file():
        return folder
    close = nearest(given, _folders(folder.parent))
    hint = f"Did you mean '{close}'?  " if close else ""
    raise ConfigError(
        f"robot={given} is not one of your robot folders.\n"
        f"{hint}Make one: seals new robot NAME urdf=FILE"
    )


def _folders(place: Path) -> list[str]:
    """Robot folders in a place."""
    try:
        neighbours = list(place.iterdir())[:_MOST]
    except OSError:
        return []
    return [p.as_posix() for p in neighbours if (p / "robot.yaml").is_file()]


_ADDED = ("effect", "sensor")
"""Kinds of plug-ins that are added under a name."""


def added(name: str, *, section: str = "") -> str | None:
    """Return the word that adds an effect or a sensor; None for other names.

    Args:
        name: of a plug-in.
        section: under which it is added, by default the plug-in's own name.

    Example:
        >>> added("wind")
        '+effect@effects.wind=wind'
    """
    kinds = [kind for kind in _ADDED if name in registry.names(kind)]
    return f"+{kinds[0]}@{kinds[0]}s.{section or name}={name}" if kinds else None


def _group_of(option: str, group: str) -> str | None:
    """Return another group of recipes that has an option of this name, or None.

    Example:
        >>> _group_of("fossen", "fluid")
        'water'
    """
    found = (name for name, paths in recipe_groups().items() if option in {p.stem for p in paths})
    return next((name for name in sorted(found) if name != group), None)


def _options_of(group: str) -> set[str]:
    """Return the names that a group may be set to.

    Example:
        >>> "airy" in _options_of("wave")
        True
    """
    kinds = registry.names(group) if group in registry.GROUPS else []
    return {*kinds, *(path.stem for path in recipe_groups().get(group, []))}


def _verbs_with(key: str) -> list[str]:
    """Return the verbs of which a name is a key by itself.

    Example:
        >>> _verbs_with("span")
        ['convert']
    """
    return [name for name in VERBS if key in root_schema(name).__dataclass_fields__]


def _home_of(key: str, node: Any, *, depth: int = 2) -> str | None:
    """Return the full key of a value that has this last name in a configuration, or None.

    Args:
        key: last part of a key.
        node: configuration to look in.
        depth: of sections below it.
    """
    from omegaconf import OmegaConf

    if depth == 0 or not OmegaConf.is_dict(node):
        return None
    for name in node:
        if OmegaConf.is_missing(node, name) or OmegaConf.is_interpolation(node, name):
            continue
        below = node[name]
        if name == key and not OmegaConf.is_dict(below):
            return str(key)
        found = _home_of(key, below, depth=depth - 1)
        if found is not None:
            return f"{name}.{found}"
    return None


_WORDS = {
    "Float": "a number",
    "Integer": "a whole number",
    "Boolean": "true or false",
    "String": "text",
}
_LIST = "Allowed: a list in brackets, for instance [a,b]"
_SLIP = 0.8
"""Likeness from which a key is a mistyped one of its own section [1]."""
_FEW = 7
"""Most verbs that are named for a key that is theirs."""


@contextmanager
def refusals(
    overrides: Sequence[str], *, root: str = "run", several: bool = False
) -> Iterator[None]:
    """Convert errors of Hydra and OmegaConf inside the block to a ConfigError.

    Args:
        overrides: what the user wrote, to name the offending one.
        root: name of the root configuration, for the advice to look at ``--cfg job``.
        several: whether it is a sweep, in which a word may have several values.

    Raises:
        SealsError: the two-line refusal; the original is its cause.
    """
    import yaml
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    try:
        yield
    except yaml.MarkedYAMLError as error:
        place = error.problem_mark or error.context_mark
        where = f"{place.name}, line {place.line + 1}" if place else "a file of configuration"
        raise ConfigError(f"{where} is not valid YAML: {error.problem}.\nCorrect it.") from error
    except (HydraException, OmegaConfBaseException) as error:
        refusal = _explain(error, overrides, root=root)
        if isinstance(error, HydraException):
            refusal = _of_words(overrides, several) or refusal
        raise refusal from error
    except RecursionError as error:
        raise ConfigError(
            "the configuration refers to itself, or is nested too deeply.\n"
            "Look for a reference ${...}, or a list of defaults, that leads back to itself"
        ) from error
    except ValueError as error:
        _refuse_key_of_list(error, overrides)
        if "Config group override" not in str(error):
            raise
        raise ConfigError(
            "a group is set to null, or to a value that is not a name.\n"
            "To leave a group out, use ~GROUP; to choose an option, GROUP=NAME"
        ) from error


def _refuse_key_of_list(error: ValueError, overrides: Sequence[str]) -> None:
    """Refuse a name where an entry of a list is numbered; OmegaConf raises a plain ValueError.

    Raises:
        ConfigError: an override has such a name.
    """
    name = re.search(r"invalid literal for int\(\) with base 10: '(.*)'", str(error))
    if name is None:
        return
    for override in overrides:
        stem, found, _ = override.partition("=")[0].partition(f".{name.group(1)}")
        if found:
            raise ConfigError(
                f"{override}: {stem} is a list, which has no '{name.group(1)}'.\n"
                f"Number its entries from 0: {stem}.0=VALUE; or give the whole list, in brackets."
            ) from error


def _explain(error: BaseException, overrides: Sequence[str], *, root: str) -> SealsError:
    """Return a ConfigError that explains an error of Hydra or OmegaConf."""
    chain: list[BaseException] = [error]
    while (link := chain[-1].__cause__ or chain[-1].__context__) is not None:
        chain.append(link)
    for link in chain:
        if isinstance(link, SealsError):
            return link
    said = re.search(r"ConfigError raised while resolving interpolation: (.*\n.*)", str(error))
    if said:
        return ConfigError(said.group(1))
    elsewhere = _elsewhere(error, chain, root)
    if elsewhere is not None:
        return elsewhere
    missing = getattr(error, "missing_cfg_file", None)
    if missing:
        return _missing_option(str(missing), list(getattr(error, "options", None) or []))
    keyed = next((link for link in chain if getattr(link, "full_key", None)), None)
    if keyed is not None:
        return _keyed(keyed, str(error), overrides, root=root)
    return _by_words(str(error), overrides, root=root)


def _elsewhere(
    error: BaseException, chain: Sequence[BaseException], root: str
) -> ConfigError | None:
    """Explain a group that belongs to other verbs; None for others."""
    asked = re.search(r"Could not override '(\w+)'", str(error))
    keys = [str(getattr(link, "full_key", "")) for link in chain]
    group = asked.group(1) if asked else next((key for key in keys if key), "")
    roots = roots_choosing(group) if group.isidentifier() else []
    if not roots or root in roots:
        return None
    verbs = " or ".join(f"seals {name}" for name in roots)
    here = f"seals {root}" if root in VERBS else "this configuration"
    return ConfigError(f"{here} does not know {group}=.\nIt belongs to {verbs}.")


def _missing_option(path: str, options: list[str]) -> SealsError:
    group, slash, name = path.partition("/")
    if not slash:
        return ConfigError(
            f"there is no configuration '{path}'.\n"
            f"{suggestion(path, options or ['run', 'compare'])}"
        )
    if group == "model" and not options:
        return ConfigError(
            f"model={name} does not exist.\n"
            "There is none yet. Make one: seals add diagnosis=FOLDER name=NAME"
        )
    if group == "robot" and name:
        return _unknown_robot(name, options)
    label = "Installed" if group in registry.GROUPS else "Allowed"
    if name == "":
        return ConfigError(f"{group}= has no value.\n{suggestion(name, options, label=label)}")
    other = _group_of(name, group)
    if group == "env" and name in registry.names("task"):
        other = "task"
    hint = f"Write {other}={name}.  " if other else ""
    if name == "none":
        # several groups have such an option, none of which is meant
        hint = f"To leave the {group} out, use ~{group}.  "
    hint += suggestion(name, options, label=label)
    if group in registry.GROUPS:
        return UnknownPlugin(f"{group} '{name}' is not installed.\n{hint}")
    return ConfigError(f"{group}={name} does not exist.\n{hint}")


def _keyed(cause: BaseException, outer: str, overrides: Sequence[str], *, root: str) -> SealsError:
    """Explain an error about one key: unknown, of a wrong type, or without value."""
    from omegaconf.errors import (
        ConfigAttributeError,
        ConfigKeyError,
        InterpolationResolutionError,
        MissingMandatoryValue,
    )

    full_key = str(getattr(cause, "full_key", ""))
    key = str(getattr(cause, "key", full_key))
    text = str(cause).partition("\n")[0].rstrip(".")
    source = re.match(r"In '([^']+)'", outer)
    origin = f" (in {source.group(1)})" if source else ""
    parent = getattr(cause, "parent_node", None)
    if isinstance(cause, ConfigKeyError | ConfigAttributeError):
        asked = re.match(r"Could not override '([^']+)'", outer)
        shown = asked.group(1) if asked else full_key
        scope = full_key.rpartition(".")[0]
        place = f"of {scope}" if scope else "of the configuration"
        allowed = [str(name) for name in parent or () if not str(name).startswith("_")]
        if not scope:
            # a group that no verb chooses by itself, such as cameras, may be added to any
            verbs = {name: roots_choosing(name) for name in recipe_groups()}
            groups = {name for name, chosen in verbs.items() if root in chosen or not chosen}
            allowed = [name for name in {*allowed, "robot", *groups} if name != "hydra"]
        # ``+effect=wind``: the group without the place that the plug-in is added at
        chosen = source.group(1).partition("/")[2] if source and key in registry.GROUPS else ""
        word = added(chosen)
        hint = f"To add the plug-in: {word}" if word else _belongs(key, parent, allowed)
        if not (hint or allowed) and (scope in registry.GROUPS or scope in recipe_groups()):
            hint = f"Choose one first: {scope}=NAME.  {suggestion('', _options_of(scope))}"
        hint = hint or suggestion(key, allowed)
        return ConfigError(f"{shown}: '{key}' is not a key {place}{origin}.\n{hint}")
    if isinstance(cause, MissingMandatoryValue):
        return ConfigError(f"{full_key} has no value{origin}.\nGive it: {full_key}=VALUE")
    if isinstance(cause, InterpolationResolutionError):
        return ConfigError(f"{full_key}: {text}{origin}.\nA reference is written ${{key.below}}.")
    given = value_of(overrides, full_key)
    shown = full_key if given is None else f"{full_key}={given}"
    said = f": {text}"
    number = re.search(r"Value '(.*)' of type .* could not be converted to (\w+)", text)
    if number and number.group(2) in _WORDS:
        said = f": '{number.group(1)}' is not {_WORDS[number.group(2)]}"
    elif text.startswith("Invalid value"):
        said = ""
    elif text == "Cannot merge DictConfig with ListConfig":
        hint = f"To change an entry, write {full_key}.NAME.KEY=VALUE; to see them: --cfg job"
        return ConfigError(f"{shown} is not allowed: {full_key} holds named entries.\n{hint}")
    elif text.startswith(("Invalid type assigned", "Cannot assign str to Dict")):
        said = f": {full_key} holds named entries"
    elif found := re.search(r"Value '(.*)' is not a valid bool", text):
        what = f"'{found[1]}' is neither true nor false"
        return ConfigError(f"{shown} is not allowed: {what}.\nAllowed: true, false")
    hint = _allowed(parent, key, text)
    if hint == _LIST and given and "[" not in given:
        hint = f"A list in brackets is required: {full_key}=[{given}]"
    return ConfigError(f"{shown} is not allowed{said}{origin}.\n{hint}")


def _belongs(key: str, parent: Any, allowed: Sequence[str]) -> str:
    """Say where a key belongs that its section does not have; empty if nowhere."""
    if parent is not None and not len(parent):
        if parent._get_full_key(None) == "fluid":
            return "These keys belong to particle water: water=particles"
        return "This mapping is empty: put a + in front of the key to add it."
    slip = difflib.get_close_matches(key, allowed, n=1, cutoff=_SLIP)
    home = None if parent is None or slip else _home_of(key, parent._get_root())
    if home is not None:
        return f"Did you mean '{home}'?  --cfg job shows all keys"
    verbs = [] if parent is None or slip else _verbs_with(key)
    if 0 < len(verbs) <= _FEW and parent._get_full_key(None) == "":
        other = " or ".join(f"seals {name}" for name in verbs)
        return f"It is a key of {other}.  {suggestion('', allowed)}"
    word = None if nearest(key, allowed) else added(key)
    return f"To add the plug-in: {word}.  {suggestion(key, allowed)}" if word else ""


def _allowed(parent: Any, key: str, text: str) -> str:
    """Describe the allowed values of a key: bounds, names, or type."""
    from omegaconf import OmegaConf

    schema = None if parent is None else OmegaConf.get_type(parent)
    if isinstance(schema, type) and dataclasses.is_dataclass(schema):
        meta = parameters_of(schema).get(key)
        if meta is not None:
            kind = "numbers in brackets, each" if "ListConfig" in text else "a finite number"
            return f"Allowed: {kind} {meta.span}"
    names = re.search(r"Invalid value '(.*)', expected one of \[(.*)\]", text)
    if names:
        return suggestion(names.group(1), names.group(2).split(", "))
    number = re.search(r"could not be converted to (\w+)", text)
    if number:
        return f"Allowed: {_WORDS.get(number.group(1), number.group(1))}"
    if "out of range" in text:
        return "Entries are numbered from 0; see: --cfg job"
    if parent is not None and key in parent and OmegaConf.is_dict(parent[key]):
        return suggestion(
            "", [f"{key}.{name}" for name in parent[key]], label="Set one of its keys"
        )
    return _LIST if "List" in text else "See: --cfg job"


_SAYINGS: tuple[tuple[str, str, str], ...] = (
    (
        r"You must specify '([^']+)'.*?Available options:(.*)",
        "{0} is not given",
        "Choose one: {0}=NAME.  Installed: {options}",
    ),
    (
        r"Override (\S+) looks like a config group override, but config group '([^']+)' does not",
        "{0}: there is no group '{1}'",
        "{groups}",
    ),
    (
        r"Could not append to config. An item is already at '([^']+)'",
        "+{0}: the key exists already",
        "To change it, leave the + out: {0}=VALUE",
    ),
    (
        r"Multiple values for (\S+?)\. To override",
        "+{0}: this group is already chosen",
        "To change the choice, leave the + out: {0}=NAME",
    ),
    (
        r"(\S+) appears more than once in the final defaults list",
        "{0} is chosen twice",
        "To replace it, leave the + out; to add a second one, give it another name after the @.",
    ),
    (
        r"Could not override '([^']+)'\.\s+Did you mean to override (?:one of )?(.*?)\?",
        "{0} is not chosen in this configuration, so it cannot be replaced",
        "To add it, write {add}; to replace one, use: {1}",
    ),
    (
        r"Could not override '([^']+)'",
        "{0} is not chosen in this configuration, so it cannot be replaced",
        "To add it, put a + in front: +{0}=OPTION",
    ),
    (
        r"Could not delete (?:from config\. )?'([^']+)'(?: does not exist|\.\s+No match)",
        "~{0}: there is no such key",
        "See the keys with: seals {root} --cfg job",
    ),
    (
        r"force-add of config groups is not supported: '\+\+([^=']+)",
        "++{0}: the choice of a group takes at most one +",
        "To replace the choice, write {0}=NAME; to add one, +{0}=NAME",
    ),
    (
        r"The value of '([^']+)' is (.*) and not (.*)\.",
        "~{0}={2}: the value is {1}",
        "To remove the key whatever its value, write ~{0}",
    ),
    (
        r"Error merging override ([^=\s]+)=(\S*)",
        "{0}={1} is not allowed: its shape differs from that of this value",
        "In a list of places or rows each entry has its own brackets: {0}=[[0,0,1],[1,0,1]]; to "
        "see "
        "the default: seals {root} --cfg job",
    ),
    (
        r"does not support sweep type : (\w+)",
        "an interval does not define a number of values",
        "List values, or let a sweeper choose them: hydra/sweeper=optuna",
    ),
)
"""Hydra's sentence, our first line, our second line."""


def _by_words(text: str, overrides: Sequence[str], *, root: str) -> SealsError:
    """Explain errors that consist of a sentence only."""
    for pattern, first, second in _SAYINGS:
        found = re.search(pattern, text, re.DOTALL)
        if found is None:
            continue
        groups = [group.strip() for group in found.groups()]
        # the word that adds what a group was to be replaced by
        given = next((o.partition("=")[2] for o in overrides if o.startswith(f"{groups[0]}=")), "")
        add = f"+{groups[0]}={given}" if given and "@" in groups[0] else added(given)
        words = {
            "root": root,
            "add": add or "+GROUP@SECTION.NAME=OPTION",
            "options": ", ".join(groups[-1].split()) if groups else "",
            "groups": suggestion(
                groups[1] if len(groups) > 1 else "",
                {*registry.GROUPS, *recipe_groups()} - {"animal", "conf"},
                label="Groups",
            ),
        }
        return ConfigError(f"{first.format(*groups, **words)}.\n{second.format(*groups, **words)}")
    return ConfigError(f"{' '.join(text.split())}\nSee the keys with: seals {root} --cfg job")


def _cure(word: str) -> str:
    """Say how a word that cannot be read as KEY=VALUE is to be written."""
    key, _, value = word.partition("=")
    if not key.isascii():
        return "Keys are written in letters of ASCII, for instance robot=ball"
    if not value.isascii() and not value.startswith(("'", '"')):
        return f"Letters beyond ASCII need quotes within quotes: {key}='\"{value}\"'"
    for opening, closing in ("[]", "{}"):
        missing = value.count(opening) - value.count(closing)
        if missing > 0:
            return f"A bracket is not closed. Write: '{word}{closing * missing}'"
    if value.startswith("(") and value.endswith(")"):
        return f"A list has square brackets. Write: '{key}=[{value[1:-1]}]'"
    return "Quote values with spaces, brackets or '=', for instance 'initial.position=[0,0,1]'"


def _of_words(words: Sequence[str], several: bool) -> ConfigError | None:
    """Explain words that are none for Hydra whatever the configuration; None for others."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    parser, swept = OverridesParser.create(), ""
    for word in words:
        try:
            found = parser.parse_override(word)
        except HydraException:
            if "=" not in word and word.lstrip("+"):
                advice = "Write KEY=VALUE, for instance robot=ball or time.duration=2"
                return ConfigError(f"{word}: the value is missing.\n{advice}")
            return ConfigError(
                f"{word or 'an empty argument'} cannot be read as KEY=VALUE.\n{_cure(word)}"
            )
        swept = swept or (word if found.is_sweep_override() else "")
    if swept and not several:
        advice = "For a list use [a,b]; to run each value, add --multirun"
        return ConfigError(f"{swept} holds several values.\n{advice}")
    return None
