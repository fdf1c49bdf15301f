"""Numbers and names in elements of plug-ins."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError

SEA_WATER = 1028.0
"""Density that the UUV simulator takes where a file states none [kg/m^3]."""


def vector(element: ElementTree.Element, tag: str, default: str, said: str) -> Floats:
    """Return three numbers, or raise `RobotError`."""
    words = (text_of(element, tag) or default).split()
    if len(words) != 3:
        raise RobotError(f"{said}: {tag} has {len(words)} numbers.\nAllowed: 3.")
    return np.array([finite(word, f"{said}: {tag}") for word in words])


def six_by_six(element: ElementTree.Element, tag: str, said: str) -> Floats | None:
    """Return the matrix (6, 6) of 36 numbers, or the diagonal one of six; None if empty."""
    words = re.split(r"[\s,]+", text_of(element, tag))
    if words == [""]:
        return None
    numbers = np.array([finite(word, f"{said}: {tag}") for word in words])
    if numbers.size == 6:
        return np.diag(numbers)
    if numbers.size != 36:
        raise RobotError(
            f"{said}: {tag} has {numbers.size} numbers.\nAllowed: 6, or 36 row by row."
        )
    return numbers.reshape(6, 6)


def magnitudes(
    element: ElementTree.Element, said: str, names: Mapping[str, str]
) -> dict[str, float]:
    """Return magnitudes of the numbers in child elements, under new names, without zeros."""
    found = {}
    for tag, name in names.items():
        text = text_of(element, tag)
        value = abs(finite(text, f"{said}: {tag}")) if text else 0.0
        if value > 0.0:
            found[name] = value
    return found


def text_of(element: ElementTree.Element, tag: str) -> str:
    """Return the text of a child element; names without the prefix of their model."""
    text = (element.findtext(tag) or "").strip()
    return last_name(text) if tag.lower().endswith(("name",)) else text


def last_name(name: str | None) -> str:
    """Return the name of a link or joint without the prefix of its model."""
    return (name or "").strip().split("::")[-1]


def positive(text: str | None, where: str, unit: str) -> float:
    """Return a number above zero.

    Raises:
        RobotError: it is none.
    """
    value = finite(text, where)
    if value <= 0.0:
        raise RobotError(f"{where}={value:g} is not allowed.\nAllowed: above zero, in {unit}.")
    return value


def fluid_density(element: ElementTree.Element, said: str) -> float:
    """Return the density that a plug-in states, else that of the UUV simulator [kg/m^3]."""
    words = text_of(element, "fluid_density") or str(SEA_WATER)
    return positive(words, f"{said}: fluid_density", "kg/m^3")


def finite(text: str | None, where: str) -> float:
    """Return a finite number.

    Raises:
        RobotError: it is none, or beyond 1e9.
    """
    try:
        value = float((text or "").strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or abs(value) > 1e9:
        raise RobotError(
            f"{where}='{(text or '').strip()[:40]}' is not allowed.\n"
            "Allowed: a finite number up to 1e9."
        )
    return value
