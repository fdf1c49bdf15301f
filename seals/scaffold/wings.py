"""Lifting surfaces of a new robot: frames on their links, and the effect ``lift``."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.frames import rpy_of
from seals.scaffold.motors import LIQUID
from seals.scaffold.plug_ins import Wing
from seals.scaffold.urdf import UrdfDraft, refuse_unknown
from seals.scaffold.writing import plain


def leave_out_blades(wings: list[Wing], propellers: Collection[str]) -> list[str]:
    """Take the blades of propellers out of the wings, and tell of them in words.

    A drive's thrust is that of its blades: their lift would count twice, and on a propeller whose
    turning is no motion of the model it would act as that of a wing that stands still.

    Args:
        wings: stated lifting surfaces; changed.
        propellers: links that drives turn.
    """
    blades = [wing for wing in wings if wing.link in propellers]
    wings[:] = [wing for wing in wings if wing.link not in propellers]
    names = ", ".join(dict.fromkeys(wing.link for wing in blades))
    return (
        [f"lift of blades left out, because the thrust of their drive replaces it: {names}"]
        if blades
        else []
    )


def add_wing_frames(robot: UrdfDraft, wings: Sequence[Wing]) -> list[str]:
    """Return the link of each wing; where its axes are not those of its link, a frame is added.

    Args:
        robot: which gets the frames.
        wings: stated lifting surfaces.

    Raises:
        RobotError: a wing names a link that is not there.
    """
    root, known = robot.root, list(robot.links)
    names, found = list(known), []
    for wing in wings:
        refuse_unknown(wing.source, "link", wing.link, known)
        turned = float(np.abs(wing.turn - np.eye(3)).max()) > 1e-6
        if not (turned or np.any(wing.place)):
            found.append(wing.link)
            continue
        frame = f"{wing.link}_wing"
        while frame in names:
            frame += "_2"
        names.append(frame)
        ElementTree.SubElement(root, "link", name=frame)
        joint = ElementTree.SubElement(root, "joint", name=f"{frame}_joint", type="fixed")
        ElementTree.SubElement(joint, "parent", link=wing.link)
        ElementTree.SubElement(joint, "child", link=frame)
        rpy = rpy_of(wing.turn)
        pose = {"xyz": _words(wing.place), "rpy": _words(rpy)}
        ElementTree.SubElement(joint, "origin", pose)
        found.append(frame)
    return found


def lift_effects(wings: Sequence[Wing], links: Sequence[str]) -> dict[str, tuple[Any, str]]:
    """Return values and source of the effects ``lift``; wings with the same numbers share one.

    Args:
        wings: stated lifting surfaces.
        links: that carry them, from `add_wing_frames`.
    """
    found: dict[tuple[float, float, bool], tuple[dict[str, Any], str]] = {}
    for wing, link in zip(wings, links, strict=True):
        area, drag = (float(f"{x:.6g}") for x in (wing.area, wing.drag))
        wet = wing.density > LIQUID
        values: dict[str, Any] = {"effect": "lift", "coefficient": area}
        values |= {"attack_drag": drag} if drag else {}
        values |= {"medium": "water" if wet else "air", "links": []}
        found.setdefault((area, drag, wet), (values, wing.source))[0]["links"].append(link)
    return {f"{plain(values['links'][0])}_lift": (values, said) for values, said in found.values()}


def _words(values: Any) -> str:
    return " ".join(f"{float(x) + 0.0:.9g}" for x in values)
