"""Compiled code is kept where nobody else can put some."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from seals.caches import HOME, TORCH, cache_folder, use_private_compiler_cache

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
    assert "kept for this process alone" in capsys.readouterr().err


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
    starts = re.compile(r"torch\.compile\(|_inductor import compile|\bti\.init\(")
    rooms = [ROOT / room for room in ("seals", "plugins", "robots", "animals", "experiments")]
    texts = [path.read_text(encoding="utf-8") for room in rooms for path in room.rglob("*.py")]
    found = [text for text in texts if starts.search(text)]
    assert len(found) == 3
    assert all("from seals.caches import" in text for text in found)


def test_no_predictable_name_in_the_temporary_folder() -> None:
    """The system's temporary folder is everybody's: names in it are random."""
    fixed = re.compile(r"gettempdir|[\"']/tmp\b|[\"']/var/tmp\b")
    for room in ("seals", "plugins", "robots", "animals", "experiments"):
        for path in (ROOT / room).rglob("*.py"):
            assert not fixed.search(path.read_text(encoding="utf-8")), path
