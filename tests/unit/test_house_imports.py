"""Imports run one way, and nothing heavy is imported by importing the core."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("plugins", "robots", "animals", "conf", "experiments")
HEAVY = {"torch", "taichi", "pybullet", "mujoco", "matplotlib", "pandas", "trimesh", "yourdfpy"}
ORDER = {"seals": 0, "plugins": 1, "conf": 1, "robots": 2, "animals": 2, "experiments": 3}


def modules(root: Path, words: Collection[str] = ("",)) -> Iterator[tuple[Path, ast.Module]]:
    """Yield every Python file of the installed folders that holds one of the words, as a tree."""
    for folder in ("seals", *FOLDERS):
        for path in sorted((root / folder).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            if any(word in text for word in words):
                yield path.relative_to(root), ast.parse(text)


def imports(tree: ast.AST) -> Iterator[str]:
    """Yield the dotted names that a tree imports, in functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
            yield from (f"{node.module}.{alias.name}" for alias in node.names if node.module)


def room(name: str) -> str | None:
    """Return the top-level folder that a dotted import belongs to, or None for foreign packages."""
    parts = name.split(".")
    if parts[0] != "seals":
        return None
    return parts[1] if len(parts) > 1 and parts[1] in FOLDERS else "seals"


def import_breaches(root: Path) -> list[str]:
    """Find imports against the order of the rooms, relative ones, and by a folder's own name."""
    found = []
    for path, tree in modules(root):
        home = path.parts[0]
        for name in imports(tree):
            target = room(name)
            if name.startswith("."):
                found.append(f"{path}: relative import {name}")
            elif name.split(".")[0] in FOLDERS:
                found.append(f"{path}: import {name} instead of seals.{name}")
            elif target is not None and ORDER[target] > ORDER[home]:
                found.append(f"{path}: {home} imports {name}")
            elif home == target == "plugins" and [*name.split("."), "", ""][2] not in (
                "",
                *path.parts,
            ):
                found.append(f"{path}: a plug-in imports {name}, of another kind")
    return found


def heavy_imports(root: Path) -> list[str]:
    """Find heavy packages imported at module level, where importing the core would pay for them."""
    found = []
    for path, tree in modules(root, HEAVY):
        for node in tree.body:
            top = {name.split(".")[0] for name in imports(node)}
            lazy = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            typing_only = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
            if top & HEAVY and not lazy and not typing_only and path.parts[0] == "seals":
                found.append(f"{path}: {', '.join(sorted(top & HEAVY))} at module level")
    return found


def test_imports_run_one_way() -> None:
    """The core imports no plug-in, and no plug-in one of another kind."""
    assert import_breaches(ROOT) == []


def test_nothing_heavy_at_module_level() -> None:
    """Heavy packages are imported inside functions only."""
    assert heavy_imports(ROOT) == []


def layers(page: str) -> list[list[str]]:
    """Read the layers of the core from the page on packages, the highest first."""
    listed = page.partition("compares this list with the sources:\n\n```text\n")[2]
    block = listed.partition("```")[0]
    return [line.split() for line in block.splitlines()]


def core_parts(root: Path) -> set[str]:
    """Name the packages and top modules of the core; ``seals`` itself only offers their names."""
    inside = [p for p in (root / "seals").iterdir() if p.suffix == ".py" or any(p.glob("*.py"))]
    return {path.stem for path in inside} - {"__init__"}


def running(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree without those that only type checkers follow."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for other in node.orelse:
                yield other
                yield from running(other)
            continue
        yield node
        yield from running(node)


def core_imports(root: Path) -> dict[tuple[str, str], list[str]]:
    """Return the imports between parts of the core, lazy ones too, and the files of each."""
    parts = core_parts(root)
    found: dict[tuple[str, str], list[str]] = {}
    for path, tree in modules(root):
        home = path.with_suffix("").parts
        if home[0] != "seals" or home[1] not in parts:
            continue
        for node in running(tree):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module == "seals":
                names = [f"seals.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                names = [f"{node.value.id}.{node.attr}"]
            for name in names:
                top, _, rest = name.partition(".")
                part = rest.partition(".")[0]
                if top == "seals" and not (
                    part in ("", home[1], *FOLDERS) or part.startswith("__")
                ):
                    found.setdefault((home[1], part), []).append(str(path))
    return found


def layer_breaches(root: Path, order: list[list[str]]) -> list[str]:
    """Find imports of the core that do not lead to a lower layer."""
    rank = {part: len(order) - row for row, parts in enumerate(order) for part in parts}
    return [
        f"{files[0]}: {home} imports {part}, which lies no lower"
        for (home, part), files in sorted(core_imports(root).items())
        if rank.get(part, len(order) + 1) >= rank.get(home, 0)
    ]


def test_the_core_has_layers() -> None:
    """Every package and top module lies in one layer, and imports lead to lower ones only."""
    order = layers((ROOT / "docs" / "architecture_packages.md").read_text(encoding="utf-8"))
    assert sorted(part for row in order for part in row) == sorted(core_parts(ROOT))
    assert layer_breaches(ROOT, order) == []


def test_the_core_has_few_packages() -> None:
    """A newcomer finds at most 26 packages."""
    assert len([part for part in core_parts(ROOT) if (ROOT / "seals" / part).is_dir()]) <= 26


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("from seals.world import World", True),
        ("import seals.world.ledger", True),
        ("from seals import world", True),
        ("from seals import World", True),
        ("import seals\nprint(seals.World)", True),
        ("import seals\nprint(seals.__version__)", False),
        ("def f():\n    from seals.world import World", True),
        ("from seals.effects import Effect", True),
        ("from seals.arrays import Array", False),
        ("from seals.robot.model import RobotModel", False),
        ("if TYPE_CHECKING:\n    from seals.world import World", False),
    ],
)
def test_the_layer_rule_bites(tmp_path: Path, line: str, found: bool) -> None:
    """An import of the same or a higher layer is found; a lower one, or one for types, is not."""
    order = [["world"], ["robot", "effects"], ["arrays"]]
    for part in ("world", "robot", "effects", "arrays"):
        (tmp_path / "seals" / part).mkdir(parents=True)
        (tmp_path / "seals" / part / "__init__.py").touch()
    (tmp_path / "seals" / "robot" / "a.py").write_text(line, encoding="utf-8")
    assert bool(layer_breaches(tmp_path, order)) is found


