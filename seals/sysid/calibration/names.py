"""Selection of the parameters to calibrate by name, group or wildcard."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence

from seals.errors import ConfigError, suggestion
from seals.sysid.calibration.stated import StatedNumber

_SHOWN = 8
"""Names that a refusal lists."""


def chosen(asked: Sequence[str], offered: Mapping[str, StatedNumber]) -> tuple[StatedNumber, ...]:
    """Return the selected numbers, each once, in the order in which they were asked for.

    A name is one of a number, of a group (``inertia`` for its three axes, ``effects.water_drag``
    for all of its fields), or a pattern with ``*``.

    Args:
        asked: names, groups or patterns.
        offered: numbers of the vehicle by name.

    Raises:
        ConfigError: nothing is asked for, or a name means none of the numbers.
    """
    if not asked:
        shown = [n for n, number in offered.items() if number.offered]
        more = f" and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
        raise ConfigError(
            "parameters is not given.\n"
            f"Say what to calibrate, for instance parameters=[{','.join(shown[:3])}]; "
            f"this vehicle has {', '.join(shown[:_SHOWN])}{more}"
        )
    found: dict[str, StatedNumber] = {}
    for name in asked:
        for one in _meant(str(name), offered):
            found.setdefault(one.name, one)
    return tuple(found.values())


def _meant(name: str, offered: Mapping[str, StatedNumber]) -> list[StatedNumber]:
    if name in offered:
        return [offered[name]]
    if any(c in name for c in "*?["):
        meant = [n for k, n in offered.items() if n.offered and fnmatch.fnmatchcase(k, name)]
    else:
        heads = (f"{name}.", f"{name}_")
        meant = [n for k, n in offered.items() if n.offered and k.startswith(heads)]
    if not meant:
        raise ConfigError(
            f"parameters: '{name}' is not a parameter that a log of this vehicle can determine.\n"
            f"{suggestion(name, offered)}"
        )
    return meant
