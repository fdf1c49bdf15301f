"""Conversion of an SDF model to a URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError, refuse_unlisted
from seals.frames import matrix_of, quaternion_of_rpy
from seals.robot.structure import numbers
from seals.scaffold.plug_ins import last_name
from seals.scaffold.sdf_includes import with_includes
from seals.scaffold.urdf import (
    ENDLESS,
    INERTIA,
    WORLD,
    Element,
    cylinder_element,
    inertial_element,
    joint_element,
    number_or,
    pose_at,
    pose_text,
)

_TYPES = {"revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic"}
_GEOMETRY = ("box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh")
_DEEPEST_FRAME = 50


class _Frames(NamedTuple):
    """Poses of the links, joints and frames of a model.

    Args:
        poses: frame that each is given relative to, and pose in it, shape (4, 4), by name.
        carriers: what joints and frames move with: child links, and what they are attached to.
        where: the file, for messages.
    """

    poses: Mapping[str, tuple[str, Floats]]
    carriers: Mapping[str, str]
    where: str

    def pose(self, name: str, depth: int = 0) -> Floats:
        """Return the pose of a frame in the model, shape (4, 4)."""
        if name in ("", "__model__", "world"):
            return np.eye(4)
        refuse_unlisted(
            name, self.poses, f"{self.where}: the frame '{name}' does not exist", error=RobotError
        )
        if depth > _DEEPEST_FRAME:
            raise RobotError(
                f"{self.where}: the frame '{name}' is given relative to itself.\n"
                "Define one of these frames relative to the model."
            )
        base, own = self.poses[name]
        return self.pose(base, depth + 1) @ own


def urdf_of_sdf(
    path: Path, root: Element, packages: Mapping[str, Path]
) -> tuple[Element, list[str]]:
    """Return the URDF of the one model in an SDF file, and messages on changes.

    Links keep the orientation of their frame; the origin of a link below a moving joint becomes
    that of the joint.

    Args:
        path: of the file.
        root: its ``<sdf>`` element.
        packages: folders of ``model://`` names.

    Raises:
        RobotError: it holds no model or several, or something that no URDF can say.
    """
    where = f"SDF {path}"
    changes = ["SDF model converted to URDF"]
    model = _with_parts(path, root, packages, changes)
    links, joints = _flat(model, "link"), [*_flat(model, "joint"), *_held(model, changes)]
    if not links:
        raise RobotError(f"{where}: its model has no links.\nA robot needs at least one <link>.")
    frames = _frames(where, model)
    names = [_name(where, link) for link in links]
    fixed = [
        j
        for j in joints
        if j.get("type") == "fixed" and WORLD in (_end(j, "parent"), _end(j, "child"))
    ]
    moving = [j for j in joints if j not in fixed]
    rigged = any(_end(j, "parent") == WORLD for j in moving)
    urdf = ElementTree.Element("robot", {"name": model.get("name") or path.stem})
    origins = {name: frames.pose(name) for name in names}
    if rigged:
        # what moves against the world does so by the first of its joints
        ElementTree.SubElement(urdf, "link", name=WORLD)
        names, origins[WORLD] = [*names, WORLD], np.eye(4)
    for joint in moving:
        if joint.get("type") in _TYPES:
            child = _frames_link(frames, _end(joint, "child"), names)
            origins[child][:3, 3] = frames.pose(str(joint.get("name")))[:3, 3]
    for link, name in zip(links, names[: len(links)], strict=True):
        shift = np.linalg.inv(origins[name]) @ frames.pose(name)
        urdf.append(_link(where, link, name, shift, changes))
    for joint in moving:
        urdf.append(_joint(joint, frames, origins, names, changes))
    still = (model.findtext("static") or "").strip().lower() in ("1", "true")
    if still:
        changes.append("the model is static: fixed_base is true")
    if rigged or still:
        urdf.set("fixed_base", "true")
    if fixed:
        urdf.set("fixed_base", "true")
        changes.append("the model is joined to the world: fixed_base is true")
    return urdf, changes


def _with_parts(
    path: Path, root: Element, packages: Mapping[str, Path], changes: list[str]
) -> Element:
    """Return the one model with all that it includes; a world may bring it in itself."""
    where = f"SDF {path}"
    bare = not root.findall("model") and not root.findall("world/model")
    included = root.findall("world/include")
    if bare and len(included) > 1:
        names = ", ".join((e.findtext("uri") or "").strip() for e in included[:6])
        raise RobotError(
            f"{where} is a world file that includes {len(included)} models: {names}.\n"
            "Give the file of the robot: model.sdf in its folder."
        )
    if bare and included:
        return _model(where, with_includes(path, root, packages, changes))
    return with_includes(path, _model(where, root), packages, changes)


def _model(where: str, root: Element) -> Element:
    """The one model, at the top level or inside a world."""
    models = root.findall("model") or [
        m for world in root.findall("world") for m in world.findall("model")
    ]
    if len(models) != 1:
        names = ", ".join(str(m.get("name")) for m in models[:6])
        raise RobotError(
            f"{where} holds {len(models)} models{': ' + names if names else ''}.\n"
            "Give the file of one model: model.sdf in its folder."
        )
    return models[0]


def _flat(model: Element, tag: str) -> list[Element]:
    """Elements of a model and of its nested models."""
    inner = [e for m in model.findall("model") for e in _flat(m, tag)]
    return [*model.findall(tag), *inner]


def _held(model: Element, changes: list[str]) -> list[Element]:
    """Fixed joints for links of the model that a plug-in holds until it lets them go."""
    found = []
    for plugin in model.iter("plugin"):
        parent, child = (plugin.findtext(f"{end}_link") or "" for end in ("parent", "child"))
        own = (plugin.findtext("child_model") or "").strip() in ("__model__", model.get("name"))
        if own and parent.strip() and child.strip():
            joint = ElementTree.Element(
                "joint", {"name": f"{last_name(child)}_held", "type": "fixed"}
            )
            ElementTree.SubElement(joint, "parent").text = parent
            ElementTree.SubElement(joint, "child").text = child
            found.append(joint)
            changes.append(f"{last_name(child)} is fixed to {last_name(parent)}, as by a plug-in")
    return found


def _name(where: str, element: Element) -> str:
    name = element.get("name", "")
    if not name:
        raise RobotError(
            f"{where}: a {element.tag} has no name.\nGive it one: <{element.tag} name=...>."
        )
    return name


def _frames(where: str, model: Element, base: str = "") -> _Frames:
    """Poses of all links, joints and frames; those of a nested model are relative to it."""
    poses: dict[str, tuple[str, Floats]] = {}
    carriers: dict[str, str] = {}
    for inner in model.findall("model"):
        name = f"__{inner.get('name')}__"
        pose = inner.find("pose")
        poses[name] = (_relative(pose) or base, _pose(where, pose))
        within = _frames(where, inner, name)
        poses |= within.poses
        carriers |= within.carriers
    for element in (*model.findall("link"), *model.findall("frame")):
        pose = element.find("pose")
        attached = last_name(element.get("attached_to")) if element.tag == "frame" else ""
        poses[_name(where, element)] = (_relative(pose) or attached or base, _pose(where, pose))
        if attached:
            carriers[_name(where, element)] = attached
    for joint in model.findall("joint"):
        pose = joint.find("pose")
        poses.setdefault(
            _name(where, joint), (_relative(pose) or _end(joint, "child"), _pose(where, pose))
        )
        carriers.setdefault(_name(where, joint), _end(joint, "child"))
    return _Frames(poses, carriers, where)


def _relative(pose: Element | None) -> str:
    if pose is None:
        return ""
    name = last_name(pose.get("relative_to") or pose.get("frame"))
    return "" if name == "__model__" else name


def _pose(where: str, element: Element | None) -> Floats:
    """A pose as a matrix; angles in radians, degrees or as a quaternion x, y, z, w."""
    if element is None or not (element.text or "").strip():
        return np.eye(4)
    quaternion = element.get("rotation_format") == "quat_xyzw"
    values = np.array(numbers(where, "pose", element.text, 7 if quaternion else 6))
    if quaternion:
        length = float(np.linalg.norm(values[3:]))
        if length < 1e-9:
            raise RobotError(
                f"{where}: a pose has a quaternion of zeros.\nGive it a length of one."
            )
        q = values[3:] / length
    else:
        turn = np.radians(values[3:]) if element.get("degrees") in ("true", "1") else values[3:]
        q = quaternion_of_rpy(turn[None])[0]
    return pose_at(values[:3], matrix_of(q[None])[0])


def _end(joint: Element, which: str) -> str:
    text = joint.findtext(which) or joint.findtext(f"{which}/link") or ""
    return last_name(text)


def _frames_link(frames: _Frames, name: str, links: list[str]) -> str:
    """Return the link that a joint refers to, by its own name or that of a frame on it."""
    for _ in range(_DEEPEST_FRAME):
        if name in links or name not in frames.poses:
            break
        name = frames.carriers.get(name, frames.poses[name][0])
    refuse_unlisted(
        name, links, f"{frames.where}: a joint names the link '{name}'", error=RobotError
    )
    return name


def _link(where: str, link: Element, name: str, shift: Floats, changes: list[str]) -> Element:
    where = f"{where}: link '{name}'"
    out = ElementTree.Element("link", name=name)
    inertial = link.find("inertial")
    if inertial is not None:
        out.append(_inertial(where, inertial, shift))
    for kind in ("collision", "visual"):
        for part in link.findall(kind):
            shape = _shape(where, part, changes)
            if shape is None:
                continue
            element = ElementTree.SubElement(out, kind)
            placed = shift @ _pose(where, part.find("pose"))
            ElementTree.SubElement(element, "origin", pose_text(placed))
            ElementTree.SubElement(element, "geometry").append(shape)
    return out


def _inertial(where: str, inertial: Element, shift: Floats) -> Element:
    placed = shift @ _pose(where, inertial.find("pose"))
    mass = numbers(where, "mass", inertial.findtext("mass") or "1", 1)[0]
    tensor = np.eye(3)
    for key, (i, j) in INERTIA.items():
        text = inertial.findtext(f"inertia/{key}") or str(tensor[i, j])
        tensor[i, j] = tensor[j, i] = numbers(where, key, text, 1)[0]
    return inertial_element(mass, tensor, pose_text(placed))


def _shape(where: str, part: Element, changes: list[str]) -> Element | None:
    """Geometry as an element of a URDF; None for a shape without volume."""
    geometry = part.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None or shape.tag not in _GEOMETRY:
        if shape is not None and shape.tag != "empty":
            changes.append(
                f"{shape.tag} of {part.get('name')} left out: it has no volume in a URDF"
            )
        return None

    def value(key: str, count: int = 1) -> list[float]:
        return numbers(f"{where}: {shape.tag}", key, shape.findtext(key), count)

    def text(values: list[float]) -> str:
        return " ".join(f"{x:.9g}" for x in values)

    if shape.tag == "box":
        return ElementTree.Element("box", {"size": text(value("size", 3))})
    if shape.tag == "sphere":
        return ElementTree.Element("sphere", {"radius": text(value("radius"))})
    if shape.tag == "ellipsoid":
        # a box of the same volume and proportions
        edges = [2.0 * x * (math.pi / 6.0) ** (1.0 / 3.0) for x in value("radii", 3)]
        changes.append(f"ellipsoid of {part.get('name')} replaced by a box of equal volume")
        return ElementTree.Element("box", {"size": text(edges)})
    if shape.tag == "mesh":
        uri = (shape.findtext("uri") or "").strip()
        if not uri:
            raise RobotError(f"{where}: a mesh has no uri.\nGive it: <uri>model://...</uri>.")
        scale = text(numbers(where, "scale", shape.findtext("scale") or "1 1 1", 3))
        return ElementTree.Element("mesh", {"filename": uri, "scale": scale})
    radius, length = value("radius")[0], value("length")[0]
    return cylinder_element(radius, length, capped=shape.tag == "capsule")


def _joint(
    joint: Element,
    frames: _Frames,
    origins: Mapping[str, Floats],
    names: list[str],
    changes: list[str],
) -> Element:
    name, kind = _name(frames.where, joint), joint.get("type", "")
    where = f"{frames.where}: joint '{name}'"
    what = f"{where} has the type '{kind}', which a URDF cannot describe"
    refuse_unlisted(kind, [*_TYPES, "fixed"], what, error=RobotError)
    parent, child = (_frames_link(frames, _end(joint, end), names) for end in ("parent", "child"))
    origin = np.linalg.inv(origins[parent]) @ origins[child]
    if kind == "fixed":
        return joint_element(name, "fixed", parent, child, origin)
    axis = joint.find("axis")
    if axis is None:
        raise RobotError(
            f"{where} is {kind} and has no <axis>.\nGive it: <axis><xyz>0 0 1</xyz></axis>."
        )
    xyz = axis.find("xyz")
    ahead = np.array(numbers(where, "axis", "0 0 1" if xyz is None else xyz.text, 3))
    given = "" if xyz is None else last_name(xyz.get("expressed_in"))
    if (axis.findtext("use_parent_model_frame") or "").strip() in ("1", "true"):
        given = "__model__"
    turn = frames.pose(given or name)[:3, :3]
    own = origins[child][:3, :3].T @ turn @ ahead
    limits = _limits(where, axis)
    if kind == "revolute" and limits["upper"] - limits["lower"] > 2e3:
        kind = "continuous"
    if kind == "prismatic" and limits["upper"] - limits["lower"] > 2e6:
        limits |= {"lower": -1e3, "upper": 1e3}
        changes.append(f"{name} has no limits: set to 1000 m in both directions")
    return joint_element(name, kind, parent, child, origin, axis=own, limits=limits)


def _limits(where: str, axis: Element) -> dict[str, float]:
    limit, found = axis.find("limit"), {}
    for key, default in (("lower", -1e16), ("upper", 1e16), ("effort", 0.0), ("velocity", 0.0)):
        text = (None if limit is None else limit.findtext(key)) or ""
        value = number_or(text, default)
        if abs(value) < ENDLESS:
            value = numbers(where, key, text, 1)[0] if text.strip() else default
        elif text.strip():
            # endless, in words or as the largest number of some language
            value = float(np.copysign(1e16, value))
        if key == "effort":
            # minus one says that there is none, which the URDF says by an endless one
            value = 1e16 if value < 0.0 else value
        elif key == "velocity":
            value = 0.0 if value < 0.0 or value >= ENDLESS else value
        found[key] = value
    return found
