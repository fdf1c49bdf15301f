"""The documentation site: built strictly, whole, and without anything from elsewhere."""

from __future__ import annotations

import dataclasses
import html
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from seals import registry
from seals.cli.main import VERBS
from seals.config.roots import recipe_groups
from seals.logs.channels import CHANNELS
from seals.schema import parameters_of

ROOT = Path(__file__).parents[2]
OURS = "aam-seals"
CLASSES = [
    plugin
    for kind in registry.GROUPS
    if kind not in registry.FOLDER_KINDS
    for plugin in registry.plugins(kind).values()
    if plugin.distribution == OURS
]
ELSEWHERE = re.compile(r'<(?:script|img|iframe|source)[^>]+src="(?:https?:)?//|url\(["\']?http')
STYLES = re.compile(
    r'<link[^>]+rel="(?:stylesheet|preload|preconnect|icon)"[^>]+href="(?:https?:)?//'
)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` builds it."""
    pytest.importorskip("material", reason="the site needs aam-seals[docs]")
    place = tmp_path_factory.mktemp("site")
    words = ["-m", "mkdocs", "build", "--strict", "-f", str(ROOT / "mkdocs.yml")]
    surroundings = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "https_proxy": "http://127.0.0.1:9"}
    built = subprocess.run(
        [sys.executable, *words, "-d", str(place / "built")],
        cwd=place,
        env=surroundings,
        capture_output=True,
        text=True,
        check=False,
    )
    said = built.stdout + built.stderr
    assert built.returncode == 0, said
    # INFO says what is done; anything else is a warning
    assert [line for line in said.splitlines() if line and not line.startswith("INFO ")] == []
    return place / "built"


@pytest.mark.thorough
def test_the_search_weighs_whole_words(site: Path) -> None:
    """The theme's worker asks for the term itself before all that begins with it."""
    (worker,) = (site / "assets" / "javascripts" / "workers").glob("search.*.min.js")
    assert worker.read_text(encoding="utf-8").count("^30 ${") == 1


def words_of(page: Path) -> str:
    """The text of a built page, without its marks."""
    text = page.read_text(encoding="utf-8")
    return html.unescape(re.sub(r"<[^>]+>", "", text))


@pytest.mark.parametrize("plugin", CLASSES, ids=lambda p: f"{p.kind}-{p.name}")
def test_a_plugin_is_in_the_reference_with_all_its_parameters(
    site: Path, plugin: registry.Plugin
) -> None:
    """Its page names every field, and of a physical one bounds and unit; the list leads there."""
    reference = site / "reference"
    page = (reference / plugin.kind / f"{plugin.name}.html").read_text(encoding="utf-8")
    found = html.unescape(re.sub(r"<[^>]+>", " ", page))
    listed = (reference / f"{plugin.kind}.html").read_text(encoding="utf-8")
    assert f'href="{plugin.kind}/{plugin.name}.html"' in listed
    cls = plugin.load()
    declared = parameters_of(cls)
    for field in (field for field in dataclasses.fields(cls) if field.init):
        assert re.search(rf"\b{field.name}\b", found), field.name
        if field.name in declared:
            low, high = declared[field.name].bounds
            assert f"{low:g} to {high:g}" in found
            assert declared[field.name].unit in found + " 1"


def test_robots_recipes_verbs_and_channels_are_in_the_reference(site: Path) -> None:
    """Whatever has a name has a place."""
    reference = site / "reference"
    for kind in ("robot", "animal"):
        ours = [n for n, p in registry.plugins(kind).items() if p.distribution == OURS]
        pages = {name: words_of(reference / kind / f"{name}.html") for name in ours}
        assert [name for name, page in pages.items() if f"{kind} {name} " not in page] == []
        assert [name for name, page in pages.items() if str(ROOT) in page] == []
    recipes = words_of(reference / "recipes.html")
    ours = [path.stem for paths in recipe_groups().values() for path in paths]
    assert [name for name in ours if name not in recipes] == []
    verbs = words_of(reference / "verbs.html")
    assert [name for name in VERBS if f"usage: seals {name} " not in verbs] == []
    channels = words_of(reference / "channels.html")
    assert [c.stem for c in CHANNELS.values() if c.meaning not in channels] == []


def test_every_page_is_reached_and_asks_for_nothing_elsewhere(site: Path) -> None:
    """Each page of `docs/` is in the navigation; none loads a font, script or picture."""
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 60
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert not ELSEWHERE.search(text), page.name
        assert not STYLES.search(text), page.name
    listed = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert [p.name for p in (ROOT / "docs").glob("*.md") if f": {p.name}" not in listed] == []


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("# A\n\n[start](index.md#a)\n", ""),
        ("# A\n\n[nowhere](nowhere.md)\n", "nowhere.md"),
        ("# A\n\n[nowhere](index.md#nowhere)\n", "#nowhere"),
    ],
)
def test_make_docs_stops_at_a_warning(tmp_path: Path, text: str, warning: str) -> None:
    """Its very command refuses a page or an anchor that is not there, and names it."""
    pytest.importorskip("material", reason="the site needs aam-seals[docs]")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text(text, encoding="utf-8")
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    kept = {key: settings[key] for key in ("site_name", "strict", "validation")}
    (tmp_path / "mkdocs.yml").write_text(yaml.safe_dump(kept), encoding="utf-8")
    program = tmp_path / ".venv-test" / "bin" / "mkdocs"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m mkdocs "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    built = subprocess.run(
        ["make", "-f", str(ROOT / "Makefile"), "-o", ".venv-test/installed", "docs"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (built.returncode == 0) == (warning == ""), built.stderr
    assert warning in built.stderr


def test_the_citation_is_sound() -> None:
    """Version and licence are the package's; authors, title and message are there."""
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    package = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{cited["version"]}"' in package
    assert f'license = "{cited["license"]}"' in package
    assert cited["cff-version"] == "1.2.0"
    assert all(cited[key] for key in ("authors", "title", "message"))
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {cited['version']}" in changes


def test_what_the_particle_water_missed_is_said_where_it_is_used() -> None:
    """Each figure that the error table calls missed stands on the page for users."""
    table = (ROOT / "docs" / "water_validation.md").read_text(encoding="utf-8")
    rows = [line.split("|") for line in table.splitlines() if line.endswith("| missed |")]
    page = (ROOT / "docs" / "particle_water_accuracy.md").read_text(encoding="utf-8")
    assert [row[1:3] for row in rows if row[5].strip().replace("%", " %") not in page] == []
