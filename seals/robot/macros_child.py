"""Program that expands the xacro macros of one file, run in a restricted child process.

    python macros_child.py FILE [PACKAGE=FOLDER ...] [ARGUMENT:=VALUE ...]

It writes one JSON object to the standard output: ``urdf``, or ``refused`` with the reason. Time,
memory and the files that it may open are bounded; it has no environment and may start nothing.
"""

from __future__ import annotations

import sys

if sys.path and not getattr(sys.flags, "safe_path", False):
    # before Python 3.11 the folder of this file comes first, and its modules before the others
    del sys.path[0]

import ast
import errno
import json
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.isolated_reading import bound

SECONDS = 5
"""Time that the macros of one file may compute [s]."""
MOST_MEMORY = 1 << 30
"""Memory that they may take [byte]."""
MOST_BYTES = 5_000_000
"""Largest file that is included, and largest result [byte]."""
_INSIDE = re.compile(r"_|(gi|cr|ag|f|tb|co|func)_|(vars|type|mro)$")
"""Names through which an expression would get at the interpreter that evaluates it."""
_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)
_USED, _DECLARED = re.compile(r"\$\(arg (\w+)\)"), re.compile(r"<xacro:arg\s+name=[\"'](\w+)")
"""Arguments that a file uses, and those to which it gives a default."""
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_ACTING = ("subprocess.", "socket.", "ctypes.", "shutil.", "ftplib.", "urllib.", "pty.", "os.exec")
_CHANGING = (
    *("os.system", "os.fork", "os.forkpty", "os.spawn", "os.posix_spawn", "os.kill", "os.remove"),
    *("os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod"),
    *("os.chown", "os.utime", "os.putenv", "os.setxattr", "os.startfile", "signal.pthread_kill"),
)


def main(path: str, *given: str) -> str:
    """Expand one file and return the result as JSON.

    Args:
        path: of the file.
        given: packages, NAME=FOLDER, and arguments, NAME:=VALUE.
    """
    try:
        import xacro
        import xacro.substitution_args as substitution
        import yaml

        del yaml  # imported before the bounds stand
    except ImportError as cause:
        return json.dumps({"refused": f"the package xacro is not usable: {cause}"})
    home = Path(path).resolve()
    os.environ.clear()
    bound(SECONDS, MOST_MEMORY)
    code = tuple(os.path.realpath(entry) for entry in sys.path if entry)
    values = dict(word.split(":=", 1) for word in given if ":=" in word)
    words = (word.partition("=") for word in given if ":=" not in word)
    packages = {name: Path(folder) for name, _, folder in words}
    near = (_surroundings(home), *packages.values())
    sys.addaudithook(lambda event, words: _watch(event, words, near, code))
    _arithmetic_only(xacro, substitution)
    _packages_only(substitution, home, packages)
    _forgiving(xacro)
    try:
        text = str(xacro.process_file(str(home), mappings=values).toxml())
    except Exception as cause:  # whatever its expressions raise, which are a stranger's
        return json.dumps({"refused": _words(cause) + _without_value(cause, home, values)})
    if len(text) > MOST_BYTES:
        return json.dumps({"refused": f"it expands to {len(text):,} characters"})
    return json.dumps({"urdf": text})


def _words(cause: BaseException) -> str:
    """Return in words what ended the expansion."""
    behind = getattr(cause, "exc", None) or cause
    if isinstance(behind, RecursionError):
        return "a macro or a file includes itself, or is nested too deep"
    if isinstance(behind, MemoryError):
        return f"its macros take more than {MOST_MEMORY >> 20} MB"
    return (" ".join(str(cause).split()) or type(cause).__name__)[:300]


def _without_value(cause: BaseException, home: Path, values: Mapping[str, str]) -> str:
    """Name all arguments of a file that have neither default nor value, where one was missed."""
    if "Undefined substitution argument" not in str(cause):
        return ""
    text = _COMMENT.sub("", home.read_text(encoding="utf-8", errors="replace"))
    known = {*_DECLARED.findall(text), *values}
    absent = sorted({name for name in _USED.findall(text) if name not in known})
    return f" (without a value: {', '.join(absent)})"[:1000] if len(absent) > 1 else ""


def _surroundings(home: Path) -> Path:
    """Return the folder whose files may be included: packages beside each other, or its own."""
    for folder in list(home.parents)[:6]:
        if (folder / "package.xml").is_file() and len(folder.parents) > 2:
            return folder.parent
    return home.parent


def _watch(
    event: str, words: tuple[Any, ...], near: tuple[Path, ...], code: tuple[str, ...]
) -> None:
    """Refuse what the macros of a stranger may not do; called by the interpreter.

    Raises:
        PermissionError: it is none of the files that they may read, or no reading.
    """
    if event == "open":
        _may_read(words, near, code)
    elif event in ("os.listdir", "os.scandir"):
        _may_list(words[0], near, code)
    elif event.startswith(_ACTING) or event in _CHANGING:
        raise PermissionError(f"macros may not do this: {event}")


