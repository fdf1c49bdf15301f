"""Bit-for-bit comparison of the logs of two runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.logs.table import read_parquet
from seals.run.provenance import versions
from seals.untrusted_io import read_json

TABLES = ("log.parquet", "ledger.parquet")


def differences(folder: Path, original: Path) -> list[str]:
    """Return the columns in which the logs of two run folders differ.

    Args:
        folder: one run.
        original: the other.
    """
    found: list[str] = []
    for table in TABLES:
        if not (original / table).is_file():
            found.append(f"{table} (missing)")
            continue
        new, old = read_parquet(folder / table), read_parquet(original / table)
        found += [
            f"{table}:{name}"
            for name in dict.fromkeys([*old, *new])
            if name not in old or name not in new or new[name].tobytes() != old[name].tobytes()
        ]
    return found


def version_changes(original: Path) -> list[str]:
    """Return the packages whose version differs from an earlier run."""
    path = original / "run.json"
    if not path.is_file():
        return []
    noted: dict[str, Any] = read_json(path).get("versions", {})
    now = versions()
    return [
        f"{name} {noted.get(name, 'absent')} then, {now.get(name, 'absent')} now"
        for name in sorted({*noted, *now})
        if noted.get(name) != now.get(name)
    ]
