"""Writer of a generated robot: URDF, meshes and values of its robot.yaml."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.robots.workshop.links import Joint, Link, Machine
from seals.robots.workshop.pieces import Piece, angles

MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Attributes of an inertia in a URDF."""
_ROUNDING = 1e-12
"""Product of inertia as a share of the moments' sum below which it is zero."""


def write(machine: Machine, folder: Path, shared: Path | None = None) -> None:
    """Write ``NAME.urdf`` and the folder ``meshes`` beside it.

    Args:
        machine: what to write.
        folder: of the robot.
        shared: folder of a robot beside it; a mesh that it has already is named there.
    """
    meshes = folder / "meshes"
    meshes.mkdir(exist_ok=True)
    for old in meshes.glob("*.obj"):
        old.unlink()
    lines = ['<?xml version="1.0"?>', f'<robot name="{machine.name}">']
    for name, colour in machine.colours.items():
        lines.append(f'  <material name="{name}"><color rgba="{_row(colour)}"/></material>')
    for link in machine.links:
        lines += _link(link, meshes, shared)
    for joint in machine.joints:
        lines += _joint(joint)
    text = "\n".join([*lines, "</robot>", ""])
    (folder / f"{machine.name}.urdf").write_text(text, encoding="utf-8")


def publish(machine: Machine, folder: Path, shared: Path | None = None) -> None:
    """Write the files of a machine as :func:`write` does, and print its hulls and masses."""
    write(machine, folder, shared)
    print(hulls(machine))
    print(table(machine))


def hulls(machine: Machine) -> str:
    """Return the section ``hulls`` of a robot.yaml: one shape for every wet piece."""
    lines = ["hulls:"]
    for link in machine.links:
        wet = [piece for piece in link.pieces if piece.wet]
        if len(wet) == 1:
            lines.append(f"  {link.name}: {{shapes: [{_shape(wet[0])}]}}")
        elif wet:
            lines += [f"  {link.name}:", "    shapes:"]
            lines += [f"      - {_shape(piece)}" for piece in wet]
    return "\n".join(lines)


def table(machine: Machine) -> str:
    """Return the rows of a README table: mass, centre, moments and volume of every link."""
    rows = []
    for link in machine.links:
        if not link.pieces:
            continue
        moments = " ".join(f"{value:.3g}" for value in np.diag(link.inertia()))
        centre = ", ".join(f"{value * 1e3:.1f}" for value in link.centre() + 0.0)
        volume = f"{link.volume * 1e6:.1f}"
        rows.append(f"| {link.name} | {link.mass:.4f} | {centre} | {moments} | {volume} |")
    return "\n".join(rows)


def _link(link: Link, meshes: Path, shared: Path | None) -> Iterator[str]:
    if not link.pieces:
        # stated, because engines give a link without inertia a mass of their own
        none = " ".join(f'{name}="0"' for name in MOMENTS)
        yield f'  <link name="{link.name}">'
        yield f'    <inertial><mass value="0"/><inertia {none}/></inertial>'
        yield "  </link>"
        return
    yield f'  <link name="{link.name}">'
    inertia = link.inertia()
    # a product that is zero by symmetry is left as rounding noise, another one on every processor
    zero = _ROUNDING * float(np.trace(inertia))
    numbers = zip(MOMENTS, inertia[np.triu_indices(3)], strict=True)
    moments = " ".join(
        f'{name}="{value if abs(value) > zero else 0.0:.6g}"' for name, value in numbers
    )
    yield "    <inertial>"
    yield f'      <origin xyz="{_row(link.centre())}" rpy="0 0 0"/>'
    yield f'      <mass value="{link.mass:.6g}"/>'
    yield f"      <inertia {moments}/>"
    yield "    </inertial>"
    for colour in dict.fromkeys(piece.colour for piece in link.pieces if piece.colour):
        name = f"{link.stem or link.name}_{colour}.obj"
        pieces = [piece for piece in link.pieces if piece.colour == colour]
        file = _save(pieces, meshes / name, shared)
        yield f'    <visual><geometry><mesh filename="{file}"/></geometry>'
        yield f'      <material name="{colour}"/></visual>'
    yield from _touching(link, meshes, shared)
    yield "  </link>"


