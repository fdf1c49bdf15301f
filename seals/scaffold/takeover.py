"""Import of a robot's file into a robot folder: URDF, xacro, SDF and MJCF."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from seals.check.finding import listed
from seals.errors import LogError, RobotError, suggestion
from seals.robot.structure import (
    check_structure,
    expanded,
    holds_macros,
    with_plain_comments,
    with_plain_names,
)
from seals.scaffold.ledger import left_out
from seals.scaffold.meshes import copy_meshes
from seals.scaffold.mjcf import urdf_of_mjcf
from seals.scaffold.mjcf_bounds import with_parts
from seals.scaffold.plug_ins import Stated, stated_of
from seals.scaffold.sdf import urdf_of_sdf
from seals.scaffold.sdf_includes import with_includes
from seals.scaffold.urdf import (
    ENDLESS,
    WORLD,
    Element,
    UrdfDraft,
    cylinder_element,
    end_of,
    fix,
    mass_of,
    number_or,
)
from seals.untrusted_io import plain_xml, read_text

_MOST_NEAR = 40
_OWN = ("link", "joint", "material")
_SHAPED = ("visual", "collision")
_ENDINGS = (".urdf", ".xacro", ".sdf", ".mjcf")


class Takeover(UrdfDraft):
    """File that is imported into a robot folder, as URDF.

    Args:
        path: of a URDF, xacro, SDF or MJCF file, or the short name of one that comes with SEALS.
        packages: folders of ``package://`` and ``model://`` names, where they cannot be found
            around the file.
        arguments: values of the arguments of a xacro file, by name.

    Attributes:
        stated: numbers of plug-ins and actuators.
        dropped: links that were left out at the base.
        fixed_base: whether the file bolts it to the world.
        lumps: whether Gazebo makes one body of links that are fixed to each other: of a URDF.
        unused: entries of the file that are left out: how many of each kind, by the reason.
        spun: links of rotors and thrusters, whose joints were fixed.
        rig: joints between the world and the first link with mass that nothing drives.
        drawn_only: links that are drawn and displace nothing: those of an SDF without collision
            shape beside links with one, on which alone Gazebo's buoyancy acts.
        changes: what was changed, in words.

    Raises:
        RobotError: the file is missing, or is not valid.
        MissingExtra: it holds macros, and xacro is not installed.
    """

    def __init__(
        self, path: Path, packages: Mapping[str, Path], arguments: Mapping[str, str] | None = None
    ) -> None:
        path = path if path.exists() else shipped_urdfs().get(path.as_posix(), path)
        self.path, self.packages = path, packages
        self.changes: list[str] = []
        self.dropped: list[str] = []
        self.drawn_only: set[str] = set()
        self.rig: list[str] = []
        self.lumps = True
        self.spun: set[str] = set()
        self._texts: Mapping[str, str] = {}
        text = with_plain_comments(_text_of(path))
        text = text if holds_macros(text) else with_plain_names(text)
        if holds_macros(text):
            _tree_of(path, text)
            text = expanded(path, packages, arguments)
            self.changes.append("xacro macros expanded")
        self.stated = Stated()
        super().__init__(self._read(text))
        self.fixed_base = self.root.attrib.pop("fixed_base", "") == "true"
        self._leave_out_foreign()
        self._drop_dummy_base()
        self._note_rig()

    def _read(self, text: str) -> Element:
        """Return the ``<robot>`` of a text in any of the formats."""
        tree = _tree_of(self.path, text)
        if tree.tag == "sdf":
            urdf, changes = urdf_of_sdf(self.path, tree, self.packages)
            bare = {str(e.get("name")) for e in urdf.iter("link") if e.find("collision") is None}
            self.drawn_only = bare if len(bare) < len(urdf.findall("link")) else set()
            self.stated = stated_of(with_includes(self.path, tree, self.packages, []))
            self.lumps = False
        elif tree.tag == "mujoco":
            urdf, changes, self.stated, self._texts = urdf_of_mjcf(self.path, tree, self.packages)
        else:
            freed = _freed(tree)
            if freed:
                self.changes.append(
                    f"floating joint {', '.join(freed)} to the world left out: a base is free"
                )
            capsules = _uncapped(tree)
            if capsules:
                self.changes.append(
                    f"{capsules} capsule(s) replaced by cylinders of equal radius and volume: "
                    "a URDF has no capsules"
                )
            # Drake reads a scale of one number for all three axes
            uneven = [m for m in tree.iter("mesh") if len((m.get("scale") or "").split()) == 1]
            for mesh in uneven:
                mesh.set("scale", " ".join([str(mesh.get("scale")).strip()] * 3))
            if uneven or freed or capsules:
                text = ElementTree.tostring(tree, encoding="unicode")
            check_structure(self.path, text, endless=True)
            self.unused = left_out(tree)
            keep = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
            self.stated = stated_of(tree)
            return ElementTree.fromstring(text.encode("utf-8"), parser=keep)
        self.unused = left_out(_whole(self.path, tree, self.packages))
        self.changes += changes
        check_structure(self.path, ElementTree.tostring(urdf, encoding="unicode"))
        return urdf

    @property
    def name(self) -> str:
        """Name of the robot in the URDF."""
        return str(self.root.get("name") or self.path.stem)

    def child_of(self, joint: str) -> str:
        """Return the child link of a joint, or an empty name where there is no such joint."""
        found = self.joints.get(joint)
        return "" if found is None else end_of(found, "child")

    def words_of(self, link: str) -> list[str]:
        """Return the names of a link's parent joint and of its visual meshes."""
        above = [name for name, joint in self.joints.items() if end_of(joint, "child") == link]
        return above + [Path(str(m.get("filename"))).stem for m in self.links[link].iter("mesh")]

    def velocity_limit(self, joint: str) -> float:
        """Return the speed limit of a joint [rad/s], zero without one."""
        speed = self._limit(joint, "velocity")
        return speed if np.isfinite(speed) else 0.0

    def effort_limit(self, joint: str) -> float:
        """Return the effort limit of a joint [N m or N]: zero where the file does not say.

        Infinite where it says that there is none, by a negative or an endless number.
        """
        effort = self._limit(joint, "effort")
        return effort if 0.0 <= effort < ENDLESS else np.inf

    def _limit(self, joint: str, key: str) -> float:
        limit = self.joints[joint].find("limit") if joint in self.joints else None
        return 0.0 if limit is None else number_or(limit.get(key), 0.0)

    def fix_joints(self, names: list[str], kind: str = "rotor") -> None:
        """Convert joints of rotors or thrusters to fixed joints."""
        self.spun |= set(map(self.child_of, names))
        self._fix(names)
        if names:
            self.changes.append(
                f"{len(names)} {kind} joint(s) fixed: the speed of a {kind} belongs to its actuator"
            )

    def fix_legs(self, turned: Mapping[str, str]) -> None:
        """Fix the joints that turn thrusters: the force of a thruster does not turn with a joint.

        Args:
            turned: joint by the link of the thruster.
        """
        self._fix(list(turned.values()))
        self.changes += [
            f"joint {joint} fixed at zero, because it turns {link}: thrusters of SEALS are "
            "fixed to the base"
            for link, joint in turned.items()
        ]

    def _fix(self, names: list[str]) -> None:
        for name, joint in self.joints.items():
            if name in names and joint.get("type") != "fixed":
                fix(joint, "mimic", "safety_controller")

    def copy_meshes(self, folder: Path, *, boxes: bool = False) -> None:
        """Copy every mesh to ``folder/meshes`` and update its path.

        Args:
            folder: of the robot.
            boxes: whether boxes of the inertia take the places of missing collision meshes.

        Raises:
            RobotError: a mesh is missing, cannot be read, or is far too large for metres.
        """
        self.changes += copy_meshes(
            self.root, self.path, folder, self.packages, self._texts, boxes=boxes
        )

    def _leave_out_foreign(self) -> None:
        """Remove elements of other programs; note joints that their transmissions name."""
        foreign = [e for e in self.root if isinstance(e.tag, str) and e.tag not in _OWN]
        known = set(self.joints)
        for element in foreign:
            words = (x for e in element.iter() for x in (e.get("name"), e.text) if x)
            self.stated.driven |= known & {word.strip() for word in words}
            self.root.remove(element)
        if foreign:
            tags = ", ".join(sorted({e.tag for e in foreign}))
            self.changes.append(f"left out: {tags} (of other programs)")
        if self.stated.unread:
            unread = listed(self.stated.unread)
            self.changes.append(f"not read, contains nothing that is used: {unread}")

    def _note_rig(self) -> None:
        """Bolt a base named ``world`` to the world, and name the joints on which the robot moves.

        Raises:
            RobotError: the base is a frame without mass that moves, and no world.
        """
        links, joints = self.links, self.joints
        if self.bases != [WORLD] or mass_of(links[WORLD]) > 0.0:
            return
        self.fixed_base = True
        waiting = [WORLD]
        while waiting:
            above = waiting.pop()
            for name, joint in joints.items():
                if end_of(joint, "parent") != above:
                    continue
                if joint.get("type") != "fixed":
                    self.rig.append(name)
                child = end_of(joint, "child")
                if mass_of(links.get(child)) <= 0.0:
                    waiting.append(child)
        self.rig = [name for name in self.rig if name not in self.stated.driven]
        if self.rig:
            self.changes.append(
                f"moves against the world by: {', '.join(self.rig[:6])}; they have no servos"
            )

    def bolt_base_of_no_mass(self) -> None:
        """Bolt a base whose stated mass is 0 to the world, as PyBullet takes such a file."""
        bases = [self.links[name] for name in self.bases]
        if len(bases) == 1 and not self.fixed_base and bases[0].find("inertial/mass") is not None:
            self.fixed_base = mass_of(bases[0]) <= 0.0
            if self.fixed_base:
                self.changes.append(
                    f"base link '{self.bases[0]}' has a mass of 0: bolted to the world "
                    "(density=500 gives it mass and releases it)"
                )

    def _drop_dummy_base(self) -> None:
        """Remove base links that are only a frame, such as ``base_footprint``, drawn or not."""
        while True:
            links, bases = self.links, self.bases
            if len(bases) != 1:
                return
            name, base = bases[0], links[bases[0]]
            below = [j for j in self.joints.values() if end_of(j, "parent") == name]
            shaped = base.find("inertial") is not None or base.find("collision") is not None
            if shaped or len(below) != 1 or below[0].get("type") != "fixed":
                return
            child = end_of(below[0], "child")
            bare = child in links and links[child].find("inertial") is None
            if bare and base.find("visual") is not None:
                return
            self.root.remove(base)
            self.root.remove(below[0])
            self.dropped.append(name)
            self.fixed_base = self.fixed_base or name == WORLD
            bolted = ", bolted to the world" if name == WORLD else ""
            self.changes.append(
                f"base link '{name}' left out: a frame without mass; "
                f"the base is now '{child}'{bolted}"
            )


