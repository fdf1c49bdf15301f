"""Parts of the site's building: links of the repository, docstrings taken apart."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

BUILDING = Path(__file__).parents[2] / "docs" / "building"
if str(BUILDING) not in sys.path:
    sys.path.append(str(BUILDING))

from docstrings import words_of  # noqa: E402
from links import relinked  # noqa: E402

KNOWN = {
    "docs/start.md": "start.md",
    "docs/images/a.webp": "images/a.webp",
    "robots/ball/README.md": "robots/ball/README.md",
    "CHANGELOG.md": "changelog.md",
}


@pytest.mark.parametrize(
    ("source", "place", "text", "wanted"),
    [
        ("docs/loop.md", "loop.md", "[a](start.md#fly)", "[a](start.md#fly)"),
        ("CHANGELOG.md", "changelog.md", "[a](docs/start.md)", "[a](start.md)"),
        (
            "robots/ball/README.md",
            "robots/ball/README.md",
            "![a](../../docs/images/a.webp)",
            "![a](../../images/a.webp)",
        ),
        ("docs/loop.md", "loop.md", "[a](../robots/ball)", "[a](robots/ball/README.md)"),
        ("docs/loop.md", "loop.md", "[a program](../setup.py)", "a program"),
        ("docs/loop.md", "loop.md", "[a](nowhere.md)", "[a](nowhere.md)"),
        ("docs/loop.md", "loop.md", "[a](https://a.b/c)", "[a](https://a.b/c)"),
        ("docs/loop.md", "loop.md", "`[a](../setup.py)`", "`[a](../setup.py)`"),
        (
            "docs/loop.md",
            "loop.md",
            "```text\n[a](../setup.py)\n```",
            "```text\n[a](../setup.py)\n```",
        ),
    ],
)
def test_links_lead_to_pages_of_the_site(
    tmp_path: Path, source: str, place: str, text: str, wanted: str
) -> None:
    """Links between pages are kept, those to programs lose their target, wrong ones stay wrong."""
    (tmp_path / "setup.py").touch()
    found = relinked(text, source=source, place=place, known=KNOWN, root=tmp_path)
    assert found == wanted


def test_a_docstring_is_taken_apart() -> None:
    """Summary, sections in order, and each argument with all of its lines."""
    words = words_of(
        "Drag of a *body*.\n\n"
        "Equation:\n    F = -c v\n    for all v\n\n"
        "Args:\n    c: coefficient,\n        of ``drag`` [N s/m].\n    medium: where.\n\n"
        "Example:\n    >>> 1 + 1\n    2\n"
    )
    assert words.summary == r"Drag of a \*body\*."
    assert list(words.sections) == ["Equation", "Args", "Example"]
    assert words.section("Equation") == "**Equation**\n\n```text\nF = -c v\nfor all v\n```"
    assert words.arguments()["c"] == r"coefficient, of `drag` \[N s/m]."
    assert words.section("Example").startswith("**Example**\n\n```pycon\n>>> 1 + 1")
