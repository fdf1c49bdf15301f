"""SEALS: robots that cross sea, air and land, and a model that says what it is missing."""

from __future__ import annotations

__version__ = "0.1.0"
