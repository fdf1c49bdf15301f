"""Jerlov water types: absorption, scattering and diffuse attenuation at red, green and blue."""

from __future__ import annotations

from dataclasses import dataclass

from seals.errors import ConfigError, suggestion
from seals.schema import check_tree, vector

WAVELENGTHS = (600.0, 525.0, 475.0)
"""Red, green and blue stand for these wavelengths [nm]: peaks of common camera sensors."""

SOLONENKO = (
    "Solonenko and Mobley 2015, Appl. Opt. 54, 5392, doi:10.1364/AO.54.005392, tables 4-8: "
    "absorption, scattering and Kd by inversion of Jerlov's Kd"
)
WILLIAMSON = (
    "Williamson and Hollins 2022, Appl. Opt. 61, 9951, doi:10.1364/AO.470464, and its data set: "
    "measured absorption and scattering; Kd of Jerlov 1976, Marine Optics, table XXVII"
)


@dataclass(frozen=True, kw_only=True)
class Water:
    """Inherent optical properties of a water type at `WAVELENGTHS`.

    Args:
        absorption: a, red, green, blue [1/m].
        scattering: b, red, green, blue [1/m].
        diffuse: K_d, fall of the downwelling irradiance with depth, red, green, blue [1/m].
        source: where the three come from.
    """

    absorption: list[float] = vector(
        (0.228, 0.046, 0.019), "1/m", bounds=(0.0, 20.0), tolerance=0.02, source=SOLONENKO
    )
    scattering: list[float] = vector(
        (0.00122, 0.00205, 0.00306), "1/m", bounds=(0.0, 50.0), tolerance=0.02, source=SOLONENKO
    )
    diffuse: list[float] = vector(
        (0.233, 0.049, 0.021), "1/m", bounds=(0.0, 20.0), tolerance=0.02, source=SOLONENKO
    )
    source: str = SOLONENKO

    def __post_init__(self) -> None:
        """Refuse coefficients that are not three finite numbers within their bounds."""
        check_tree(self, where="water")


def _row(a: tuple[float, ...], b: tuple[float, ...], k: tuple[float, ...], source: str) -> Water:
    return Water(absorption=list(a), scattering=list(b), diffuse=list(k), source=source)


# The measured values stand where there are any and where they agree with K_d: type IB's measured
# absorption of blue is above its K_d, which no water can do.
WATERS: dict[str, Water] = {
    "oceanic_1": _row(
        (0.228, 0.046, 0.019), (0.00122, 0.00205, 0.00306), (0.233, 0.049, 0.021), SOLONENKO
    ),
    "oceanic_1a": _row(
        (0.228, 0.0468, 0.0216), (0.00283, 0.00402, 0.00536), (0.234, 0.0503, 0.0253), SOLONENKO
    ),
    "oceanic_1b": _row(
        (0.2278, 0.0469, 0.0225), (0.0488, 0.0565, 0.0635), (0.241, 0.0572, 0.0325), SOLONENKO
    ),
    "oceanic_2": _row(
        (0.231, 0.0609, 0.0544), (0.170, 0.181, 0.190), (0.26, 0.076, 0.062), WILLIAMSON
    ),
    "oceanic_3": _row(
        (0.241, 0.0821, 0.0941), (0.278, 0.292, 0.303), (0.295, 0.116, 0.116), WILLIAMSON
    ),
    "coastal_1": _row(
        (0.248, 0.0972, 0.121), (0.416, 0.433, 0.447), (0.30, 0.13, 0.17), WILLIAMSON
    ),
    "coastal_3": _row((0.268, 0.132, 0.166), (0.627, 0.654, 0.675), (0.33, 0.20, 0.29), WILLIAMSON),
    "coastal_5": _row((0.285, 0.174, 0.243), (1.16, 1.21, 1.25), (0.40, 0.31, 0.43), WILLIAMSON),
    "coastal_7": _row((0.301, 0.233, 0.388), (2.03, 2.54, 3.01), (0.527, 0.470, 0.710), SOLONENKO),
    "coastal_9": _row((0.390, 0.430, 0.709), (2.69, 3.38, 4.01), (0.720, 0.826, 1.24), SOLONENKO),
}
"""Jerlov types I, IA, IB, II, III, 1C, 3C, 5C, 7C and 9C."""

NO_WATER = "none"


def water_of(name: str) -> Water | None:
    """Return the coefficients of a water type, or None for ``none``.

    Raises:
        ConfigError: there is no such water type.

    Example:
        >>> water_of("coastal_1").diffuse
        [0.3, 0.13, 0.17]
        >>> water_of("none") is None
        True
    """
    if name == NO_WATER:
        return None
    if name not in WATERS:
        raise ConfigError(
            f"water_type={name} is not known.\n{suggestion(str(name), [*WATERS, NO_WATER])}"
        )
    return WATERS[name]


def _molecular(wavelength: float) -> float:
    """Return the scattering coefficient of pure sea water [1/m].

    Args:
        wavelength: [nm].

    References:
        Haltrin 1999, Appl. Opt. 38, 6826, eq. 5.

    Example:
        >>> round(_molecular(475.0), 5)
        0.00277
    """
    return float(0.005826 * (400.0 / wavelength) ** 4.322)


def backscattering(scattering: float, wavelength: float, share: float) -> float:
    """Return the backscattering coefficient b_b [1/m].

    Water molecules scatter half of it backwards, particles a small share.

    Args:
        scattering: b [1/m].
        wavelength: [nm].
        share: b_b / b of the particles [1].

    Example:
        >>> round(backscattering(0.303, 475.0, 0.0183), 4)
        0.0069
    """
    clear = min(_molecular(wavelength), scattering)
    return 0.5 * clear + share * (scattering - clear)
