"""Error classes of SEALS, and suggestions for mistyped names.

Each says what was given, what is allowed, the nearest name and the next step.
"""

from __future__ import annotations

import contextlib
import difflib
import re
from collections.abc import Collection, Iterable, Iterator


class SealsError(Exception):
    """Base of all errors that a user can act upon.

    The command line prints it without a traceback.

    Example:
        >>> try:
        ...     raise ConfigError("depth=-1 is not allowed; allowed: 0 or more")
        ... except SealsError as error:
        ...     error.exit_code
        2
    """

    exit_code = 2


class ConfigError(SealsError):
    """A configuration value, key or combination is not allowed.

    Example:
        >>> from seals import make
        >>> try:
        ...     make(["robot=bal"])
        ... except ConfigError as error:
        ...     "ball" in str(error)
        True
    """


class UnknownPlugin(ConfigError):
    """A plug-in name is not installed."""


class BrokenPlugin(SealsError):
    """An installed plug-in cannot be imported."""


class MissingExtra(SealsError):
    """An optional dependency is needed and absent."""


class LogError(SealsError):
    """A measured log, or a data set, cannot be used.

    Example:
        >>> from seals import Log
        >>> try:
        ...     Log(name="drop", columns={"t": [0.0, 1.0]}).channel("position")
        ... except LogError as error:
        ...     error.exit_code
        2
    """


class NotFitted(SealsError, AttributeError):
    """A result was read before ``fit`` was called."""


class DiskFull(SealsError):
    """The disk is full; files finished before are complete."""


class OutOfMemory(SealsError):
    """The memory is exhausted; results that were finished before are complete."""


class RobotError(SealsError):
    """A robot description (URDF, mesh, robot.yaml) cannot be used.

    Example:
        >>> from pathlib import Path
        >>> from seals.robot.structure import check_structure
        >>> try:
        ...     check_structure(Path("tree.urdf"), "<robot")
        ... except RobotError as error:
        ...     error.exit_code
        2
    """


class PhysicsError(SealsError):
    """The simulation was set to, or reached, a state outside its valid range.

    Example:
        >>> try:
        ...     raise PhysicsError("the speed of base is 1e9 m/s")
        ... except SealsError as error:
        ...     error.exit_code
        2
    """


@contextlib.contextmanager
def naming(where: str) -> Iterator[None]:
    """Put in front of every refusal of the block whom it concerns, unless it says so.

    Args:
        where: a key or a name; empty for nobody in particular.

    Example:
        >>> with naming("robots.scout"):
        ...     raise PhysicsError("its speed is 1e9 m/s.")
        Traceback (most recent call last):
        seals.errors.PhysicsError: robots.scout: its speed is 1e9 m/s.
    """
    try:
        yield
    except SealsError as refusal:
        if not where or where in str(refusal):
            raise
        raise type(refusal)(f"{where}: {refusal}") from refusal


@contextlib.contextmanager
def optional_import(need: str, remedy: str) -> Iterator[None]:
    """Refuse in words when an import inside the block fails.

    Args:
        need: what needs which package.
        remedy: how to install it, or what to use instead.

    Raises:
        MissingExtra: the package cannot be imported.

    Example:
        >>> with optional_import("frames need numpy", "Install it: pip install numpy"):
        ...     import numpy
    """
    try:
        yield
    except ImportError as cause:
        raise MissingExtra(f"{need}, which cannot be imported.\n{remedy}") from cause


def line_in_law(problem: BaseException, own: tuple[str, ...]) -> str:
    """Return module and line of the law in which a problem arose.

    Args:
        problem: that was raised.
        own: how the modules begin that followed the law.
    """
    trace, place = problem.__traceback__, "a law"
    while trace is not None:
        name = trace.tb_frame.f_globals.get("__name__", "")
        if not name.startswith(own):
            place = f"{name}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return place


