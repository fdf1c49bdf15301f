"""The glossary: each term once, with a source that is listed; effects and kinds are in it."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from seals import registry

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "glossary.md"
TEXT, _, LATER = PAGE.read_text(encoding="utf-8").partition("## Retired words")


def rows_of(text: str) -> list[list[str]]:
    """Return the cells of the rows of tables, without their heads."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in cells if row[0] not in ("term", "retired") and "---" not in row[0]]


ROWS = rows_of(TEXT)
RETIRED = {word: row[1] for row in rows_of(LATER) for word in row[0].split(", ")}
"""Words that no longer stand for a thing, and the one that does."""
SHORT = {"guide": "reference generator", "twin": "batch dynamics", "ledger": "load ledger|forces"}
"""What commands call a thing in one word, and its term or what says it."""
CODE = re.compile(
    r"```.*?```|``[^`]*``|`[^`]*`|seals new datasheet|  datasheet\b|\S*datasheet\.yaml"
    r"|\bnominal(?=[:.])|^nominal tolerances",  # a key, alone or in a list of keys
    re.DOTALL,
)
KINDS = ("md", "py", "yaml")
"""Files that say something: pages, modules with their help and messages, configurations."""
KEY = re.compile(r"[\w.@/-]+:(?=\s)")
"""Of a YAML file."""
TERMS = {re.sub(r"`[^`]*`", "", row[0]).strip(" ,").casefold() for row in ROWS}
TYPED = set(re.findall(r"`([^`]+)`", " ".join(row[0] for row in ROWS)))
"""What the first column says that a configuration or a program types."""


def test_each_row_has_term_symbol_unit_meaning_and_source() -> None:
    """Five cells, none empty, and no term twice."""
    assert [row for row in ROWS if len(row) != 5 or not all(row)] == []
    assert [term for term, n in Counter(row[0].casefold() for row in ROWS).items() if n > 1] == []
    assert len(TERMS) == len(ROWS)


@pytest.mark.parametrize("name", registry.names("effect"))
def test_an_effect_of_seals_is_in_the_glossary(name: str) -> None:
    """Its registered name stands beside a term; effects of other packages need not."""
    if registry.get("effect", name).distribution == "aam-seals":
        assert name in TYPED


@pytest.mark.parametrize("kind", registry.GROUPS)
def test_a_kind_of_plugin_is_in_the_glossary(kind: str) -> None:
    """It is a term, or what one types beside a term."""
    assert kind in TERMS or {kind, f"{kind}="} & TYPED


def test_each_source_is_listed() -> None:
    """A name in the last column begins an entry of the list of sources."""
    listed = LATER.partition("## Sources")[2]
    cited = {part for row in ROWS for part in row[4].split(", ") if part != "–"}
    for source in cited:
        author, _, year = source.replace(" et al.", "").rpartition(" ")
        entries = [e for e in listed.splitlines() if (author or source).split(" ")[0] in e]
        assert any(year in entry for entry in entries), source


def said(path: Path) -> Iterator[str]:
    """Yield the prose of a file without code: a page, a module's sentences, comments of YAML.

    Of a YAML file values are read as well. Descriptions in the modules of identification are not
    read, only what they print.
    """
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield CODE.sub("", text)
        return
    if path.suffix == ".yaml":
        yield CODE.sub("", KEY.sub("", text))
        return
    tree = ast.parse(text)
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    inner = "sysid" in path.parts
    for node in ast.walk(tree):
        told = isinstance(node, ast.Constant) and not (inner and id(node) in docs)
        if told and isinstance(node.value, str) and " " in node.value:
            yield CODE.sub("", node.value)


def retired(text: str) -> list[str]:
    """Return the retired words in a text, each with the one to use."""
    here = {word for word in RETIRED if re.search(rf"\b{word}s?\b", text, re.IGNORECASE)}
    return [f"{word}: say {RETIRED[word]}" for word in sorted(here)]


@pytest.mark.thorough
def test_a_thing_has_one_name() -> None:
    """No page, help text or message uses a retired word; each has a successor that is a term."""
    assert set(RETIRED.values()) <= {term.partition(",")[0] for term in TERMS}
    rooms = ("seals", "plugins", "experiments", "robots", "animals", "conf")
    files = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    files += [f for room in rooms for kind in KINDS for f in (ROOT / room).rglob(f"*.{kind}")]
    assert {path.suffix[1:] for path in files} == set(KINDS)
    found = {
        f"{path.relative_to(ROOT)}: {word}"
        for path in files
        if path not in (PAGE, ROOT / "CHANGELOG.md")  # which quote what was said before
        for text in said(path)
        for word in retired(text)
    }
    assert sorted(found) == []


def test_a_retired_word_is_found(tmp_path: Path) -> None:
    """In capitals and in the plural, too, in comments of YAML, but not as code or key."""
    assert retired("Nominal models differ.") == ["nominal: say stated model"]
    assert retired("The sea floor rises.") == ["sea floor: say sea bed"]
    assert retired(CODE.sub("", "See `datasheet.yaml` and seals new datasheet.")) == []
    (tmp_path / "a.yaml").write_text("nominal: {mass: 1.0}  # of the sea floor\n", encoding="utf-8")
    assert [w for text in said(tmp_path / "a.yaml") for w in retired(text)] == [
        "sea floor: say sea bed"
    ]


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.stem)
def test_short_names_are_explained_where_a_page_first_uses_them(page: Path) -> None:
    """Guide, twin and ledger are said in full in the line of their first use."""
    lines = CODE.sub("", page.read_text(encoding="utf-8")).splitlines()
    for short, full in SHORT.items():
        first = next((x for x in lines if re.search(rf"\b{short}s?\b", x, re.IGNORECASE)), full)
        assert re.search(full, first, re.IGNORECASE), first
