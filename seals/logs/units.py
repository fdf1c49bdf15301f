"""Units of measured files, and their conversion to SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion

STANDARD_GRAVITY = 9.80665
"""One g [m/s^2], as accelerometers are calibrated."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit: ``si_value = scale * value + offset``, in the SI unit ``si``."""

    scale: float
    si: str
    offset: float = 0.0


def _group(si: str, **scales: float) -> dict[str, Unit]:
    return {name: Unit(scale=scale, si=si) for name, scale in scales.items()}


_TURN = 2.0 * math.pi
_DEGREE = math.pi / 180.0
UNITS: dict[str, Unit] = {
    **_group("s", s=1.0, ms=1e-3, us=1e-6, ns=1e-9, min=60.0, h=3600.0),
    **_group("m", m=1.0, dm=0.1, cm=1e-2, mm=1e-3, um=1e-6, km=1e3, ft=0.3048, inch=0.0254),
    **_group("m^3", l=1e-3, ml=1e-6, cm3=1e-6),
    **_group("rad", rad=1.0, mrad=1e-3, deg=_DEGREE, cdeg=1e-2 * _DEGREE, mdeg=1e-3 * _DEGREE),
    **_group("rad", turn=_TURN),
    **_group("rad/s", rpm=_TURN / 60.0),
    **_group("m/s^2", g=STANDARD_GRAVITY, mg=1e-3 * STANDARD_GRAVITY, gal=1e-2),
    **_group("m/s", knot=1852.0 / 3600.0, mph=0.44704),
    **_group("kg", kg=1.0, gram=1e-3, oz=0.028349523125, lb=0.45359237),
    **_group(
        "N",
        N=1.0,
        kN=1e3,
        mN=1e-3,
        lbf=4.4482216152605,
        kgf=STANDARD_GRAVITY,
        gf=1e-3 * STANDARD_GRAVITY,
    ),
    **_group("Pa", Pa=1.0, hPa=1e2, kPa=1e3, mbar=1e2, bar=1e5, dbar=1e4, psi=6894.757293168),
    **_group("Pa", atm=101325.0),
    **_group("V", V=1.0, mV=1e-3),
    **_group("A", A=1.0, mA=1e-3, cA=1e-2),
    **_group("T", T=1.0, mT=1e-3, uT=1e-6, nT=1e-9, gauss=1e-4, mgauss=1e-7),
    **_group("K", K=1.0),
    "degF": Unit(scale=5.0 / 9.0, offset=273.15 - 32.0 * 5.0 / 9.0, si="K"),
    "degC": Unit(scale=1.0, offset=273.15, si="K"),
    "1": Unit(scale=1.0, si="1"),
    "%": Unit(scale=1e-2, si="1"),
    "dB": Unit(scale=1.0, si="dB"),
    "m/s": Unit(scale=1.0, si="m/s"),
    "cm/s": Unit(scale=1e-2, si="m/s"),
    "mm/s": Unit(scale=1e-3, si="m/s"),
    "ft/s": Unit(scale=0.3048, si="m/s"),
    "km/h": Unit(scale=1.0 / 3.6, si="m/s"),
    "m/s^2": Unit(scale=1.0, si="m/s^2"),
    "cm/s^2": Unit(scale=1e-2, si="m/s^2"),
    "mm/s^2": Unit(scale=1e-3, si="m/s^2"),
    "rad/s": Unit(scale=1.0, si="rad/s"),
    "deg/s": Unit(scale=_DEGREE, si="rad/s"),
    "cdeg/s": Unit(scale=1e-2 * _DEGREE, si="rad/s"),
    "mdeg/s": Unit(scale=1e-3 * _DEGREE, si="rad/s"),
    "mrad/s": Unit(scale=1e-3, si="rad/s"),
    "turn/s": Unit(scale=_TURN, si="rad/s"),
    "Hz": Unit(scale=_TURN, si="rad/s"),
    "m^3": Unit(scale=1.0, si="m^3"),
    "cm^3": Unit(scale=1e-6, si="m^3"),
    "kg/m^3": Unit(scale=1.0, si="kg/m^3"),
    "g/cm^3": Unit(scale=1e3, si="kg/m^3"),
}
"""Every unit that is understood, by the text used in files."""

_ALIASES = {
    "sec": "s", "seconds": "s", "µs": "us", "in": "inch", "degrees": "deg", "radians": "rad",
    "dps": "deg/s", "m/s2": "m/s^2", "m/s/s": "m/s^2", "kn": "knot", "kt": "knot", "m3": "m^3",
    "volt": "V", "kg/m3": "kg/m^3", "g/cm3": "g/cm^3", "°": "deg", "°/s": "deg/s", "-": "1",
    "percent": "%", "cc": "cm^3", "µT": "uT", "G": "gauss", "Gauss": "gauss", "mG": "mgauss",
    "mGauss": "mgauss", "°C": "degC", "°F": "degF", "ampere": "A", "amps": "A", "volts": "V",
    "rps": "turn/s", "rev/s": "turn/s", "RPM": "rpm", "rev/min": "rpm", "1/min": "rpm",
    "rad/sec": "rad/s", "deg/sec": "deg/s", "centideg": "cdeg", "millideg": "mdeg",
    "kph": "km/h", "mps": "m/s", "g0": "g", "mg0": "mg", "microseconds": "us",
    "milliseconds": "ms", "meter": "m", "metre": "m", "meters": "m", "metres": "m",
}  # fmt: skip


def find_unit(name: str, *, where: str = "unit") -> Unit:
    """Return a unit by name or by a common other spelling.

    Args:
        name: the text, such as ``deg/s``.
        where: what the unit belongs to, named in the message.

    Raises:
        LogError: the unit is not known.

    Example:
        >>> find_unit("bar").scale
        100000.0
    """
    key = name.strip()
    key = _ALIASES.get(key, key)
    if key not in UNITS:
        raise LogError(
            f"{where}: the unit '{name}' is not known.\n" + suggestion(name, UNITS, most=60)
        )
    return UNITS[key]


def to_si(
    values: Floats, unit: str, *, expected: str | None = None, where: str = "values"
) -> Floats:
    """Convert values to SI.

    Args:
        values: numbers in ``unit``, any shape.
        unit: unit of the values.
        expected: SI unit that must come out; None accepts any.
        where: what the values are, named in the message.

    Raises:
        LogError: the unit is unknown, or measures another quantity than expected.

    Example:
        >>> float(to_si(np.array([180.0]), "deg")[0]) == math.pi
        True
    """
    found = find_unit(unit, where=where)
    if expected is not None and found.si != expected:
        fitting = ", ".join(sorted(key for key, value in UNITS.items() if value.si == expected))
        raise LogError(
            f"{where}: '{unit}' is a unit of [{found.si}], this channel is in [{expected}].\n"
            f"Allowed: {fitting or expected}"
        )
    return np.asarray(values, dtype=np.float64) * found.scale + found.offset
