"""Options of the tank: wave maker, beach, tide, wind."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from seals.errors import ConfigError
from seals.schema import count, param, setting

_CHOSEN = "chosen"


class Maker(Enum):
    """Kind of wave maker, which replaces the wall at low x."""

    none = "none"
    piston = "piston"
    """A wall that translates."""
    flap = "flap"
    """A wall hinged at its lower edge."""


class SeaState(Enum):
    """Sea state made by the wave maker."""

    regular = "regular"
    jonswap = "jonswap"
    """Irregular, after Hasselmann et al. 1973; height is the significant one, period the peak's."""
    solitary = "solitary"
    """One crest, after Goring 1978; made by a piston."""


@dataclass(kw_only=True)
class MakerSettings:
    """A wave maker at the low end of x, waves run toward positive x.

    Args:
        kind: piston, flap or none.
        sea: regular, jonswap or solitary.
        height: from trough to crest; significant height; height of a solitary crest [m].
        period: of the wave, or of the spectrum's peak [s].
        start: time at which the maker begins [s]; below zero behind bodies that are held, while
            the water settles.
        ramp: time over which it comes up to full stroke, in periods [1].
        peakedness: gamma of the spectrum [1].
        components: waves of an irregular sea.
        seed: of their phases.
    """

    kind: Maker = Maker.none
    sea: SeaState = SeaState.regular
    height: float = param(
        0.05, "m", bounds=(0.0, 30.0), tolerance=0.1, relative=True, source=_CHOSEN
    )
    period: float = param(1.2, "s", bounds=(0.05, 60.0), tolerance=0.01, source=_CHOSEN)
    start: float = setting(0.0, "s", bounds=(-60.0, 1e6), source=_CHOSEN)
    ramp: float = setting(1.0, "1", bounds=(0.0, 20.0), source=_CHOSEN)
    peakedness: float = param(
        3.3, "1", bounds=(1.0, 10.0), tolerance=0.5, source="Hasselmann et al. 1973", fit=False
    )
    components: int = count(40, bounds=(1, 10_000))
    seed: int = count(0, bounds=(0, 2**63 - 1))

    def __post_init__(self) -> None:
        """Refuse combinations without a theory."""
        if self.kind is Maker.flap and self.sea is SeaState.solitary:
            raise ConfigError(
                "a flap makes no solitary wave: its stroke would have to grow with the depth.\n"
                "Use maker.kind=piston."
            )


@dataclass(kw_only=True)
class BeachSettings:
    """A sponge layer at the high end of x that absorbs waves.

    Equation:
        v <- u + (v - u) exp(-rate s^2 h), s from 0 at its foot to 1 at the wall, u the mean flow;
        vertical motion twice as fast; u = 0.

    Args:
        length: of the sponge, one to one and a half wave lengths [m]; 0 for none.
        rate: at the wall [1/s].
    """

    length: float = setting(0.0, "m", bounds=(0.0, 1e3), source=_CHOSEN)
    rate: float = setting(12.0, "1/s", bounds=(0.0, 1e3), source="measured on a flume")


@dataclass(kw_only=True)
class TideSettings:
    """Tide: slow change of the mean level, made by a moving floor.

    Equation:
        level(t) = amplitude sin(2 pi t / period).

    Args:
        amplitude: [m].
        period: [s].
    """

    amplitude: float = setting(0.0, "m", bounds=(0.0, 20.0), source=_CHOSEN)
    period: float = setting(60.0, "s", bounds=(1.0, 1e6), source=_CHOSEN)


@dataclass(kw_only=True)
class WindSettings:
    """Wind over the water: a shear stress on the uppermost particles.

    Args:
        stress_x: toward east [Pa]; 1.2e-3 times density of air times speed squared is usual.
        stress_y: toward north [Pa].
    """

    stress_x: float = param(0.0, "Pa", bounds=(-50.0, 50.0), tolerance=0.0, source=_CHOSEN)
    stress_y: float = param(0.0, "Pa", bounds=(-50.0, 50.0), tolerance=0.0, source=_CHOSEN)
