"""Macros of a stranger: no environment, no other files, no code, little time and memory."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seals.errors import RobotError
from seals.isolated_reading import bound
from seals.robot import macros_child, structure
from seals.robot.structure import expanded

pytest.importorskip("xacro", reason="xacro is not installed")
SPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
FILE = f'<robot name="r" {SPACE}>{{}}</robot>'
LINK = '<link name="{}"/>'
DOUBLED = "".join(
    f'<xacro:macro name="m{k}"><xacro:m{k + 1}/><xacro:m{k + 1}/></xacro:macro>' for k in range(60)
)
HOSTILE: dict[str, tuple[str, str]] = {
    "a tower of powers": (LINK.format("${10**10**9}"), "take too long"),
    "a macro that calls itself": (
        '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>',
        "includes itself, or is nested too deep",
    ),
    "two macros that call each other": (
        '<xacro:macro name="a"><xacro:b/></xacro:macro><xacro:macro name="b"><xacro:a/>'
        "</xacro:macro><xacro:a/>",
        "nested too deep",
    ),
    "a file that includes itself": ('<xacro:include filename="a.xacro"/>', "nested too deep"),
    "macros that double": (
        DOUBLED + '<xacro:macro name="m60"/><xacro:m0/>',
        "take too long|MB",
    ),
    "a long text": (LINK.format("${'a' * 10**10}"), "take more than|MB"),
    "a long list": (LINK.format("${len(list(range(10**10)))}"), "take more than|compute|MB"),
    "a large result": (LINK.format("${'a' * 6 * 10**6}"), "it expands to 6,"),
    "the environment": (LINK.format("$(env SECRET)"), "SECRET"),
    "the environment, or not": (LINK.format("$(optenv SECRET none)"), ""),
    "the environment by eval": (LINK.format("$(eval env('SECRET'))"), "Environment variables"),
    "inner names by eval": (LINK.format("$(eval x._y)"), "is not a valid name"),
    "inner names": (LINK.format("${(1).__class__}"), "is not a valid name"),
    "settings elsewhere": (
        LINK.format("${xacro.load_yaml('../secret.yaml')['key']}"),
        "is elsewhere",
    ),
    "settings that are hidden": (
        LINK.format("${xacro.load_yaml('.hidden/secret.yaml')['key']}"),
        "is elsewhere",
    ),
    "a device as settings": (LINK.format("${xacro.load_yaml('/dev/zero')}"), "is elsewhere"),
    "a device": ('<xacro:include filename="/dev/zero"/>', "is elsewhere"),
    "a file of the system": ('<xacro:include filename="/etc/passwd"/>', "is elsewhere"),
    "a way out": ('<xacro:include filename="../../../etc/passwd"/>', "is elsewhere"),
    "a link out": ('<xacro:include filename="link.xacro"/>', "is elsewhere"),
    "a pipe": ('<xacro:include filename="pipe.xacro"/>', "is not a regular file"),
    "a huge file": ('<xacro:include filename="huge.xacro"/>', "is not a regular file"),
    "a folder": ('<xacro:include filename="."/>', "is not a regular file"),
    "a package above": ('<xacro:include filename="$(find ..)/secret.yaml"/>', "is elsewhere"),
    "a package by its path": ('<xacro:include filename="$(find /etc)/passwd"/>', "no package"),
    "an address": ('<xacro:include filename="http://127.0.0.1:9/x"/>', "No such file"),
    "a pattern elsewhere": ('<xacro:include filename="/**/*.yaml"/>', ""),
    "tags of Python": (LINK.format("${xacro.load_yaml('tag.yaml')}"), "python/object/apply"),
    "modules by eval": (LINK.format("$(eval __import__)"), "is not a valid name"),
    "attributes by name": (LINK.format("${getattr(1, 'real')}"), "'getattr' is not defined"),
    "a function of itself": (LINK.format("${(lambda f: f(f))(lambda f: f(f))}"), "nested too deep"),
    "a wide number": (LINK.format("${'%9999999999d' % 1}"), "more than 1024 MB"),
    "a list by assignment": (LINK.format("${[y := 'x'] * 10**9}"), "more than 1024 MB"),
    "elements in elements": ("<a>" * 20_000 + "</a>" * 20_000, "nested too deep"),
    "properties in a circle": (
        '<xacro:property name="a" value="${b}"/><xacro:property name="b" value="${a}"/>'
        + LINK.format("${a}"),
        "recursive|lazy",
    ),
    "half a character": ('<link name="&#xD800;"/>', "invalid character"),
    "entities that double": ("entities", "amplification|MB|too long"),
    "an entity elsewhere": ("elsewhere", ""),
}
ENTITIES = {
    "entities": '<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY a{k} "{(f"&a{k - 1};" if k else "&a;") * 10}">' for k in range(9)),
    "elsewhere": '<!ENTITY a8 SYSTEM "file:../secret.yaml">',
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for the macros, with much around that is none of their business."""
    monkeypatch.setenv("SECRET", "hunter2")
    folder = tmp_path / "robot"
    (folder / ".hidden").mkdir(parents=True)
    for file in (tmp_path / "secret.yaml", folder / ".hidden" / "secret.yaml"):
        file.write_text("key: hunter2\n")
    (folder / "tag.yaml").write_text("!!python/object/apply:os.mkdir [mark]\n")
    (folder / "link.xacro").symlink_to("/etc/passwd")
    os.mkfifo(folder / "pipe.xacro")
    with (folder / "huge.xacro").open("wb") as stream:
        stream.truncate(1 << 34)
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_macros_end_in_words(place: Path, name: str) -> None:
    """None of them copies a secret, runs anything, waits without end or fills the memory."""
    text, words = HOSTILE[name]
    document = FILE.format(
        '<a b="&a8;"/>' if text == "entities" else "<a>&a8;</a>" if text in ENTITIES else text
    )
    kinds = f"<!DOCTYPE robot [{ENTITIES[text]}]>" if text in ENTITIES else ""
    (place / "a.xacro").write_text(kinds + document)
    start = time.monotonic()
    if words:
        with pytest.raises(RobotError, match=words) as refusal:
            expanded(place / "a.xacro")
        assert "hunter2" not in str(refusal.value)
    else:
        assert "hunter2" not in expanded(place / "a.xacro")
    assert time.monotonic() - start < structure.PATIENCE + 5.0
    assert not (place / "mark").exists()


