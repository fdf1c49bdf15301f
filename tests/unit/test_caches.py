"""Compiled code is kept where nobody else can put some."""

from __future__ import annotations

import errno
import io
import os
import re
import socket
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from seals.caches import HOME, TORCH, cache_folder, keep, kept, use_private_compiler_cache

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache home of one's own, and no memory of another."""
    monkeypatch.setenv(HOME, str(tmp_path / "cache"))
    for variable in TORCH:
        monkeypatch.delenv(variable, raising=False)
    cache_folder.cache_clear()
    yield tmp_path / "cache"
    cache_folder.cache_clear()


def mode(path: Path) -> int:
    """Return the permissions of a folder."""
    return stat.S_IMODE(path.lstat().st_mode)


def test_a_cache_is_the_users_alone(home: Path) -> None:
    """It is made with the right mode, whatever the mask, and mended where it is too open."""
    before = os.umask(0)
    try:
        found = cache_folder("a")
    finally:
        os.umask(before)
    assert found == home / "seals" / "a"
    assert mode(found) == mode(found.parent) == 0o700
    found.chmod(0o777)
    cache_folder.cache_clear()
    assert cache_folder("a") == found
    assert mode(found) == 0o700


def test_a_relative_home_is_none(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder in the working directory may be a stranger's."""
    monkeypatch.setenv(HOME, "cache")
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    monkeypatch.chdir(tmp_path)
    assert cache_folder("a") == tmp_path / "me" / ".cache" / "seals" / "a"


@pytest.mark.parametrize("how", ["link", "file", "other"])
def test_a_folder_that_is_not_ours_is_left(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """A link, a file, or a folder of another user: a temporary one takes its place, in words."""
    place = home / "seals" / "a"
    place.parent.mkdir(parents=True, mode=0o700)
    if how == "link":
        (tmp_path / "open").mkdir()
        place.symlink_to(tmp_path / "open")
    elif how == "file":
        place.write_text("")
    else:
        place.mkdir()
        owner = os.getuid() + 1
        monkeypatch.setattr(os, "getuid", lambda: owner)
    found = cache_folder("a")
    monkeypatch.undo()
    assert found != place
    assert found.is_dir()
    assert mode(found) == 0o700
    assert "used only by this process" in capsys.readouterr().err


def _link_in_a_circle(place: Path) -> None:
    place.symlink_to(place.name)


def _planted(place: Path) -> None:
    place.mkdir()
    place.chmod(0o777)
    (place / "kernel.so").write_bytes(b"somebody's")


def _by_the_group(place: Path) -> None:
    _planted(place)
    place.chmod(0o770)


def _link_to_nothing(place: Path) -> None:
    place.symlink_to(place.with_name("nothing"))


def _link_of_the_whole(place: Path) -> None:
    place.parent.rmdir()
    (place.parent.parent / "elsewhere").mkdir()
    place.parent.symlink_to(place.parent.parent / "elsewhere")


def _file_for_the_whole(place: Path) -> None:
    place.parent.rmdir()
    place.parent.write_text("")


def _open_above(place: Path) -> None:
    place.parent.parent.chmod(0o777)


def _socket(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as ear:
        ear.bind(os.path.relpath(place))


STRANGE: dict[str, Callable[[Path], Any]] = {
    "a pipe": os.mkfifo,
    "a socket": _socket,
    "a link in a circle": _link_in_a_circle,
    "a link to nothing": _link_to_nothing,
    "a link to a device": lambda place: place.symlink_to("/dev/null"),
    "a link of the whole": _link_of_the_whole,
    "a file for the whole": _file_for_the_whole,
    "what others put there": _planted,
    "what the group put there": _by_the_group,
    "a folder above in which everybody can rename": _open_above,
}


@pytest.mark.parametrize("kind", STRANGE)
def test_strange_folders_are_left(
    home: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever stands there is neither used nor changed, and said."""
    place = home / "seals" / "a"
    place.parent.mkdir(parents=True, mode=0o700)
    home.chmod(0o700)
    STRANGE[kind](place)
    before = sorted(home.rglob("*"))
    found = cache_folder("a")
    assert home not in found.parents
    assert mode(found) == 0o700
    assert sorted(home.rglob("*")) == before
    assert "used only by this process" in capsys.readouterr().err


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EROFS, errno.EDQUOT, errno.EIO])
def test_a_disk_that_takes_nothing_keeps_no_cache(
    home: Path, monkeypatch: pytest.MonkeyPatch, error: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """A full disk still takes a name: only what is written tells."""

    class Full(io.BytesIO):
        def write(self, content: Any) -> int:
            raise OSError(error, os.strerror(error))

    monkeypatch.setattr("seals.caches.tempfile.TemporaryFile", lambda **_: Full())
    assert home not in cache_folder("a").parents
    assert os.strerror(error) in capsys.readouterr().err


def test_nobody_has_a_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """An account without a folder of its own gets one for the process."""

    def none() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv(HOME)
    monkeypatch.setattr(Path, "home", none)
    assert mode(cache_folder("a")) == 0o700


def test_a_folder_above_with_the_sticky_bit_serves(home: Path) -> None:
    """Where nobody renames what is another's, as in the temporary folder, a cache may lie."""
    home.mkdir()
    home.chmod(0o1777)
    assert cache_folder("a") == home / "seals" / "a"


def test_what_is_kept_is_what_was_written(tmp_path: Path) -> None:
    """A file that is damaged, a pipe, a folder or nothing is not there."""
    place = tmp_path / "a.o"
    keep(place, b"code" * 100)
    assert kept(place) == b"code" * 100
    whole = place.read_bytes()
    for damaged in (whole[:-1], whole[:50] + b"x" + whole[51:], whole[:20], b""):
        place.write_bytes(damaged)
        assert kept(place) is None
    os.mkfifo(tmp_path / "pipe")
    assert [kept(tmp_path / name) for name in ("pipe", "none", ".")] == [None] * 3


def test_kept_files_do_not_fill_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ones unused for longest go first; what was just written stays, whatever its size."""
    monkeypatch.setattr("seals.caches.MOST", 1000)
    for k, name in enumerate("abc"):
        keep(tmp_path / name, bytes(300))
        os.utime(tmp_path / name, (k, k))
    assert kept(tmp_path / "a") is not None
    keep(tmp_path / "d", bytes(300))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "c", "d"]
    keep(tmp_path / "e", bytes(3000))
    assert [p.name for p in tmp_path.iterdir()] == ["e"]
    assert kept(tmp_path / "e") is None  # larger than all that may be there


def test_the_compiler_is_told_once(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PyTorch finds its cache by the environment; what the user says stands."""
    first, second = TORCH
    monkeypatch.setenv(second, "/said/by/the/user")
    use_private_compiler_cache()
    assert os.environ[first] == str(home / "seals" / "inductor")
    assert os.environ[second] == "/said/by/the/user"
    del os.environ[first]


def test_every_compiler_is_told() -> None:
    """Wherever a compiler with a cache starts, its folder is named beside it."""
    starts = re.compile(r"torch\.compile\(|\bti\.init\(")
    rooms = [ROOT / room for room in ("seals", "plugins", "robots", "animals", "experiments")]
    texts = [path.read_text(encoding="utf-8") for room in rooms for path in room.rglob("*.py")]
    found = [text for text in texts if starts.search(text)]
    assert len(found) == 2
    assert all("from seals.caches import" in text for text in found)


def test_no_predictable_name_in_the_temporary_folder() -> None:
    """The system's temporary folder is everybody's: names in it are random."""
    fixed = re.compile(r"gettempdir|[\"']/tmp\b|[\"']/var/tmp\b")
    for room in ("seals", "plugins", "robots", "animals", "experiments"):
        for path in (ROOT / room).rglob("*.py"):
            assert not fixed.search(path.read_text(encoding="utf-8")), path
