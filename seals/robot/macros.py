"""Expansion of xacro macros to a URDF."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from seals.child_process import environment
from seals.errors import MissingExtra, RobotError
from seals.isolated_reading import out_of_time, run_bounded
from seals.untrusted_io import plain_json

PATIENCE = 30.0
"""Time after which the process that expands macros is ended [s]."""
_KEPT = ("PYTHONPATH", "PYTHONSAFEPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "SYSTEMROOT")
"""Variables without which no Python starts; the process forgets them as well."""


_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def holds_macros(text: str) -> bool:
    """Return whether the text of a URDF needs xacro.

    Example:
        >>> holds_macros('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"/>')
        True
    """
    return re.search(r"<xacro:|xmlns:xacro", _COMMENT.sub("", text)) is not None


def with_plain_comments(text: str) -> str:
    """Return XML whose comments hold no two dashes, which XML forbids and people write.

    Lines keep their numbers. What is left of ``<!--`` without an end stays as it is.

    Example:
        >>> with_plain_comments("<a/><!-- b --msgtype ---- c -->")
        '<a/><!-- b - -msgtype - - - - c -->'
    """
    return _COMMENT.sub(lambda found: f"<!--{_parted(found[1])}-->", text)


def with_plain_names(text: str) -> str:
    """Return XML without a default name space, and with undeclared prefixes made part of names.

    Programs that read robots look at neither; an XML parser takes the one for other elements and
    refuses the other.

    Example:
        >>> with_plain_names('<robot xmlns="http://a.b"><drake:x/></robot>')
        '<robot><drake_x/></robot>'
    """
    text = re.sub(r"""(<[\w.-]+[^<>]*?)\sxmlns=("[^"]*"|'[^']*')""", r"\1", text)
    declared = {"xml", "xmlns", *re.findall(r"xmlns:([\w.-]+)=", text)}

    def named(found: re.Match[str]) -> str:
        joined = ":" if found[2] in declared else "_"
        return f"{found[1]}{found[2]}{joined}"

    return re.sub(r"(</?)([A-Za-z_][\w.-]*):(?=[A-Za-z_])", named, text)


def _parted(comment: str) -> str:
    parted = re.sub(r"-(?=-)", "- ", comment)
    return f"{parted} " if parted.endswith("-") else parted


def expanded(
    path: Path,
    packages: Mapping[str, Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> str:
    """Return the URDF expanded from a xacro file.

    The package xacro runs in a process of its own, with little time and memory, without the
    environment of this one; it opens ordinary files near the given one only, and writes none.

    Args:
        path: of the file; files that it includes lie in its folder, in a package beside its own, or
            in one of the given ones.
        packages: folders of ``$(find NAME)``, by name, where they are not around the file.
        arguments: values of ``$(arg NAME)``, by name.

    Raises:
        MissingExtra: the package xacro is not installed.
        RobotError: the macros cannot be expanded.
    """
    if not _installed():
        raise MissingExtra(
            f"URDF {path} holds xacro macros, which need the package xacro; it is not installed.\n"
            "Install it: pip install xacro. Or expand the file where it is: "
            "xacro model.urdf.xacro > model.urdf"
        )
    done = run_bounded(
        Path(str(files("seals.robot"))) / "macros_child.py",
        [
            str(path.resolve()),
            *(f"{name}={folder.resolve()}" for name, folder in (packages or {}).items()),
            *(f"{name}:={value}" for name, value in (arguments or {}).items()),
        ],
        env={key: value for key, value in environment().items() if key in _KEPT},
        patience=PATIENCE,
        refused=functools.partial(_refused, path),
    )
    try:
        answer = plain_json(done.stdout)
        text = answer.get("urdf")
    except (ValueError, AttributeError) as cause:
        code = f"the process that expands them ended with code {done.returncode}"
        why = "its macros compute too long" if out_of_time(done.returncode, 0) else code
        raise _refused(path, why) from cause
    if not isinstance(text, str):
        raise _refused(path, str(answer.get("refused")))
    return text


def _installed() -> bool:
    try:
        return find_spec("xacro") is not None
    except ValueError:
        return False


def _refused(path: Path, why: str) -> RobotError:
    return RobotError(
        f"URDF {path}: xacro cannot expand it: {why}.\n"
        "An argument without a default: arg=NAME=VALUE. A package of $(find NAME): package="
        "NAME=FOLDER. The environment is not known here: expand it where it is."
    )