def test_code_of_the_working_directory_does_not_run(place: Path) -> None:
    """A stranger's modules beside the macros are not taken for those of the installation."""
    for name in ("xacro", "json", "yaml", "resource", "contextlib"):
        (place / f"{name}.py").write_text("open('mark', 'w').close()\nraise SystemExit(0)\n")
    (place / "a.xacro").write_text(FILE.format(LINK.format("${1 + 1}")))
    assert 'name="2"' in expanded(place / "a.xacro")
    assert not (place / "mark").exists()


def test_ordinary_macros_are_expanded(place: Path) -> None:
    """Arithmetic, arguments, properties, files beside and in the package beside, settings."""
    (place / "b.xacro").write_text(FILE.format('<xacro:property name="n" value="4"/>'))
    (place / "c.yaml").write_text("wide: 7\n")
    text = '<xacro:arg name="x" default="3"/><xacro:include filename="b.xacro"/>'
    text += LINK.format("${n * 2}_$(arg x)_$(eval x + 1)_$(eval x * 2)")
    text += LINK.format("${xacro.load_yaml('c.yaml')['wide']}_${radians(180)}")
    (place / "a.xacro").write_text(FILE.format(text))
    found = expanded(place / "a.xacro")
    assert 'name="8_3_4_6"' in found
    assert 'name="7_3.14' in found


def test_a_package_beside_may_be_included(place: Path) -> None:
    """Packages of ROS lie beside each other and use each other's files."""
    ours, theirs = place / "ours" / "urdf", place / "theirs"
    ours.mkdir(parents=True)
    theirs.mkdir()
    (place / "ours" / "package.xml").write_text("<package/>")
    (theirs / "b.xacro").write_text(FILE.format(LINK.format("wheel")))
    (ours / "a.xacro").write_text(FILE.format('<xacro:include filename="../../theirs/b.xacro"/>'))
    assert "wheel" in expanded(ours / "a.xacro")


