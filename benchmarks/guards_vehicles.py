"""Guards of the readers of vehicles' logs, of their choice, and of maps of columns."""

from __future__ import annotations

from benchmarks.guard import Guard

HOSTILE = "tests/unit/test_hostile_vehicle_logs.py"
FLASH = "tests/unit/test_logs_dataflash.py"
BAGS = "tests/unit/test_logs_rosbag1.py"
_FLASH, _LINK = "seals.plugins.readers.dataflash", "seals.plugins.readers.tlog"
_BAG, _MATLAB = "seals.plugins.readers.recording", "seals.plugins.readers.matlab_file"
_MAP = "seals.logs.column_map"

VEHICLES: dict[str, Guard] = {
    "times of DataFlash": Guard(
        "seals.plugins.readers.dataflash",
        'messages.rows.dtype[name].kind in "iu" if name',
        "True if name",
        HOSTILE,
        "no_whole_number",
    ),
    "parameters that are lists": Guard(
        "seals.plugins.readers.dataflash",
        'messages.letters["Value"] in "nNZa"',
        'messages.letters["Value"] in "nNZ"',
        HOSTILE,
        "no_parameter",
    ),
    "angles without end": Guard(
        "seals.plugins.readers.ned",
        "np.where(np.isfinite(angle), angle, np.nan)",
        "angle",
        HOSTILE,
        "angles",
    ),
    "bytes of no message": Guard(
        _FLASH,
        "while place + 3 <= end and strange <= _MOST_STRANGE * end:",
        "while place + 3 <= end:",
        HOSTILE,
        "given_up_early",
    ),
    "messages of DataFlash": Guard(
        _FLASH, "if count > _MOST_MESSAGES:", "if False:", HOSTILE, "messages_of_all_logs"
    ),
    "messages declared twice": Guard(
        _FLASH,
        "if declared.setdefault(kind, body) != body:",
        "if declared.setdefault(kind, body) is None:",
        FLASH,
        "damaged or twice or broken",
        "pymavlink",
    ),
    "declarations that do not fit": Guard(
        _FLASH,
        "if not fits or 3 + sum(map(_width, letters)) != body[1] or not all(fields):",
        "if not fits:",
        FLASH,
        "fit or damaged or left_out",
        "pymavlink",
    ),
    "packets of telemetry": Guard(
        _LINK, "if count > _MOST_PACKETS:", "if False:", HOSTILE, "packets_and_gaps", "pymavlink"
    ),
    "checksums of packets": Guard(
        _LINK,
        "first = first[_sound(body, known[number].extra)]",
        "first = first[:]",
        HOSTILE,
        "wrong_checksum",
        "pymavlink",
    ),
    "what bags unpack to": Guard(
        _BAG, "if state.unpacked > state.most:", "if False:", HOSTILE, "unpacks_to_so_many"
    ),
    "records that say what they are": Guard(
        _BAG,
        '    if not header.get("op"):\n        raise',
        '    if not header.get("op"):\n        return\n        raise',
        HOSTILE,
        "zeros_are",
    ),
    "declared size of a chunk of a bag": Guard(
        "seals.plugins.readers.mcap_file",
        '    if size > _MOST_RECORD:\n        raise ValueError(f"a chunk',
        '    if False:\n        raise ValueError(f"a chunk',
        BAGS,
        "",
        "rosbags",
    ),
    "unpacking of a bag's chunk": Guard(
        _BAG, "(raw, max_length=size + 1)", "(raw)", HOSTILE, "no_further", "rosbags"
    ),
    "records beyond their chunk": Guard(
        _BAG,
        "if place + 4 + size > len(raw):",
        "if False:",
        HOSTILE,
        "ends_in_its_chunk",
        "rosbags",
    ),
    "filters of HDF5": Guard(
        "seals.isolated_reading",
        "env={**environment(), **_NO_FILTERS},",
        "env=environment(),",
        HOSTILE,
        "no_filter",
        "h5py",
    ),
    "types of HDF5": Guard(
        _MATLAB,
        "            not isinstance(entry, h5py.Dataset)\n            or entry.shape is None",
        "            entry.shape is None",
        HOSTILE,
        "no_array",
        "h5py",
    ),
    "links of MATLAB files": Guard(
        _MATLAB,
        "or not isinstance(group.get(name, getlink=True), h5py.HardLink)",
        "",
        HOSTILE,
        "of_other_files",
        "h5py",
    ),
    "data of MATLAB files elsewhere": Guard(
        _MATLAB,
        "            or entry.external\n            or entry.is_virtual\n",
        "",
        HOSTILE,
        "of_other_files",
        "h5py",
    ),
    "values of MATLAB files": Guard(
        _MATLAB,
        "elif entry.size > _MOST_VALUES:",
        "elif False:",
        HOSTILE,
        "declared_values",
        "h5py",
    ),
    "titles of blanks": Guard(
        "seals.plugins.readers.betaflight",
        'start = whole.rfind("(") if whole.endswith(")") else -1',
        'start = whole.rfind("(") if re.fullmatch(r".*?\\s*(\\([^()]*\\))?x", whole) else -1',
        HOSTILE,
        "heading_of_blanks",
    ),
    "types of a map": Guard(
        _MAP,
        "            read(kind, getattr(self, name), where=name, error=LogError)\n",
        "            pass\n",
        HOSTILE,
        "other_types",
    ),
    "entries of plain data": Guard(
        "seals.schema",
        "span.low <= size <= span.high",
        "True",
        "tests/unit/test_schema_read.py",
        "refused",
    ),
    "finite numbers in plain data": Guard(
        "seals.schema",
        "if not fits or (kind is float and not math.isfinite(value)):",
        "if not fits:",
        "tests/unit/test_schema_read.py",
        "refused",
    ),
    "keys of plain data": Guard(
        "seals.schema",
        "for key in () if extra else [key for key in given if key not in hints]:",
        "for key in ():",
        "tests/unit/test_schema_read.py",
        "refused",
    ),
    "long numbers": Guard(
        "seals.schema",
        "contextlib.suppress(ValueError, OverflowError)",
        "contextlib.suppress(ValueError)",
        HOSTILE,
        "other_types",
    ),
    "numbers beyond": Guard(
        _MAP,
        "if np.any(np.isfinite(values) & ~np.isfinite(ready)):",
        "if False:",
        HOSTILE,
        "factor",
    ),
    "whole segments": Guard(
        "seals.logs.csv",
        "np.all((np.abs(segment) < 2.0**53) & (segment == np.round(segment)))",
        "np.all(np.isfinite(segment))",
        HOSTILE,
        "segment",
    ),
    "kinds of files to choose a reader": Guard(
        "seals.logs.content",
        "file = regular_file(place, most=_MOST)",
        "file = place",
        HOSTILE,
        "for_a_pipe",
    ),
}
