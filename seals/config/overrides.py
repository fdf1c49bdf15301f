"""Parsing of command-line flags, and refusal of dangerous overrides that come from files.

Those of files set values, they make no classes and run nothing.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import shlex
from collections.abc import Sequence

from seals.errors import ConfigError

_DANGER = re.compile(r"_target_|\$|hydra[./]|^[^=]*hydra\b|^-|[\n\r]")

_ALIVE = set('"$`\\!')
"""Signs that mean something to a shell inside of double quotes."""
MOST_SIGNS = 20_000
"""Signs of all overrides of a file together: Hydra's parser takes a minute for 400,000."""
_VALUED = {
    "-c": "--cfg",
    "-p": "--package",
    "-cp": "--config-path",
    "-cn": "--config-name",
    "-cd": "--config-dir",
    "-i": "--info",
}
"""Flags of Hydra with a value, short and long."""


def joined(words: Sequence[str]) -> list[str]:
    """Return command-line arguments with every flag joined to its value.

    Example:
        >>> joined(["-cd", "options", "--cfg=job", "seed=1"])
        ['--config-dir=options', '--cfg=job', 'seed=1']
    """
    found: list[str] = []
    for word in words:
        if found and found[-1] in _VALUED.values() and not word.startswith("-"):
            found[-1] += f"={word}"
        else:
            found.append(_VALUED.get(word, word))
    return found


def flag_parser() -> argparse.ArgumentParser:
    """Return the parser of Hydra's flags."""
    from hydra._internal.utils import get_args_parser

    return get_args_parser()


def parsed(words: Sequence[str]) -> argparse.Namespace:
    """Return Hydra's flags among some words, and the overrides."""
    return flag_parser().parse_args(list(words))


def key_of(word: str) -> str:
    """Return the key of an override.

    Example:
        >>> key_of("+effects.a=wind"), key_of("~water")
        ('effects.a', 'water')
    """
    return word.lstrip("+~").partition("=")[0]


def value_of(words: Sequence[str], key: str) -> str | None:
    """Return the last value of a key among words, without quotes; None if it has none.

    Example:
        >>> value_of(["seed=1", "policy='my one'"], "policy"), value_of(["seed=1"], "out")
        ('my one', None)
    """
    given = [w.partition("=")[2].strip("'\"") for w in words if "=" in w and key_of(w) == key]
    return given[-1] if given else None


def typed(key: str, value: str | Sequence[str]) -> str:
    """Return ``KEY=VALUE`` as it is typed in a shell for Hydra to read the same text again.

    Args:
        key: of the override.
        value: a text or a list of them.

    Example:
        >>> print(typed("log", "flights/a"), typed("log", ["my flight", "2"]), typed("out", "a,b"))
        log=flights/a "log=[my flight,'2']" "out='a,b'"
    """
    word = override(key, value)
    # a word in quotes of Hydra reads best in those of the other kind
    return f'"{word}"' if "'" in word and not _ALIVE & set(word) else shlex.quote(word)


def override(key: str, value: str | Sequence[str]) -> str:
    """Return the override of Hydra that sets a key to a text, or to a list of texts.

    Example:
        >>> override("robot", "quad, heavy")
        "robot='quad, heavy'"
    """
    if isinstance(value, str):
        return f"{key}={_quoted(value)}"
    return f"{key}=[{','.join(map(_quoted, value))}]"


def _quoted(text: str) -> str:
    """Return a text in the quotes that Hydra needs to read it as a text, and as one."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    with contextlib.suppress(HydraException):
        if OverridesParser.create().parse_override(f"key=[{text}]").value() == [text]:
            return text
    # a backslash escapes a quotation mark, and itself before one
    inside = re.sub(r"(\\*)('|$)", lambda m: 2 * m[1] + ("\\'" if m[2] else ""), text)
    return f"'{inside}'"


def refuse_dangerous(
    words: Sequence[str], *, where: str, remedy: str, writer: str = "training"
) -> None:
    """Refuse overrides from a file that name classes, call resolvers, or configure Hydra.

    Args:
        words: overrides such as ``env.duration=4``.
        where: what brought them, for the message.
        remedy: what to do about it.
        writer: what writes such words, for the message.

    Raises:
        ConfigError: one of them may do more than set a value.

    Example:
        >>> refuse_dangerous(["env=reach", "~effects.slamming"], where="card.json", remedy="")
        >>> refuse_dangerous(["hydra.run.dir=/"], where="card.json", remedy="Remove it.")
        Traceback (most recent call last):
        seals.errors.ConfigError: card.json contains 'hydra.run.dir=/', which no training writes.
        Remove it.
    """
    if sum(map(len, words)) > MOST_SIGNS:
        raise ConfigError(
            f"{where} holds words of {sum(map(len, words)):,} characters; "
            f"the limit is {MOST_SIGNS:,}.\n{remedy}"
        )
    for word in words:
        if _DANGER.search(word) or not ("=" in word or word.startswith("~")):
            raise ConfigError(f"{where} contains '{word:.80}', which no {writer} writes.\n{remedy}")
