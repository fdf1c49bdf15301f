"""Writes ``rov_arm.urdf`` and ``meshes``, and prints the hulls and masses of the arm."""

from __future__ import annotations

import xml.etree.ElementTree as Xml
from pathlib import Path

from seals.robots.workshop import arm
from seals.robots.workshop.airframe import COLOURS
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Machine

SHOULDER = (0.2, 0.0, -0.19)
"""Axis of the shoulder in the body: ahead of the bottom plate, and below it [m]."""
BRACKET = (
    '<visual><origin xyz="0.185 0 -0.172"/><geometry><box size="0.08 0.036 0.04"/></geometry>'
    '<material name="frame"/></visual>'
)
"""Plate that holds the shoulder."""
HERE = Path(__file__).parent


def machine() -> Machine:
    """Return the arm, which hangs from a link that is not its own."""
    limbs, joints = arm.links(roll=True), arm.arm("body", SHOULDER, roll=True)
    used = {piece.colour for link in limbs for piece in link.pieces if piece.colour}
    colours = {name: colour for name, colour in COLOURS.items() if name in used}
    return Machine(name="rov_arm", links=limbs, joints=joints, colours=colours)


def mount(vehicle: Path, written: Path) -> None:
    """Put the elements of a vehicle, and a bracket, before those of the arm in the arm's file.

    Args:
        vehicle: URDF that has the link ``body``.
        written: URDF of the arm, which is written anew.
    """
    ours, theirs = Xml.parse(written), Xml.parse(vehicle)
    body = theirs.getroot().find("link[@name='body']")
    assert body is not None
    # drawn only: its mass is the vehicle's
    body.append(Xml.fromstring(BRACKET))
    for place, element in enumerate(theirs.getroot()):
        ours.getroot().insert(place, element)
    Xml.indent(ours)
    text = Xml.tostring(ours.getroot(), encoding="unicode")
    written.write_text(f'<?xml version="1.0"?>\n{text}\n', encoding="utf-8")


if __name__ == "__main__":
    publish(machine(), HERE, shared=HERE.parent / "aam")
    mount(HERE.parent / "rov" / "rov.urdf", HERE / "rov_arm.urdf")
