"""Published data sets: the offline folder, checksums, licences, and no network."""

from __future__ import annotations

import functools
import hashlib
import http.server
import importlib
import pkgutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pooch
import pytest
import requests

import seals.plugins.readers as package
from seals.errors import LogError, MissingExtra
from seals.logs import datasets
from seals.logs.datasets import DataFile, Dataset, locate, paths_of
from seals.plugins.readers.impack import ReaderImpack

CONTENT = b"t,depth\n0,1\n"
FILE = DataFile(path="data/some file.csv", sha256=hashlib.sha256(CONTENT).hexdigest())
PACKED = DataFile(
    path="data/b.csv",
    sha256="0" * 64,
    offline="b.csv.gz",
    offline_sha256=hashlib.sha256(CONTENT).hexdigest(),
)
SET = Dataset(
    folder="some-set",
    repository="owner/name",
    commit="c" * 40,
    licence="CC0 1.0",
    attribution="Cite us.",
    files=(FILE, PACKED),
)


@pytest.fixture
def offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the offline form of both files."""
    folder = tmp_path / "data" / SET.folder
    folder.mkdir(parents=True)
    (folder / "some file.csv").write_bytes(CONTENT)
    (folder / "b.csv.gz").write_bytes(CONTENT)
    monkeypatch.setenv("SEALS_DATA", str(tmp_path / "data"))
    monkeypatch.setattr(datasets, "_SHOWN", set())
    return folder


@pytest.fixture
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every fetch fails as without a network."""

    def _fail(**_: object) -> str:
        raise requests.ConnectionError("no route")

    monkeypatch.setattr(pooch, "retrieve", _fail)


def test_offline_folder_is_used_and_the_licence_shown_once(offline: Path) -> None:
    """The file comes from the folder; the licence is shown on first use only."""
    shown: list[str] = []
    first = locate(SET, FILE, show=shown.append)
    second = locate(SET, PACKED, show=shown.append)
    assert (first, second) == (offline / "some file.csv", offline / "b.csv.gz")
    assert len(shown) == 1
    assert "CC0 1.0" in shown[0]
    assert "Cite us." in shown[0]


def test_damaged_offline_file_is_refused(offline: Path) -> None:
    """A file that differs from its checksum is not read."""
    (offline / "some file.csv").write_bytes(CONTENT + b"1,2\n")
    with pytest.raises(LogError, match="checksum"):
        locate(SET, FILE, show=lambda _: None)


@pytest.mark.usefixtures("no_network")
def test_without_folder_and_network_both_ways_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The refusal tells of SEALS_DATA and of the address that did not answer."""
    monkeypatch.delenv("SEALS_DATA", raising=False)
    with pytest.raises(LogError) as caught:
        locate(SET, FILE, show=lambda _: None)
    text = str(caught.value)
    assert "SEALS_DATA is not set" in text
    assert "https://raw.githubusercontent.com/owner/name/" + "c" * 40 in text
    assert "data/some%20file.csv" in text
    assert "some-set/some file.csv" in text


@pytest.mark.usefixtures("no_network")
def test_folder_that_lacks_the_file_is_named(offline: Path) -> None:
    """With SEALS_DATA set but incomplete, the refusal says what is lacking."""
    (offline / "b.csv.gz").unlink()
    with pytest.raises(LogError, match=r"lacks some-set/b\.csv\.gz"):
        locate(SET, PACKED, show=lambda _: None)


def test_fetch_asks_for_the_public_checksum(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the network the public file is wanted, with the public file's checksum."""
    asked: dict[str, object] = {}

    def _note(**options: object) -> str:
        asked.update(options)
        return "/cache/b.csv"

    monkeypatch.delenv("SEALS_DATA", raising=False)
    monkeypatch.setattr(pooch, "retrieve", _note)
    assert locate(SET, PACKED, show=lambda _: None) == Path("/cache/b.csv")
    assert asked["known_hash"] == "sha256:" + "0" * 64
    assert str(asked["url"]).endswith("/data/b.csv")


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Keep the test's output clean."""


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A web server on this machine in place of the public address; its folder."""
    monkeypatch.delenv("SEALS_DATA", raising=False)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setattr(pooch, "os_cache", lambda _: tmp_path / "cache")
    (tmp_path / "www").mkdir()
    handler = functools.partial(_Quiet, directory=str(tmp_path / "www"))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as running:
        base = f"http://127.0.0.1:{running.server_address[1]}"
        monkeypatch.setattr(
            Dataset, "address", lambda _, file: f"{base}/{file.path.split('/')[-1]}"
        )
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield tmp_path / "www"
        running.shutdown()
        thread.join()


def test_file_is_fetched_once_and_kept(server: Path) -> None:
    """The first use fetches the file into the cache; the second needs no network."""
    (server / "some file.csv").write_bytes(CONTENT)
    first = locate(SET, FILE, show=lambda _: None)
    assert first.read_bytes() == CONTENT
    (server / "some file.csv").unlink()
    assert locate(SET, FILE, show=lambda _: None) == first


def test_fetched_file_of_another_content_is_not_kept(server: Path) -> None:
    """A file whose checksum differs is refused and does not stay in the cache."""
    (server / "some file.csv").write_bytes(b"<html>not found</html>")
    with pytest.raises(LogError, match="gave no valid response"):
        locate(SET, FILE, show=lambda _: None)
    assert [path for path in server.parent.glob("cache/**/*") if path.is_file()] == []


def test_source_may_be_a_stem_a_file_or_a_folder(offline: Path, tmp_path: Path) -> None:
    """A stem means the published file; a path means one's own."""

    def _find(source: object) -> list[Path]:
        return paths_of(SET, source, show=lambda _: None)  # type: ignore[arg-type]

    own = tmp_path / "mine.csv"
    own.write_bytes(CONTENT)
    assert _find("b") == [offline / "b.csv.gz"]
    assert _find(own) == [own]
    assert _find(offline) == [offline / "some file.csv", offline / "b.csv.gz"]
    with pytest.raises(LogError, match="has no file 'bb'"):
        _find("bb")
    with pytest.raises(LogError, match="holds no file of the data set"):
        _find(tmp_path)


def test_every_shipped_set_is_fully_described() -> None:
    """Each set pins a commit, names its licence, and each checksum is one."""
    found = 0
    for entry in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{entry.name}")
        described = getattr(module, "DATASET", None)
        if described is None:
            continue
        found += 1
        assert len(described.commit) == 40
        assert described.licence
        assert described.attribution
        for file in described.files:
            sums = [file.sha256, file.offline_sha256]
            assert any(sums)
            assert all(len(value) == 64 for value in sums if value)
    assert found == 8


def test_ide_recording_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A .ide file without idelib asks for the extra by name."""
    monkeypatch.setitem(__import__("sys").modules, "idelib", None)
    file = tmp_path / "2mps_sphere_1.ide"
    file.write_bytes(b"x")
    with pytest.raises(MissingExtra, match=r"aam-seals\[logs\]"):
        ReaderImpack().read(file)
