"""Reader of the falling-ball videos."""

from __future__ import annotations

import math
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seals.errors import LogError, refuse_unlisted
from seals.logs.arrays import refuse_hollow
from seals.logs.datasets import Dataset, locate, paths_of, read_dataset
from seals.logs.log import Log
from seals.logs.units import to_si
from seals.plugins.readers.published import ReaderPublished
from seals.untrusted_io import MOST_BYTES, read_bytes, regular_file

DATASET = read_dataset("seals.plugins.readers", "falling-balls")
_SHEETS, _WEIGHTS = DATASET.files
_HEADER = ("Drop #", "Time (s)", "Height (m)")
_MOST_ROWS = 10_000


@dataclass(kw_only=True)
class ReaderBalls(ReaderPublished):
    """Falling-ball videos: balls dropped from a bridge; one log per ball, two drops each.

    Channels:
        ``position_z``, height over the ground; the drops are segments 0 and 1.
    Units:
        Heights are metres already; for ``meta`` ounces -> kg, circumference in cm -> radius in m.
        The file's own velocity is derived from the heights and left out.
    Source:
        https://github.com/briandesilva/discovery-of-physics-from-data
    Licence:
        MIT.
    Limitations:
        15 Hz video; scale and perspective are good to about 0.09 m (residual of the bowling ball
        under pure gravity). Linear drag fits every ball better than the quadratic drag that physics
        expects: a sign of such a bias. The volleyball's weight and size are not given.

    Args:
        path: the spreadsheet, or a folder that holds it.
    """

    dataset: ClassVar[Dataset] = DATASET

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return one log for each ball.

        Raises:
            LogError: the spreadsheet is absent, damaged or lacks a column.
        """
        given = source or self.path or None
        sheets = paths_of(DATASET, given, files=(_SHEETS,))[0]
        beside = sheets.with_name(_WEIGHTS.name)
        if given is None:
            weights = _read_weights(locate(DATASET, _WEIGHTS))
        else:
            weights = _read_weights(beside) if beside.is_file() else {}
        return [
            self._ball(title, rows, weights, where=f"'{sheets}', sheet '{title}'")
            for title, rows in _read_sheets(sheets).items()
        ]

    def _ball(
        self,
        title: str,
        rows: list[tuple[Any, ...]],
        weights: dict[str, tuple[float, float]],
        *,
        where: str,
    ) -> Log:
        names = [str(cell).strip() for cell in rows[0]] if rows else []
        for name in _HEADER:
            refuse_unlisted(
                name,
                names,
                f"{where} has no column '{name}'",
                label="Columns there",
                error=LogError,
            )
        try:
            picked = [[float(row[names.index(name)]) for name in _HEADER] for row in rows[1:]]
        except (TypeError, ValueError) as error:
            raise LogError(f"{where} contains values that are not numbers ({error}).") from error
        table = np.asarray(picked, dtype=np.float64).reshape(-1, 3)
        if not np.isfinite(table).all():
            raise LogError(f"{where} holds a value that is not finite.")
        return self.described(
            title.casefold().replace(" ", "_"),
            {"t": table[:, 1], "position_z": table[:, 2]},
            segment=table[:, 0].astype(np.int64) - 1,
            meta={"vehicle": _vehicle(title, weights)},
        )


def _read_sheets(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Return the rows of every sheet that are not empty, header first.

    Raises:
        LogError: the file is not a spreadsheet of bearable size.
    """
    import openpyxl

    file = regular_file(path, most=1 << 24)
    try:
        with zipfile.ZipFile(file) as archive:
            refuse_hollow(archive, file)
            if sum(item.file_size for item in archive.infolist()) > MOST_BYTES:
                raise LogError(f"'{file}' decompresses to more than {MOST_BYTES:,} bytes.")
        # opened as a stream: the suffix .xls belies an .xlsx, and openpyxl goes by the suffix
        with file.open("rb") as stream:
            book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
            return {sheet.title: _filled(sheet) for sheet in book.worksheets}
    except LogError:
        raise
    except Exception as error:  # openpyxl lets errors of every kind through on damaged files
        raise LogError(f"'{file}' is not a valid spreadsheet ({error}).") from error


def _filled(sheet: Any) -> list[tuple[Any, ...]]:
    rows = []
    # some sheets declare 65,536 rows; the filled ones come first
    for row in sheet.iter_rows(values_only=True, max_row=_MOST_ROWS, max_col=8):
        if all(cell is None for cell in row):
            break
        rows.append(row)
    return rows


def _read_weights(path: Path) -> dict[str, tuple[float, float]]:
    """Return mass [kg] and circumference [m] by ball; balls without measurements are left out.

    Raises:
        LogError: the file cannot be read.
    """
    found: dict[str, tuple[float, float]] = {}
    for line in read_bytes(path, most=1 << 16).decode("utf-8", errors="replace").splitlines()[1:]:
        words = line.split()
        if len(words) == 3 and all(re.fullmatch(r"\d+(\.\d+)?", word) for word in words[1:]):
            numbers = np.array([float(words[1]), float(words[2])])
            mass, girth = to_si(numbers[:1], "oz")[0], to_si(numbers[1:], "cm")[0]
            found[words[0].casefold()] = (float(mass), float(girth))
    return found


def _vehicle(title: str, weights: dict[str, tuple[float, float]]) -> dict[str, Any]:
    # balls.txt writes "wiffleball1", "yellowWiffle"; sheets "Whiffle Ball 1", "Yellow Whiffle Ball"
    key = title.casefold().replace(" ", "").replace("whiffle", "wiffle")
    figures = next((weights[name] for name in weights if key.startswith(name)), None)
    vehicle: dict[str, Any] = {"name": title, "mass": None, "radius": None}
    if figures is not None:
        vehicle |= {"mass": figures[0], "circumference": figures[1]}
        vehicle["radius"] = figures[1] / (2.0 * math.pi)
    return vehicle