def test_the_process_gets_no_environment(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it is given is what Python needs to start."""
    seen: dict[str, Any] = {}

    def run(words: list[str], **how: Any) -> Any:
        seen.update(how, words=words)
        return subprocess.CompletedProcess(words, 0, b'{"urdf": "<robot/>"}')

    monkeypatch.setattr(subprocess, "run", run)
    expanded(place / "a.xacro")
    assert set(seen["env"]) <= set(structure._KEPT)
    assert seen["timeout"] == structure.PATIENCE
    assert "-c" not in seen["words"]


@pytest.mark.parametrize(
    "answer", [b"", b"{", b"[]", b"[" * 100_000, b'{"urdf": 1}', b"\xff", b"null"]
)
def test_a_strange_answer_is_a_refusal(
    place: Path, monkeypatch: pytest.MonkeyPatch, answer: bytes
) -> None:
    """The process handles what a stranger wrote: its answer is not believed to be sound."""
    done = subprocess.CompletedProcess([], 1, answer)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done)
    with pytest.raises(RobotError, match="cannot expand it"):
        expanded(place / "a.xacro")


@pytest.mark.parametrize(
    "event",
    [
        *("os.system", "os.exec", "os.posix_spawn", "os.fork", "subprocess.Popen", "os.remove"),
        *("socket.connect", "socket.__new__", "ctypes.dlopen", "os.rename", "os.symlink"),
        *("shutil.copyfile", "os.mkdir", "os.kill", "os.truncate", "urllib.Request"),
    ],
)
def test_macros_may_not_act(place: Path, event: str) -> None:
    """Whatever an expression gets hold of, the interpreter refuses to act."""
    with pytest.raises(PermissionError, match="may not do this"):
        macros_child._watch(event, (), (place,), ())


def test_macros_read_near_files_only(place: Path) -> None:
    """No writing, nothing elsewhere, nothing hidden, no device; modules may be loaded."""
    (place / "b.xacro").touch()
    code = (os.path.dirname(os.__file__),)
    macros_child._may_read((str(place / "b.xacro"), "r", os.O_RDONLY), (place,), code)
    macros_child._may_read((os.__file__, "rb", os.O_RDONLY), (place,), code)
    for words in (
        (str(place / "b.xacro"), "w", 0),
        (str(place / "b.xacro"), None, os.O_WRONLY),
        (str(place / "b.xacro"), "r+", 0),
        ("/etc/passwd", "r", 0),
        (str(place / "link.xacro"), "r", 0),
        (str(place / ".hidden" / "secret.yaml"), "r", 0),
        (str(place / "pipe.xacro"), "r", 0),
        (os.__file__ + "/../../../../etc/passwd", "r", 0),
        (os.fsencode("/dev/zero"), "rb", 0),
        (str(place / "huge.xacro"), "r", 0),
    ):
        with pytest.raises(PermissionError):
            macros_child._may_read(words, (place,), code)


@pytest.mark.parametrize("event", ["os.listdir", "os.scandir"])
def test_macros_look_into_near_folders_only(place: Path, event: str) -> None:
    """A pattern of files searches folders: those of the file, and of the modules."""
    code = (os.path.dirname(os.__file__),)
    for near in (str(place), os.fsencode(place), None, code[0], f"{code[0]}/json"):
        macros_child._watch(event, (near,), (place,), code)
    for far in ("/", "/etc", "..", str(place / ".hidden"), place.parent, f"{code[0]}x"):
        with pytest.raises(PermissionError, match="not read other folders"):
            macros_child._watch(event, (far,), (place,), code)


@pytest.mark.parametrize("name", ["_x", "gi_frame", "f_globals", "vars", "type", "mro", "cr_code"])
def test_inner_names_are_refused(name: str) -> None:
    """Names through which an expression would get at the interpreter."""
    for text in (f"a.{name}", f"{name}(1)", f"[{name} for k in range(3)]", f"lambda: {name}"):
        with pytest.raises(RobotError, match="is not a valid name"):
            macros_child._refuse_names(text, RobotError)
    macros_child._refuse_names("radians(x) + math.pi", RobotError)


def test_eval_has_no_functions_of_python() -> None:
    """What stands in ``$(eval ...)`` sees arguments and mathematics."""

    def real(*_: Any) -> str:
        raise AssertionError

    xacro = SimpleNamespace(safe_eval=real, XacroException=RobotError)
    known = {"env": real, "optenv": real, "sqrt": math.sqrt}
    sub = SimpleNamespace(convert_value=lambda value, _: value, _eval_dict=known, _eval=real)
    macros_child._arithmetic_only(xacro, sub)
    context = {"arg": {"x": 4.0}, "filename": "/a/b.xacro"}
    assert sub._eval("sqrt(x) + arg('x')", context) == "6.0"
    assert sub._eval("dirname()", context) == "/a"
    for name in ("open", "exec", "eval", "getattr", "compile", "input", "breakpoint", "env"):
        with pytest.raises(NameError):
            sub._eval(f"{name}('x')", context)
    with pytest.raises(RobotError, match="is not a valid name"):
        sub._eval("x.__class__", context)
    with pytest.raises(RobotError, match="is not a valid name"):
        xacro.safe_eval("vars(x)", {})


@pytest.mark.skipif(sys.platform == "win32", reason="no such bounds")
def test_the_process_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time, memory and files: a bound for each."""
    import resource

    bounds: dict[int, tuple[int, int]] = {}
    monkeypatch.setattr(resource, "setrlimit", bounds.__setitem__)
    bound(macros_child.SECONDS, macros_child.MOST_MEMORY)
    most = {"CPU": macros_child.SECONDS, "AS": macros_child.MOST_MEMORY, "FSIZE": 0, "CORE": 0}
    assert bounds == {getattr(resource, f"RLIMIT_{key}"): (n, n) for key, n in most.items()}


def test_all_arguments_without_a_value_are_named_at_once(tmp_path: Path) -> None:
    """A file that asks for several is not refused for one after the other."""
    file = tmp_path / "a.xacro"
    arguments = '<xacro:arg name="c" default="1"/><link name="$(arg a)$(arg b)$(arg c)"/>'
    file.write_text(FILE.format(arguments), encoding="utf-8")
    with pytest.raises(RobotError, match=r"\(without a value: a, b\)"):
        expanded(file)
