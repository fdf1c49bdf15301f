"""Resolution of mesh file names in URDFs: relative, absolute, package://, model://."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import unquote, urlparse
from xml.etree import ElementTree

from seals.errors import LogError, RobotError
from seals.robot.structure import with_plain_comments
from seals.untrusted_io import plain_xml, read_text

_LEVELS = 6
"""Parent folders of the URDF that are searched for a package."""
_SHOWN = 5

_MOST_MANIFEST = 1 << 20


class MissingMesh(RobotError):
    """A mesh that is not there, holds no triangles, or has an unsupported format."""


def read_tree(path: Path) -> ElementTree.Element:
    """Return the root element of a file that another one includes.

    Raises:
        RobotError: it is not there, or no XML; the message names it.
    """
    try:
        return plain_xml(with_plain_comments(read_text(path)))
    except (LogError, ValueError) as cause:
        raise RobotError(f"{path} cannot be read: {cause}") from cause


def find_resource(name: str, urdf: Path, packages: Mapping[str, Path]) -> Path:
    """Return the file to which a mesh's ``filename`` refers.

    Args:
        name: as written in the URDF.
        urdf: path of the URDF.
        packages: folders of packages that the user gave, by name.

    Raises:
        MissingMesh: it is nowhere; the message lists the places that were tried.
    """
    tried: list[Path] = []
    for place in _places(name, urdf.resolve(), packages):
        if place.is_file():
            return place
        if place not in tried:
            tried.append(place)
    shown = ", ".join(str(place) for place in tried[:_SHOWN])
    more = f" and {len(tried) - _SHOWN} more" if len(tried) > _SHOWN else ""
    package = urlparse(name).netloc
    boxes = "missing-meshes=boxes puts a box with the inertia of the link in its place."
    advice = f"give its folder, package={package}=FOLDER; or " if package else ""
    raise MissingMesh(
        f"mesh '{name}' of {urdf} does not exist. Tried: {shown}{more}.\nTo go on: {advice}{boxes}"
    )


def _places(name: str, urdf: Path, packages: Mapping[str, Path]) -> Iterator[Path]:
    """Yield the places warnings, the likeliest first."""
    try:
        parts = urlparse(name.replace("\\", "/"))
    except ValueError as cause:
        raise MissingMesh(
            f"mesh '{name[:80]}' of {urdf} is not an address: {cause}.\n"
            "Allowed: a path, package://NAME/PATH, model://NAME/PATH or file://PATH"
        ) from cause
    scheme, package = parts.scheme, parts.netloc
    rest = Path(unquote(parts.path).lstrip("/"))
    if scheme in ("package", "model"):
        yield from _in_package(package, rest, urdf, packages)
    elif scheme == "file":
        yield Path("/") / rest
        yield urdf.parent / package / rest
        yield urdf.parent / rest.name
    else:
        given = Path(name.replace("\\", "/"))
        yield urdf.parent / given
        yield urdf.parent / "meshes" / given.name
        yield urdf.parent.parent / "meshes" / given.name


def _in_package(
    package: str, rest: Path, urdf: Path, packages: Mapping[str, Path]
) -> Iterator[Path]:
    """Yield places of a file in a package: given, around the URDF, on ROS's search path."""
    if package in packages:
        yield packages[package] / rest
        return
    for folder in list(urdf.parents)[:_LEVELS]:
        if folder.name == package or _declares(folder, package):
            yield folder / rest
        yield folder / package / rest
    for root in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if root:
            yield Path(root) / package / rest
    for root in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if root:
            yield Path(root) / "share" / package / rest
    # a copy of the description without its package around it
    yield urdf.parent / rest
    yield urdf.parent.parent / rest


def _declares(folder: Path, package: str) -> bool:
    """Return whether a folder's ``package.xml`` declares the package."""
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return False
    try:
        text = read_text(manifest, most=_MOST_MANIFEST)
        if "<!" in text.replace("<!--", "") or "\0" in text:
            # entities can expand without end; a manifest needs none
            return False
        name = ElementTree.fromstring(text.encode()).findtext("name")
    except (ElementTree.ParseError, OSError, ValueError, LogError):
        return False
    return (name or "").strip() == package
