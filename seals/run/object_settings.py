"""Typed settings of the objects of a run, each a further robot folder in the scene."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.schema import optional, vector

_CHOSEN = "chosen"


@roles(data="effects guide controller", read="robot")
@dataclass(kw_only=True)
class ObjectSettings:
    """Settings of an object: a further body in the scene, passive or with a guide.

    Its effects are those of its own ``robot.yaml`` and those of the surroundings (gravity,
    buoyancy, wind, current) as the run has them.

    Args:
        robot: name of an installed robot, or a robot folder.
        position: body origin in the world [m].
        rpy: roll, pitch, yaw of the body in the world [rad].
        velocity: of the body origin in the world [m/s].
        angular_velocity: in body axes [rad/s].
        joint_position: joint angles or travels in URDF order; empty means zeros [rad or m].
        mass: total mass in place of the URDF's; inertias go with it [kg].
        friction: lateral friction coefficient of all its links [1].
        rolling_friction: lever arm that resists rolling [m].
        spinning_friction: lever arm that resists spinning about the contact normal [m].
        restitution: coefficient of restitution [1].
        effects: values of its effects by effect and parameter, over those of ``robot.yaml``.
        guide: what it does: name of a guide, or a mapping with the key ``guide`` and its values;
            absent for the guide that its folder names, if any. With a guide it has its actuators.
        controller: likewise; values without the key ``controller`` are over those of the folder.
    """

    robot: str = ""
    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    rpy: list[float] = vector((0.0, 0.0, 0.0), "rad", bounds=(-6.3, 6.3), source=_CHOSEN)
    velocity: list[float] = vector((0.0, 0.0, 0.0), "m/s", bounds=(-100, 100), source=_CHOSEN)
    angular_velocity: list[float] = vector(
        (0.0, 0.0, 0.0), "rad/s", bounds=(-100, 100), source=_CHOSEN
    )
    joint_position: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source=_CHOSEN)
    mass: float | None = optional("kg", bounds=(1e-6, 1e6), source=_CHOSEN)
    friction: float | None = optional("1", bounds=(0.0, 10.0), source=_CHOSEN)
    rolling_friction: float | None = optional("m", bounds=(0.0, 10.0), source=_CHOSEN)
    spinning_friction: float | None = optional("m", bounds=(0.0, 10.0), source=_CHOSEN)
    restitution: float | None = optional("1", bounds=(0.0, 1.0), source=_CHOSEN)
    effects: dict[str, Any] = field(default_factory=dict)
    guide: Any = None
    controller: Any = None


_NAME = re.compile(r"\w[\w-]{0,119}")
LONGEST = 60
"""Longest name of a robot or object: it is part of names of columns and folders."""


def instance_name(name: Any, section: str) -> str:
    """Return the name of a part of a robot, which is part of columns and of folders.

    Raises:
        ConfigError: it cannot be.
    """
    if not _NAME.fullmatch(str(name)):
        raise ConfigError(
            f"{section}.{name!s:.80}: this name is not allowed.\n"
            "Allowed: letters, digits, '_' and '-', up to 120."
        )
    return str(name)


def check_named(section: str, stated: Mapping[str, Any], *, example: str) -> None:
    """Refuse names that are invalid in columns, and robots or objects without a robot folder.

    Args:
        section: ``objects`` or ``robots``.
        stated: settings with a ``robot``, by name.
        example: of a robot.

    Raises:
        ConfigError: says which of them.
    """
    for name, settings in stated.items():
        if not name.isidentifier() or name == "robot" or len(name) > LONGEST:
            raise ConfigError(
                f"{section}.{name:.80}: '{name:.80}' cannot name one of the {section}.\n"
                "Allowed: letters, digits and '_', not beginning with a digit, "
                f"up to {LONGEST}, and not 'robot'."
            )
        if not settings.robot:
            raise ConfigError(
                f"{section}.{name}.robot has no value.\n"
                f"Give a robot or a robot folder: {section}.{name}.robot={example}; "
                f"{section}.{name}={example} holds no further keys"
            )
