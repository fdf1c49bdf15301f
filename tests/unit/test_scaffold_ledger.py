"""Ledger of imports: every entry of a file is used, which a change of it shows, or left out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

from seals.errors import RobotError
from seals.robot.structure import expanded, holds_macros, with_plain_comments
from seals.scaffold import takeover
from seals.scaffold.ledger import UNKNOWN, entries
from seals.scaffold.mending import mended
from seals.scaffold.robot import scaffold_robot
from seals.scaffold.takeover import Takeover, shipped_urdfs

HERE = Path(__file__).with_name("urdfs")
FILES = sorted(
    path
    for pattern in (
        "*.urdf",
        "*base.xacro",
        "crab*.xacro",
        "wamv_gazebo.urdf.xacro",
        "*.sdf",
        "*.xml",
    )
    for path in HERE.rglob(pattern)
    if path.name not in ("package.xml", "crab.urdf.xacro")
)
SHIPPED = [*FILES, *shipped_urdfs().values()]
PACKAGES: dict[str, Path] = {}

WEIGHED_LATER = {
    # the hull that a link displaces, and drawings, are shapes of the written URDF: seen there
    "fluid_density": "density of neutral links and of wings alone",
    "thrusterID": "tells a thruster",
    "thrust_coefficient": "tells a thruster: its largest force is stated beside it",
    "propeller_diameter": "radius",
}


@cache
def text_of(path: Path) -> str:
    """Return the text of a file, its macros expanded."""
    text = with_plain_comments(path.read_text(encoding="utf-8"))
    return expanded(path) if holds_macros(text) else text


def sound(path: Path) -> ElementTree.Element | None:
    """Return the tree of a robot's file; None for others and for parts of robots."""
    try:
        tree = takeover._tree_of(path, text_of(path))
    except RobotError:
        return None
    return tree if tree.tag in ("robot", "sdf", "mujoco") else None


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: f"{p.parent.name}/{p.name}")
def test_every_entry_is_accounted_for(path: Path) -> None:
    """Of all files that ship and of all that tests read: none is unknown."""
    tree = sound(path)
    if tree is None:
        pytest.skip("no robot by itself")
    whole = takeover._whole(path, tree, PACKAGES)
    found = list(entries(whole))
    assert [kind for kind, why in found if why == UNKNOWN] == []
    # nothing of the tree is passed over: every attribute and text is an entry
    count = sum(
        len(e.attrib) + bool((e.text or "").strip()) for e in whole.iter() if isinstance(e.tag, str)
    )
    kinds = [kind for kind, _ in found if "@" in kind or "#" in kind]
    assert len(kinds) == count


def places(root: ElementTree.Element) -> Iterator[tuple[str, ElementTree.Element, str]]:
    """Yield kind, element and attribute (or empty for its text) of used entries with numbers."""
    above = {child: parent for parent in root.iter() for child in parent}
    for element in root.iter():
        if not isinstance(element.tag, str):
            continue
        inside = [element]
        while inside[-1] in above:
            inside.append(above[inside[-1]])
        plug_in = any(e.tag == "plugin" for e in inside)
        for key, text in [*element.attrib.items(), ("", element.text or "")]:
            if not re.fullmatch(r"\s*(-?[\d.]+(e[-+]?\d+)?\s*)+", text, re.IGNORECASE):
                continue
            parent = "plugin" if plug_in else str(above[element].tag) if element in above else ""
            kind = f"{parent}/{element.tag}@{key}" if key else f"{parent}/{element.tag}#"
            yield kind, element, key


def fingerprint(path: Path, tree: ElementTree.Element) -> str:
    """Return all that the import hands on of a tree, as text."""
    text = ElementTree.tostring(tree, encoding="unicode")
    keep = takeover._text_of
    takeover._text_of = lambda _: text  # type: ignore[assignment]
    try:
        made = Takeover(path, PACKAGES)
        mended(made, "x")
    except RobotError as refusal:
        return f"refused: {refusal}"
    finally:
        takeover._text_of = keep
    stated = [str(vars(made.stated)), str(made.fixed_base), str(sorted(made._texts.items()))]
    return ElementTree.tostring(made.root, encoding="unicode") + "".join(stated)


def changed(text: str) -> str:
    """Return numbers of which each differs, of the same sign."""
    numbers = [float(word) for word in text.split()]
    return " ".join(f"{1.25 * x or 0.125:.9g}" for x in numbers)


def test_used_entries_are_used() -> None:
    """A change of a number in a used entry changes what is made of it, for every kind."""
    moved: set[str] = set()
    stuck: dict[str, str] = {}
    for path in FILES:
        tree = sound(path)
        if tree is None:
            continue
        used = {kind for kind, why in entries(tree) if not why}
        before = fingerprint(path, tree)
        tried: dict[str, int] = {}
        for kind, element, key in places(tree):
            if kind in moved or kind not in used or tried.get(kind, 0) >= 3:
                continue
            tried[kind] = tried.get(kind, 0) + 1
            was = element.get(key) if key else element.text
            flipped = " ".join("1" if float(word) == 0.0 else "0" for word in str(was).split())
            for value in (changed(str(was)), flipped):
                element.set(key, value) if key else setattr(element, "text", value)
                if fingerprint(path, tree) != before:
                    moved.add(kind)
                    break
            element.set(key, str(was)) if key else setattr(element, "text", was)
            stuck.setdefault(kind, path.name)
    idle = sorted(f"{kind} of {name}" for kind, name in stuck.items() if kind not in moved)
    assert not idle, "; ".join(idle)


def test_what_is_left_out_is_told(tmp_path: Path) -> None:
    """With its reason, in the README of the folder; unknown entries too."""
    text = (HERE / "rover_ros" / "urdf" / "rover.urdf").read_text(encoding="utf-8")
    (tmp_path / "urdf").mkdir()
    file = tmp_path / "urdf" / "rover.urdf"
    file.write_text(re.sub(r"<joint ", '<joint hue="red" ', text, count=1), encoding="utf-8")
    made = scaffold_robot(
        "my", file, parent=tmp_path, packages={"rover_ros": HERE / "rover_ros"}, boxes=True
    )
    told = (made.folder / "README.md").read_text(encoding="utf-8")
    assert f"- {UNKNOWN}: `robot/joint@hue`" in told
    assert made.unused > 0


@pytest.mark.parametrize("above", ["robot", "gazebo"])
def test_elements_without_a_name_in_the_tables_are_unknown(above: str) -> None:
    """No reason stands for whatever an element may be: only elements that are known have one."""
    root = ElementTree.fromstring('<robot name="r"><link name="a"/><gazebo reference="a"/></robot>')
    place = root if above == "robot" else root.find("gazebo")
    assert place is not None
    ElementTree.SubElement(place, "ballast", mass="3")
    found = dict(entries(root))
    assert found[f"{above}/ballast@mass"] == UNKNOWN
