"""Reader of MATLAB files with a column map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seals.errors import LogError, suggestion
from seals.isolated_reading import read_isolated
from seals.logs.csv import log_of_columns
from seals.logs.log import Log
from seals.plugins.readers.mapped import ReaderMapped
from seals.untrusted_io import regular_file


@dataclass(kw_only=True)
class ReaderMatlab(ReaderMapped):
    """MATLAB files (``.mat``, 4 to 7.3) with a map of arrays to channels, scales, units and signs.

    Channels:
        Those of the map; without one, arrays that are called as columns of a log.
    Units:
        As declared, as in the reader ``csv``.
    Limitations:
        All mapped arrays share the clock of the array that is mapped to ``t``, and have as many
        rows. Tables, timeseries and other objects are not read: save their numbers as arrays
        (``t = ts.Time; x = ts.Data; save('log.mat', 't', 'x')``). Read in a process of its own.

    Args:
        path: the file.
        columns: array of the file (``t``, ``imu.gyro[0]``: first column of a matrix in a structure)
            -> column of the log.
    """

    kind: ClassVar[str] = "MATLAB"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
            MissingExtra: h5py is absent and the file is of MATLAB 7.3.
        """
        given, chosen = self.given(source), self.chosen()
        found = read_isolated("seals.plugins.readers.matlab_file:arrays_of", regular_file(given))
        left_out = found.pop("")
        there = {theirs: values.size for theirs, values in found.items()}
        for theirs in self.columns:
            if theirs not in there:
                words = suggestion(theirs, there, label="Arrays there", most=40)
                more = f"\nNot columns of numbers: {', '.join(left_out)}" if left_out else ""
                raise LogError(f"'{given}' has no array '{theirs}'.\n{words}{more}")
        clock = next((theirs for theirs, ours in self.columns.items() if ours == "t"), "t")
        if clock not in there:
            raise LogError(
                f"'{given}': no array is mapped to the time 't' [s].\n"
                "Name it: columns={NAME: t, ...}. " + suggestion("t", there, label="Arrays there")
            )
        rows = there[clock]
        for theirs in self.columns:
            if there[theirs] != rows:
                raise LogError(
                    f"'{given}': '{theirs}' has {there[theirs]:,} rows, the time '{clock}' has "
                    f"{rows:,}.\nMap arrays of one clock, or resample them: interp1(t1, x1, t)"
                )
        names = self.columns or [theirs for theirs, size in there.items() if size == rows]
        raw = {theirs: found[theirs] for theirs in names}
        return [
            log_of_columns(given, raw, chosen, meta=self.meta, name=self.name, licence=self.licence)
        ]