def _whole(path: Path, tree: Element, packages: Mapping[str, Path]) -> Element:
    """Return the tree of a file with all that it includes."""
    if tree.tag == "sdf":
        return with_includes(path, tree, packages, [])
    return with_parts(path, tree) if tree.tag == "mujoco" else tree


def _text_of(path: Path) -> str:
    """Text of a URDF or xacro file."""
    if not path.is_file():
        what = "is not a regular file" if path.exists() else "does not exist"
        what = "is a folder" if path.is_dir() else what
        near = [*urdfs_near(path if path.is_dir() else path.parent), *shipped_urdfs()]
        raise RobotError(
            f"URDF {path} {what}.\n{suggestion(str(path), near, label='URDF files near')}"
        )
    try:
        text = read_text(path)
    except LogError as cause:
        raise RobotError(f"URDF {path} cannot be read: {cause}") from cause
    begin = text.lstrip()[:40].lower()
    for mark, (what, advice) in _OTHER.items():
        if begin.startswith(mark):
            raise RobotError(f"{path} is {what}, not a robot file.\n{advice}")
    return text


_PAGE = ("a page of a web site", "Download the file itself: on GitHub, its raw form.")
_OTHER = {
    "version https://git-lfs": ("a pointer of Git LFS", "Fetch the file: git lfs pull."),
    "<!doctype html": _PAGE,
    "<html": _PAGE,
    "404:": _PAGE,
}
"""Beginnings of what is often downloaded in place of a robot file."""


