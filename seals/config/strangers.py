"""Restrictions on untrusted configuration folders: only values and names of plug-ins.

Hydra reads more than values from the YAML in ``--config-dir``: a section ``hydra`` names classes
that it makes, programs' surroundings and further folders. A folder holding any of that is refused
before Hydra sees it, unless the word ``--trust`` stands beside it. So are files that choose among
each other too often, too deep, or in circles.
"""

from __future__ import annotations

import os
import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.config.checks import SPECIAL, TARGET, refuse_growth
from seals.config.overrides import parsed
from seals.errors import ConfigError, SealsError
from seals.untrusted_io import read_bytes, read_plain_yaml

MOST_CHOSEN, DEEPEST = 2_000, 40
"""Files that one may have read with all that it chooses; levels between them."""


def wrong_choices(defaults: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return a file whose choices have no end, and what is wrong; None where all have.

    A file is read once for each way that leads to it, so that a few that choose each other twice
    are read a million times.

    Args:
        defaults: list of defaults of each file, by its path in the folder without suffix.

    Example:
        >>> wrong_choices({"experiment/a": ["b"], "experiment/b": ["a"]})
        ('experiment/a', 'chooses itself')
        >>> wrong_choices({"experiment/a": ["b"], "experiment/b": ["_self_"]})
    """
    sizes: dict[str, tuple[int, int]] = {}
    for name in defaults:
        wrong = _measure(name, defaults, sizes, ())
        if wrong:
            return name, wrong
    return None


def _measure(
    name: str,
    defaults: Mapping[str, Any],
    sizes: dict[str, tuple[int, int]],
    above: tuple[str, ...],
) -> str:
    """Note how many files are read for one, and levels of them; return what is wrong with it."""
    if name in above:
        return "chooses itself"
    if name in sizes:
        return ""
    count = levels = 1
    for chosen in _chosen(name, defaults):
        wrong = "" if len(above) > DEEPEST else _measure(chosen, defaults, sizes, (*above, name))
        if wrong:
            return wrong
        files, deep = sizes.get(chosen, (1, DEEPEST))
        count, levels = count + files, max(levels, 1 + deep)
        if levels > DEEPEST:
            return f"selects files through more than {DEEPEST} levels"
        if count > MOST_CHOSEN:
            return f"has more than {MOST_CHOSEN:,} files read"
    sizes[name] = (count, levels)
    return ""


def _chosen(name: str, defaults: Mapping[str, Any]) -> Iterator[str]:
    """Yield the files of the folder that one chooses, as often as it does."""
    group = posixpath.dirname(name)
    entries = defaults[name]
    for entry in entries if isinstance(entries, list) else [entries]:
        for key, options in entry.items() if isinstance(entry, Mapping) else [("", entry)]:
            place = posixpath.join("/", group, _bare(str(key)))
            for option in options if isinstance(options, list) else [options]:
                full = posixpath.normpath(posixpath.join(place, _bare(str(option))))
                full = full.removesuffix(".yaml")
                # a reference may lead to any file of its group
                begin = full.partition("${")[0]
                yield from (
                    other
                    for other in defaults
                    if f"/{other}" == full or ("${" in full and f"/{other}".startswith(begin))
                )


def _bare(word: str) -> str:
    """Return a word of a list of defaults without its package and what stands before it."""
    return (word.partition("@")[0].split() or [""])[-1]


TRUST = "--trust"
_SOURCES = ("resume=", "policy=")
"""Words that name a folder whose file sets values."""
_HYDRA = re.compile(r"\bhydra\b")
_PACKAGE = re.compile(r"^\s*#\s*@package\s+(\S+)", re.MULTILINE)
_MOST_FILES = 10_000
_SEARCH = "hydra.searchpath"
_PLAIN = re.compile(r"\$\{(?!hydra\b)[\w.\[\]-]+\}")
_MOST = 200_000


def untrusted(arguments: Sequence[str]) -> list[str]:
    """Remove ``--trust`` from the arguments; without it, refuse folders that require trust.

    Raises:
        ConfigError: a folder of configuration holds more than values and names of plug-ins.
    """
    rest = [word for word in arguments if word != TRUST]
    folders = [*_folders(rest)]
    if len(rest) != len(arguments):
        if not folders and not any(word.startswith(_SOURCES) for word in rest):
            raise ConfigError(
                f"{TRUST}: there is nothing to trust.\n"
                "It goes with --config-dir FOLDER, resume=FOLDER or policy=FOLDER."
            )
        return rest
    for folder in folders:
        refuse_commands(folder)
    return rest


def refuse_commands(folder: Path) -> None:
    """Refuse a configuration folder with more than values and names of plug-ins.

    Args:
        folder: of YAML files, as ``--config-dir`` takes it.

    Raises:
        ConfigError: a file in it turns to Hydra, names a class that is not an installed plug-in,
            looks something up, leads out of the folder, holds or chooses itself, or cannot be read.
    """
    defaults: dict[str, Any] = {}
    for place in _files(folder):
        try:
            # an empty file is no fault
            raw = read_bytes(place, most=1 << 20) if place.stat().st_size else b""
            text = raw.decode("utf-8")
        except (OSError, UnicodeDecodeError, SealsError) as cause:
            raise _distrust(place, f"cannot be read ({' '.join(str(cause).split())})") from cause
        content = _content(place)
        for fault in _faults(place.relative_to(folder), text, content):
            raise _distrust(place, fault)
        refuse_growth(content)
        if isinstance(content, Mapping):
            name = place.relative_to(folder).with_suffix("").as_posix()
            defaults[name] = content.get("defaults") or []
    wrong = wrong_choices(defaults)
    if wrong is not None:
        raise ConfigError(
            f"{folder / wrong[0]}.yaml {wrong[1]}.\nRemove the entry that leads there."
        )


def _folders(words: Sequence[str]) -> Iterator[Path]:
    """Folders that Hydra would read beside the installed ones."""
    given = parsed(words)
    for value in (given.config_dir, given.config_path):
        if value is not None and "://" not in value:
            yield Path(value)
        elif value is not None and not value.startswith("pkg://"):
            yield Path(value.partition("://")[2])
    for word in words:
        if word.lstrip("+~").startswith(_SEARCH):
            raise ConfigError(f"{word:.80} names folders unseen.\nWrite --config-dir FOLDER.")


def _files(folder: Path) -> Iterator[Path]:
    count = 0
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(place) / name
            if path.is_symlink() and not path.resolve().is_relative_to(folder.resolve()):
                raise _distrust(path, "is a link that leads outside the folder")
            if name in files and path.suffix in (".yaml", ".yml"):
                count += 1
                yield path
            if count > _MOST_FILES:
                raise _distrust(folder, f"holds more than {_MOST_FILES} files")


def _faults(place: Path, text: str, content: Any) -> Iterator[str]:
    """Yield what a file of a folder holds beside values and names of plug-ins."""
    if any(_HYDRA.search(part) for part in place.parent.parts):
        yield "lies in a folder of Hydra's own settings"
    for package in _PACKAGE.findall(text):
        if _HYDRA.search(package):
            yield f"is packed into '{package:.80}'"
    top = content if isinstance(content, Mapping) else {}
    for key in top:
        if _HYDRA.search(str(key)):
            yield f"has the section '{key!s:.80}', which can start programs"
    chosen = top.get("defaults") or []
    for entry in chosen if isinstance(chosen, list) else [chosen]:
        words = [*map(str, entry), *map(str, entry.values())] if isinstance(entry, Mapping) else []
        for word in words or [str(entry)]:
            if _HYDRA.search(word):
                yield f"chooses '{word:.80}' among Hydra's own settings"
            if ".." in word:
                yield f"leads outside the folder by '{word:.80}'"
        if any("${" in word for word in words[: len(words) // 2]):
            yield f"selects an option indirectly by '{entry!s:.80}'"
    yield from _special_keys(content)
    found = lookup_in(content)
    if found is not None:
        yield f"looks something up by '{' '.join(found.split()):.80}'"


def _special_keys(content: Any) -> Iterator[str]:
    """Yield Hydra's special keys at any depth, but for the class of an installed plug-in."""
    from seals.config.plugin_lookup import is_plugin

    waiting = [content]
    while waiting:
        value = waiting.pop()
        if isinstance(value, Mapping):
            for key in map(str, value):
                if key in SPECIAL and not (key == TARGET and is_plugin(str(value[key]))):
                    yield f"gives {key}: {value[key]!s:.80}, which is not an installed plug-in"
            waiting += value.values()
        elif isinstance(value, list | tuple):
            waiting += value


def _content(place: Path) -> Any:
    import yaml

    try:
        return read_plain_yaml(place)
    except (yaml.scanner.ScannerError, yaml.parser.ParserError) as cause:
        # nobody could compose with it: trust would not help
        raise ConfigError(
            f"{place} is not valid YAML ({' '.join(str(cause).split())[:200]}).\n"
            "Correct it, or move it out of the folder."
        ) from cause
    except (OSError, UnicodeDecodeError, yaml.YAMLError, SealsError) as cause:
        raise _distrust(
            place, f"is not plain YAML ({' '.join(str(cause).split())[:200]})"
        ) from cause


def _distrust(place: Path, words: str) -> ConfigError:
    return ConfigError(
        f"{place} {words}.\nRead the folder; if you trust it, use: --config-dir FOLDER {TRUST}"
    )


def lookup_in(content: Any) -> str | None:
    """Return the first text in plain data that calls a resolver, or None.

    What cannot be told apart, such as one reference inside of another, counts as a lookup.

    Example:
        >>> lookup_in({"a": ["${time.step}", 1], "b": "${.c}"}) is None
        True
        >>> lookup_in({"a": ["${oc.env:HOME}"]})
        '${oc.env:HOME}'
    """
    waiting = [content]
    for _ in range(_MOST):
        if not waiting:
            return None
        value = waiting.pop()
        if isinstance(value, Mapping):
            waiting += [*value.keys(), *value.values()]
        elif isinstance(value, list | tuple):
            waiting += value
        elif isinstance(value, str) and "${" in _PLAIN.sub("", value):
            return value
    return f"more than {_MOST:,} entries"


def refuse_lookups(content: Any, *, where: str, remedy: str) -> None:
    """Refuse untrusted configuration that calls a resolver.

    Args:
        content: what a YAML file holds.
        where: its name, for the message.
        remedy: what to do, for the message.

    Raises:
        ConfigError: a text in it asks a resolver.
    """
    found = lookup_in(content)
    if found is not None:
        shown = " ".join(found.split())[:80]
        raise ConfigError(f"{where} looks something up by '{shown}'.\n{remedy}")