@pytest.mark.parametrize(
    ("path", "line", "words"),
    [
        ("seals/a.py", "import seals.plugins.effects", "seals imports seals.plugins"),
        ("seals/a.py", "def f():\n    from seals import plugins", "seals imports seals.plugins"),
        ("seals/a.py", "from plugins import effects", "instead of seals.plugins"),
        ("seals/a.py", "from . import b", "relative import"),
        ("plugins/waves/a.py", "from seals.robots import ball", "plugins imports seals.robots"),
        ("plugins/waves/a.py", "from seals.plugins.effects import x", "of another kind"),
    ],
)
def test_the_import_rule_bites(tmp_path: Path, path: str, line: str, words: str) -> None:
    """Each breach of the import order is found."""
    (tmp_path / path).parent.mkdir(parents=True)
    (tmp_path / path).write_text(line, encoding="utf-8")
    assert words in " ".join(import_breaches(tmp_path))


def test_the_heavy_rule_bites(tmp_path: Path) -> None:
    """A heavy import at module level is found; one in a function, or for types only, is not."""
    (tmp_path / "seals").mkdir()
    (tmp_path / "seals" / "bad.py").write_text("try:\n    import torch\nfinally:\n    pass\n")
    (tmp_path / "seals" / "good.py").write_text("def f():\n    import torch\n")
    assert heavy_imports(tmp_path) == ["seals/bad.py: torch at module level"]


def module_imports(root: Path) -> dict[str, set[str]]:
    """Return for every module the modules that it imports, lazily too, but not for types alone."""
    trees: dict[str, ast.Module] = {}
    for path, tree in modules(root):
        parts = path.with_suffix("").parts
        parts = parts if parts[0] == "seals" else ("seals", *parts)
        trees[".".join(parts).removesuffix(".__init__")] = tree
    found: dict[str, set[str]] = {}
    for name, tree in trees.items():
        used: set[str] = set()
        for node in running(tree):
            if isinstance(node, ast.Import):
                used |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                used |= {i if i in trees else node.module for i in inner}
        found[name] = (used & set(trees)) - {name}
    return found


def import_circles(root: Path) -> list[str]:
    """Name the modules of every import circle: those that are left when all free ones are taken."""
    left = module_imports(root)
    while free := {name for name, used in left.items() if not used & set(left)}:
        left = {name: used for name, used in left.items() if name not in free}
    # what only imports a circle is in none: take it away from the other end
    while top := set(left).difference(*left.values()):
        left = {name: used for name, used in left.items() if name not in top}
    return sorted(left)


@pytest.mark.thorough
def test_no_module_imports_itself_by_others() -> None:
    """The modules of each package import one way, lazily too, so each is read by itself."""
    assert import_circles(ROOT) == []


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("from seals.robot.a import f", True),
        ("def f():\n    from seals.robot import a", True),
        ("def f():\n    import seals.robot.a", True),
        ("if TYPE_CHECKING:\n    from seals.robot.a import f", False),
        ("from seals.robot.c import f", False),
    ],
)
def test_the_circle_rule_bites(tmp_path: Path, line: str, found: bool) -> None:
    """A circle is found, a lazy one too, and neither what leads to it nor what it leads to."""
    home = tmp_path / "seals" / "robot"
    home.mkdir(parents=True)
    texts = {"a": "from seals.robot.b import f", "b": line, "c": "", "d": "import seals.robot.a"}
    for name, text in {"__init__": "", **texts}.items():
        (home / f"{name}.py").write_text(text, encoding="utf-8")
    assert import_circles(tmp_path) == (["seals.robot.a", "seals.robot.b"] if found else [])