def _touching(link: Link, meshes: Path, shared: Path | None) -> Iterator[str]:
    """Collision geometry and how it rubs."""
    solid = [piece for piece in link.pieces if piece.solid]
    if link.hull_mesh and solid:
        name = f"{link.stem or link.name}_convex.obj"
        file = _save(solid, meshes / name, shared, convex=True)
        yield f'    <collision><geometry><mesh filename="{file}"/></geometry></collision>'
    else:
        for piece in solid:
            place = f'<origin xyz="{_row(piece.centre)}" rpy="{_row(angles(piece.turn))}"/>'
            yield f"    <collision>{place}<geometry>{_primitive(piece)}</geometry></collision>"
    if link.friction is not None:
        spin = f'<spinning_friction value="{link.spinning:g}"/>' if link.spinning else ""
        lateral = f'<lateral_friction value="{link.friction:g}"/>'
        yield f"    <contact>{lateral}{spin}</contact>"


def _joint(joint: Joint) -> Iterator[str]:
    kind = "revolute" if joint.axis else "fixed"
    yield f'  <joint name="{joint.name}" type="{kind}">'
    yield f'    <parent link="{joint.parent}"/><child link="{joint.child}"/>'
    yield f'    <origin xyz="{_row(joint.at)}" rpy="{_row(joint.rpy)}"/>'
    if joint.axis:
        low, high = joint.limits
        yield f'    <axis xyz="{_row(joint.axis)}"/>'
        yield (
            f'    <limit lower="{low:g}" upper="{high:g}" effort="{joint.effort:g}" '
            f'velocity="{joint.speed:g}"/>'
        )
    yield "  </joint>"


def _primitive(piece: Piece) -> str:
    if piece.kind == "box":
        return f'<box size="{_row(piece.size)}"/>'
    if piece.kind == "ball":
        return f'<sphere radius="{piece.size[0]:g}"/>'
    return f'<cylinder radius="{piece.size[0]:g}" length="{piece.size[1]:.6g}"/>'


def _shape(piece: Piece) -> str:
    """A piece as an entry of robot.yaml."""
    kind = {"box": "box", "ball": "sphere"}.get(piece.kind, "cylinder")
    entries = [f"type: {kind}", f"size: [{_row(piece.size, ', ')}]"]
    if np.any(np.abs(piece.centre) > 1e-9):
        entries.append(f"position: [{_row(piece.centre, ', ')}]")
    rpy = angles(piece.turn)
    if any(abs(angle) > 1e-9 for angle in rpy):
        entries.append(f"rpy: [{_row(rpy, ', ')}]")
    return "{" + ", ".join(entries) + "}"


def _save(pieces: Sequence[Piece], path: Path, shared: Path | None, *, convex: bool = False) -> str:
    """Write pieces as one OBJ file, millimetres rounded to hundredths; return its name."""
    import trimesh

    joined: Any = trimesh.util.concatenate([piece.mesh() for piece in pieces])
    if convex:
        joined = joined.convex_hull
    lines = [f"v {_row(point, digits=5)}" for point in joined.vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in joined.faces]
    text = "\n".join(lines) + "\n"
    same = None if shared is None else shared / "meshes" / path.name
    if same is not None and same.is_file() and same.read_text(encoding="utf-8") == text:
        return f"../{same.parent.parent.name}/meshes/{path.name}"
    path.write_text(text, encoding="utf-8")
    return f"meshes/{path.name}"


def _row(values: Any, join: str = " ", digits: int = 6) -> str:
    return join.join(f"{round(float(value), digits) + 0.0:g}" for value in values)
