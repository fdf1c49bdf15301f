"""``seals new hydrodynamics``: writes added mass and radiation of a hull into ``robot.yaml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from seals.config.whereabouts import own_robot
from seals.errors import ConfigError, suggestion


def new_hydrodynamics(words: Sequence[str], given: Mapping[str, str]) -> int:
    """Compute hydrodynamics of one link of a robot folder, write them, and print what was found."""
    if words or not given.get("robot"):
        raise ConfigError(
            "hydrodynamics need a robot folder.\n"
            "Write: seals new hydrodynamics robot=FOLDER method=bem"
        )
    folder = own_robot(given["robot"])
    from seals.environment.seawater import FRESH_WATER
    from seals.run.progress import progress
    from seals.scaffold.hydrodynamics import has_boundary_elements
    from seals.scaffold.hydrodynamics.link import (
        Method,
        hydrodynamics_of,
        problems_of,
        refuse_stated,
        write_hydrodynamics,
    )
    from seals.sysid.data.robot_description import describe_robot

    names = [one.value for one in Method]
    method = given.get("method") or ("bem" if has_boundary_elements() else "ellipsoid")
    if method not in names:
        hint = suggestion(method, names, label="Methods")
        raise ConfigError(f"method={method} is not a method.\n{hint}")
    panels = _number(given, "panels", 500.0, (60.0, 4000.0), "panels")
    density = _number(given, "density", FRESH_WATER, (500.0, 2000.0), "kg/m^3")
    robot = describe_robot(str(folder)).robot
    link = given.get("link") or robot.links[0]
    replace = given.get("replace", "false").lower() == "true"
    refuse_stated(folder, robot, link, replace=replace)
    with progress(f"radiation of {link}", problems_of(robot, link, density)) as tell:
        found = hydrodynamics_of(
            robot, link, Method(method), density=density, panels=round(panels), tell=tell
        )
    written = write_hydrodynamics(folder, robot, found)
    print("\n".join(found.words))
    print(f"{folder / 'robot.yaml'}: effects {', '.join(written)}\nNext:")
    print(f"  seals check robot={folder}\n  seals run robot={folder} water=fossen")
    return 0


def _number(
    given: Mapping[str, str], key: str, default: float, span: tuple[float, float], unit: str
) -> float:
    """A number of the command line within bounds."""
    if key not in given:
        return default
    try:
        value = float(given[key])
    except ValueError:
        value = float("nan")
    if not span[0] <= value <= span[1]:
        raise ConfigError(
            f"{key}={given[key]} is not allowed.\nAllowed: {span[0]:g} to {span[1]:g} {unit}."
        )
    return value
