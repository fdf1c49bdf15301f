"""Logs: the native format, its reading and writing, and data-quality checks."""

from __future__ import annotations

from seals.logs.channels import CHANNELS, Channel
from seals.logs.check import check_log, refuse_if_bad
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log
from seals.logs.native import read_native, write_native
from seals.logs.reader import Reader

__all__ = [
    "CHANNELS",
    "Channel",
    "Finding",
    "Log",
    "Reader",
    "Severity",
    "check_log",
    "read_native",
    "refuse_if_bad",
    "write_native",
]