def _freed(root: Element) -> list[str]:
    """Remove floating joints that lead from a bare world frame to the base; return their names.

    A base of SEALS is free by itself, so such a joint says nothing.
    """
    draft = UrdfDraft(root)
    out: list[str] = []
    for name, joint in draft.joints.items():
        parent = end_of(joint, "parent")
        beside = [j for j in draft.joints.values() if end_of(j, "parent") == parent]
        if joint.get("type") != "floating" or parent not in draft.bases or len(beside) != 1:
            continue
        frame = draft.links[parent]
        if mass_of(frame) > 0.0 or any(frame.find(tag) is not None for tag in _SHAPED):
            continue
        root.remove(joint)
        root.remove(frame)
        out.append(f"'{name}'")
    return out


def _uncapped(root: Element) -> int:
    """Write capsules, which some programs read in a URDF, as cylinders; return how many."""
    count = 0
    for geometry in root.iter("geometry"):
        for shape in geometry.findall("capsule"):
            radius, length = (number_or(shape.get(key), 0.0) for key in ("radius", "length"))
            geometry.remove(shape)
            geometry.append(cylinder_element(radius, length, capped=True))
            count += 1
    return count


def _tree_of(path: Path, text: str) -> Element:
    """Parse a robot file within the limits of :func:`seals.untrusted_io.plain_xml`."""
    try:
        return plain_xml(text)
    except ValueError as cause:
        raise RobotError(
            f"{path} cannot be read as XML: {cause}.\nCorrect the file, or use an intact copy."
        ) from cause


def shipped_urdfs() -> dict[str, Path]:
    """Return the URDF files that come with the package as examples, by short name.

    Example:
        >>> list(shipped_urdfs())
        ['own_animal/beetle', 'own_flight/quad', 'own_robot/hexa']
    """
    home = Path(str(resources.files("seals.experiments")))
    found = sorted(home.glob("*/*/urdf/*.urdf"))
    return {f"{path.relative_to(home).parts[0]}/{path.stem}": path for path in found}


def urdfs_near(folder: Path) -> list[str]:
    """Return robot files in a folder and its subfolders, a few levels deep.

    Args:
        folder: to look into; the working directory where it does not exist.
    """
    start = folder if folder.is_dir() else Path()
    levels = ("*", "*/*", "*/*/*")
    found = (p for end in _ENDINGS for level in levels for p in start.glob(level + end))
    return [str(p) for p in itertools.islice(found, _MOST_NEAR)]