def _may_read(words: tuple[Any, ...], near: tuple[Path, ...], code: tuple[str, ...]) -> None:
    name, mode, flags = words
    if isinstance(name, int):
        return
    if (isinstance(flags, int) and flags & _WRITING) or set(str(mode or "")) & set("wax+"):
        raise PermissionError(errno.EACCES, "macros write no file", str(name))
    place = os.path.realpath(os.fsdecode(name))
    if any(place.startswith(entry + os.sep) for entry in code):
        return
    target = Path(place)
    if not any(_plainly_in(target, folder) for folder in near):
        why = f"it is elsewhere; only files in {', '.join(map(str, near))} are allowed"
        raise PermissionError(errno.EACCES, why, str(name))
    try:
        status = os.stat(place)
    except OSError:
        return  # to be reported by who opens it
    if not stat.S_ISREG(status.st_mode) or status.st_size > MOST_BYTES:
        why = f"it is not a regular file of up to {MOST_BYTES:,} bytes"
        raise PermissionError(errno.EACCES, why, str(name))


def _may_list(name: Any, near: tuple[Path, ...], code: tuple[str, ...]) -> None:
    """Refuse a look into other folders, which a pattern of files to be included would take."""
    place = os.path.realpath(os.fsdecode("." if name is None else name))
    if any(place == entry or place.startswith(entry + os.sep) for entry in code):
        return
    if not any(_plainly_in(Path(place), folder) for folder in near):
        raise PermissionError(errno.EACCES, "macros may not read other folders", str(name))


def _plainly_in(target: Path, folder: Path) -> bool:
    """Return whether a file lies in a folder, and is not hidden there."""
    return target.is_relative_to(folder) and not any(
        part.startswith(".") for part in target.relative_to(folder).parts
    )


def _packages_only(substitution: Any, home: Path, packages: Mapping[str, Path]) -> None:
    """Let ``$(find NAME)`` find packages that were given, and those around the file."""

    def find(name: str) -> str:
        around = [folder for parent in list(home.parents)[:6] for folder in (parent, parent / name)]
        for folder in (packages.get(name), *around):
            if folder is not None and (folder.name == name or name in packages) and folder.is_dir():
                return str(folder)
        raise substitution.SubstitutionException(
            f"$(find {name}): there is no package '{name}' around {home.name}"
        )

    substitution._eval_find = find
    substitution._eval_dict["find"] = find


def _arithmetic_only(xacro: Any, substitution: Any) -> None:
    """Let xacro evaluate no expression that reaches for the interpreter.

    The package itself looks at the outermost names only, hands out ``vars`` and ``type``, and
    evaluates ``$(eval ...)`` with all functions of Python.
    """
    evaluate = xacro.safe_eval

    def checked(expression: str, *symbols: Any) -> Any:
        _refuse_names(expression, xacro.XacroException)
        return evaluate(expression, *symbols)

    def substituted(expression: str, context: Any) -> str:
        _refuse_names(expression, xacro.XacroException)
        known: Mapping[str, Any] = context.get("arg", {})
        names = {key: substitution.convert_value(value, "auto") for key, value in known.items()}
        names |= dict(substitution._eval_dict)
        names |= {
            "arg": lambda name: names[name],
            "dirname": lambda: str(Path(context["filename"]).parent),
        }
        for key in ("env", "optenv"):
            names.pop(key, None)
        return str(eval(expression, {"__builtins__": {}}, names))

    xacro.safe_eval = checked
    substitution._eval = substituted


def _forgiving(xacro: Any) -> None:
    """Let xacro read comments with two dashes, and name the file in which it finds a fault."""
    from xml.parsers.expat import ExpatError

    parse = xacro.parse

    def read(inp: Any, filename: str | None = None) -> Any:
        if inp is not None:
            return parse(inp, filename)
        place = os.path.join(xacro.root_dir, str(filename))
        try:
            with open(place, encoding="utf-8") as stream:
                text = stream.read()
        except (OSError, UnicodeDecodeError):
            return parse(inp, filename)
        try:
            return parse(_COMMENT.sub(_parted, text))
        except ExpatError as cause:
            raise xacro.XacroException(f"{filename}: {cause}") from cause

    xacro.parse = read


def _parted(comment: re.Match[str]) -> str:
    inner = re.sub(r"-(?=-)", "- ", comment[1])
    return f"<!--{inner} -->" if inner.endswith("-") else f"<!--{inner}-->"


def _refuse_names(expression: str, refusal: type[Exception]) -> None:
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        name = getattr(node, "attr", getattr(node, "id", ""))
        if isinstance(node, ast.Attribute | ast.Name) and _INSIDE.match(name):
            raise refusal(f"'{name}' is not a valid name in an expression")


if __name__ == "__main__":
    # what xacro, or an expression, prints is no answer
    answer = os.dup(1)
    os.dup2(2, 1)
    said = main(*sys.argv[1:]).encode()
    with open(answer, "wb") as out:
        out.write(said)
