"""Whether the files of the installed package are its own, by the record of its installation.

The package index holds another project called ``seals``, which a well-known library for imitation
learning needs. Installed after this one, it writes over the files of the same names.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution, distributions
from pathlib import Path
from typing import NamedTuple

NAME, OTHER = "aam-seals", "seals"
"""Name of this distribution, and of the one that has a package of the same name."""
_SOURCES = (".py", ".yaml", ".urdf", ".jinja", ".js")


class _Overwritten(NamedTuple):
    """Files of the package that are not as they were installed.

    Args:
        changed: paths in the environment, of another content.
        missing: paths that are gone.
        by: distributions that list the same paths, with their versions.
    """

    changed: tuple[str, ...]
    missing: tuple[str, ...]
    by: tuple[str, ...]

    @property
    def words(self) -> str:
        """What happened, and how to mend it; empty where all is as it was."""
        count = len(self.changed) + len(self.missing)
        if not count:
            return ""
        first = (*self.changed, *self.missing)[0]
        who = f" by {', '.join(self.by)}" if self.by else ""
        return (
            f"files of this package overwritten or removed{who}: {count}, such as {first}; "
            f"install {NAME} in an environment of its own (docs: start, the other package seals)"
        )


def overwritten(name: str = NAME) -> _Overwritten:
    """Compare every file of the installed package with the record of its installation.

    An installation for development lists none of its sources: nothing is compared.

    Raises:
        PackageNotFoundError: the package is not installed.
    """
    return _compared(distribution(name), None)


def overwritten_by_other() -> str:
    """Return one line where the other package has files of this one's names; empty for none.

    Quick where the other one is not installed, as nearly always.
    """
    try:
        other, own = distribution(OTHER), distribution(NAME)
    except PackageNotFoundError:
        return ""
    return _compared(own, {str(path) for path in other.files or ()}).words


def _compared(own: Distribution, among: Iterable[str] | None) -> _Overwritten:
    changed, missing = [], []
    for path in own.files or ():
        if path.hash is None or path.suffix not in _SOURCES:
            continue
        if among is not None and str(path) not in among:
            continue
        file = Path(str(path.locate()))
        if not file.is_file():
            missing.append(str(path))
        elif path.hash.mode == "sha256" and _code(file) != path.hash.value:
            changed.append(str(path))
    wrong = {*changed, *missing}
    by = {
        f"{other.metadata['Name']} {other.version}"
        for other in (distributions() if wrong else ())
        if other.metadata["Name"] != own.metadata["Name"]
        and wrong & {str(path) for path in other.files or ()}
    }
    return _Overwritten(tuple(changed), tuple(missing), tuple(sorted(by)))


def _code(file: Path) -> str:
    """Return a checksum as the record of an installation writes it."""
    found = hashlib.sha256(file.read_bytes()).digest()
    return base64.urlsafe_b64encode(found).decode().rstrip("=")
