"""Published data sets: address, checksum and licence of each file.

A file comes from an offline folder when the environment variable ``SEALS_DATA`` names one that has
it, else from its public address, once, into the user's cache. Its checksum is compared either way.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar, Protocol, runtime_checkable
from urllib.parse import quote

from seals.errors import LogError, refuse_unlisted
from seals.untrusted_io import read_yaml, regular_file

OFFLINE = "SEALS_DATA"
"""Environment variable: folder with one sub-folder for each data set."""
_SHOWN: set[str] = set()


@dataclass(frozen=True, kw_only=True)
class DataFile:
    """One file of a data set.

    Args:
        path: path inside the public repository.
        sha256: checksum of the public file; None where it was never seen, and then not checked.
        offline: name in the offline folder; left out, the last part of ``path``.
        offline_sha256: checksum of the offline form where it differs from the public one.
    """

    path: str
    sha256: str | None
    offline: str = ""
    offline_sha256: str | None = None

    @property
    def name(self) -> str:
        """Name in the offline folder."""
        return self.offline or self.path.rsplit("/", 1)[-1]

    @property
    def stem(self) -> str:
        """Name without the suffix of its format, the same for both forms."""
        return Path(self.name.removesuffix(".gz")).stem


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """A published data set at one commit of a public repository.

    Args:
        folder: name of its offline folder and of its folder in the cache.
        repository: ``owner/name``.
        commit: the commit whose files were checked.
        licence: short name of the licence.
        attribution: whom to name, and what to cite.
        note: how the offline files differ from the public ones.
        files: what it consists of.
        meta: what its logs have in common of vehicle, surroundings, sensors (``meta.yaml``).
        logs: names of its logs, where they are not those of its files.
    """

    folder: str
    repository: str
    commit: str
    licence: str
    attribution: str
    note: str = ""
    files: tuple[DataFile, ...] = ()
    meta: Mapping[str, Any] = field(default_factory=dict)
    logs: tuple[str, ...] = ()

    def address(self, file: DataFile) -> str:
        """Return the public address of a file."""
        base = f"https://raw.githubusercontent.com/{self.repository}/{self.commit}"
        return f"{base}/{quote(file.path)}"

    @property
    def source(self) -> str:
        """Repository and commit, as it is written into logs."""
        return f"https://github.com/{self.repository} at {self.commit[:12]}"

    def find(self, stem: str) -> DataFile:
        """Return the file of that name, without suffix.

        Raises:
            LogError: the set has no such file.
        """
        by_stem = {file.stem: file for file in self.files}
        refuse_unlisted(
            stem, by_stem, f"data set '{self.folder}' has no file '{stem}'", error=LogError
        )
        return by_stem[stem]


@runtime_checkable
class OfDataset(Protocol):
    """Reader of a published data set, which is fetched where no path is given."""

    dataset: ClassVar[Dataset]
    path: str


def read_dataset(package: str, folder: str) -> Dataset:
    """Return a data set that the ``datasets.yaml`` of a package of readers describes.

    Args:
        package: that holds the file, such as ``seals.plugins.readers``.
        folder: of the data set, a key of the file.
    """
    entry = dict(_described(package)[folder])
    listed = {"sha256": None}
    entries = tuple(DataFile(path=p, **(listed | f)) for p, f in entry.pop("files").items())
    named = tuple(entry.pop("logs", ()))
    return Dataset(folder=folder, files=entries, logs=named, **entry)


@cache
def _described(package: str) -> dict[str, Any]:
    return read_yaml(str(files(package) / "datasets.yaml"))


def _show_on_stderr(text: str) -> None:
    """Print a licence notice where it does not mix with results."""
    print(text, file=sys.stderr)


def locate(
    dataset: Dataset, file: DataFile, *, show: Callable[[str], None] = _show_on_stderr
) -> Path:
    """Return the path of a data file, fetching it on first use.

    Args:
        dataset: the set.
        file: one of its files.
        show: receives the licence notice, once for each set and process.

    Raises:
        LogError: the file is neither offline nor reachable, or its checksum is wrong.
    """
    if dataset.folder not in _SHOWN:
        _SHOWN.add(dataset.folder)
        note = f" {dataset.note}" if dataset.note else ""
        show(f"data set {dataset.folder}: {dataset.licence}. {dataset.attribution}{note}")
    root = os.environ.get(OFFLINE, "")
    offline = Path(root) / dataset.folder / file.name
    if root and offline.exists():
        wanted = file.offline_sha256 or (file.sha256 if not file.offline else None)
        path = regular_file(offline)
        if wanted is not None:
            found = hashlib.sha256(path.read_bytes()).hexdigest()
            if found != wanted:
                raise LogError(
                    f"'{path}' has the checksum {found[:16]}..., expected {wanted[:16]}...\n"
                    "The file is damaged or of another version: remove it and fetch it again."
                )
        return offline
    return _fetch(dataset, file, root)


def paths_of(
    dataset: Dataset,
    source: str | Path | None,
    *,
    files: tuple[DataFile, ...] | None = None,
    show: Callable[[str], None] = _show_on_stderr,
) -> list[Path]:
    """Return the files to read, in the order of the data set.

    Args:
        dataset: the set.
        source: None for the published files; the stem of one of them; or a file or folder of one's
            own, which is not compared with any checksum.
        files: the files meant when ``source`` is None; left out, all.
        show: receives the licence notice.

    Raises:
        LogError: nothing fitting is there.
    """
    if source is None:
        return [locate(dataset, file, show=show) for file in files or dataset.files]
    path = Path(source)
    if path.is_dir():
        names = [name for file in dataset.files for name in (file.name, Path(file.path).name)]
        found = [path / name for name in dict.fromkeys(names) if (path / name).is_file()]
        if not found:
            raise LogError(
                f"'{path}' holds no file of the data set '{dataset.folder}'.\n"
                f"Looked for: {', '.join(dict.fromkeys(names))}"
            )
        return found
    if not path.exists() and path.name == str(source):
        return [locate(dataset, dataset.find(path.name), show=show)]
    return [regular_file(path)]


def _fetch(dataset: Dataset, file: DataFile, root: str) -> Path:
    import pooch
    import requests

    address = dataset.address(file)
    try:
        got = pooch.retrieve(
            url=address,
            known_hash=f"sha256:{file.sha256}" if file.sha256 else None,
            fname=file.path.rsplit("/", 1)[-1],
            path=Path(pooch.os_cache("seals")) / dataset.folder,
            downloader=pooch.HTTPDownloader(timeout=(5, 60)),
        )
    except (requests.RequestException, OSError, ValueError) as error:
        state = f"is '{root}', which lacks {dataset.folder}/{file.name}" if root else "is not set"
        reason = type(error).__name__
        raise LogError(
            f"data set '{dataset.folder}': {OFFLINE} {state}, and {address} gave no valid "
            f"response ({reason}).\nConnect to the network, or set {OFFLINE} to a folder that "
            f"holds {dataset.folder}/{file.name}."
        ) from error
    return Path(got)