def close_names(name: str, allowed: Iterable[str], *, most: int = 4) -> list[str]:
    """Return names of which a part begins with ``name``, else the closest, else of a close part.

    Example:
        >>> close_names("drag", ["linear_drag", "quadratic_drag", "wind"])
        ['linear_drag', 'quadratic_drag']
        >>> close_names("quadratic_darg", ["linear_drag", "quadratic_drag"])
        ['quadratic_drag']
        >>> close_names("darg", ["linear_drag", "wind"])
        ['linear_drag']
    """
    given = _folded(name)
    folded = {_folded(candidate): candidate for candidate in allowed}
    parts = {key: re.split(r"[_./]", key) for key in folded}
    begun = [key for key in folded if any(part.startswith(given) for part in [key, *parts[key]])]
    found = sorted(begun, key=len) if len(given) > 2 else []
    whole = nearest(name, folded)
    found = (
        found
        or ([whole] if whole else [])
        or [key for key in folded if difflib.get_close_matches(given, parts[key], n=1, cutoff=0.75)]
    )
    return [folded[key] for key in found[:most]]


def _folded(name: str) -> str:
    return name.casefold().replace("-", "_")


def nearest(name: str, allowed: Iterable[str]) -> str | None:
    """Return the allowed name closest to ``name``, or None when nothing is close.

    Example:
        >>> nearest("quadratic_darg", ["linear_drag", "quadratic_drag"])
        'quadratic_drag'
    """
    folded = {_folded(candidate): candidate for candidate in allowed}
    hits = difflib.get_close_matches(_folded(name), folded, n=1, cutoff=0.6)
    return folded[hits[0]] if hits else None


def suggestion(name: str, allowed: Iterable[str], *, label: str = "Allowed", most: int = 24) -> str:
    """Return the second line of an error message: the nearest names and the allowed ones.

    Example:
        >>> suggestion("sphree", ["box", "sphere"])
        "Did you mean 'sphere'?  Allowed: box, sphere"
    """
    names = sorted(set(allowed))
    close = " or ".join(f"'{one}'" for one in close_names(name, names))
    shown = ", ".join(names[:most]) or "(none)"
    more = f", and {len(names) - most} more" if len(names) > most else ""
    hint = f"Did you mean {close}?  " if close else ""
    return f"{hint}{label}: {shown}{more}"


def refuse_unlisted(
    name: str,
    allowed: Collection[str],
    what: str,
    *,
    label: str = "Allowed",
    most: int = 24,
    error: type[SealsError] = ConfigError,
) -> None:
    """Refuse a name that is not among the allowed ones; the nearest is named.

    Args:
        name: as it was given.
        allowed: all names that there are.
        what: what is wrong with another one, without a full stop.
        label: in front of the allowed ones.
        most: allowed names that are shown.
        error: class of the refusal.

    Raises:
        SealsError: ``error``; the name is another one.

    Example:
        >>> refuse_unlisted("box", ["box", "sphere"], "there is no 'box'")
        >>> refuse_unlisted("sphree", ["box", "sphere"], "there is no 'sphree'")
        Traceback (most recent call last):
        seals.errors.ConfigError: there is no 'sphree'.
        Did you mean 'sphere'?  Allowed: box, sphere
    """
    if name not in allowed:
        raise error(f"{what}.\n{suggestion(name, allowed, label=label, most=most)}")


def printable(text: str) -> str:
    r"""Return one line of text without the signs that steer a terminal or begin a line.

    Example:
        >>> printable("a\x1b[2J\nb")
        'a [2J b'
    """
    return "".join(sign if sign.isprintable() else " " for sign in text)


def refuse_absent(value: object, key: str, command: str) -> None:
    """Refuse a command without a value that it needs.

    Args:
        value: as given; None where it is not.
        key: that it is the value of.
        command: that gives it.

    Raises:
        ConfigError: it is not given.

    Example:
        >>> refuse_absent(None, "log", "seals diagnose log=FOLDER")
        Traceback (most recent call last):
        seals.errors.ConfigError: log is not given.
        Say which: seals diagnose log=FOLDER
    """
    if value is None:
        raise ConfigError(f"{key} is not given.\nSay which: {command}")
