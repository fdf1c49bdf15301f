"""Kernel functions and neighbour searches to choose from."""

from __future__ import annotations

from enum import Enum


class Kernel(Enum):
    """Shapes of the smoothing kernel."""

    spline = "spline"
    wendland = "wendland"


class Search(Enum):
    """Kind of neighbour search: stored list per substep, or cell search in each pass."""

    auto = "auto"
    list = "list"
    cells = "cells"
