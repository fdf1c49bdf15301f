"""Logs: the native format, its reading and writing, and data-quality checks."""

from __future__ import annotations

from seals.logs.channels import CHANNELS as CHANNELS
from seals.logs.channels import Channel as Channel
from seals.logs.check import check_log as check_log
from seals.logs.check import refuse_if_bad as refuse_if_bad
from seals.logs.finding import Finding as Finding
from seals.logs.finding import Severity as Severity
from seals.logs.log import Log as Log
from seals.logs.native import read_native as read_native
from seals.logs.native import write_native as write_native
from seals.logs.reader import Reader as Reader
