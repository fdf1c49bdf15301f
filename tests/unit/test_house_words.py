"""The project speaks of itself, in finished sentences."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = (
    "seals",
    "plugins",
    "robots",
    "animals",
    "conf",
    "experiments",
    "tests",
    "docs",
    "benchmarks",
)
ENDINGS = {".py", ".md", ".yaml", ".yml", ".toml", ".txt", ".urdf", ".sh", ".cfg", ".rst"}
# spelt in pieces so that this file does not breach its own rule
FORBIDDEN = {
    "unfinished work": "|".join(
        (r"\bTO" + "DO", r"\bFIX" + "ME", r"\bX" + r"XX\b", r"\bHA" + r"CK\b")
    ),
    "an issue number": r"(?:\bissue|\bPR|\bpull request|\bticket)s? #?\d+|\(#" + r"\d+\)",
    "a private path": "/" + r"work/|/ho" + r"me/\w|/ro" + r"ot/",
    "a workplace word": r"\bClau" + r"de\b|\bChat" + r"GPT|\bAn" + r"thropic|\bOpen" + r"AI\b",
    "a swallowed error": r"^\s*except\s*:|except (?:Base)?Exception:\s*pass",
}
ANY = re.compile("|".join(FORBIDDEN.values()), re.MULTILINE)


def texts(root: Path) -> list[Path]:
    """Return the text files of the repository."""
    inside = [path for folder in FOLDERS for path in (root / folder).rglob("*")]
    files = [path for path in [*root.glob("*"), *inside] if path.suffix in ENDINGS]
    return sorted(path for path in files if path.is_file() and "egg-info" not in str(path))


def forbidden_words(root: Path) -> list[str]:
    """Find words that do not belong into the repository, with file and line."""
    found = []
    for path in texts(root):
        text = path.read_text(encoding="utf-8")
        if not ANY.search(text):
            continue
        for number, line in enumerate(text.splitlines(), start=1):
            for reason, pattern in FORBIDDEN.items():
                if re.search(pattern, line):
                    found.append(
                        f"{path.relative_to(root)}:{number}: {reason}: {line.strip()[:60]}"
                    )
    return found


def test_no_forbidden_words() -> None:
    """Nothing unfinished, private or borrowed is written into the repository."""
    assert forbidden_words(ROOT) == []


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("# TO" + "DO: later", "unfinished work"),
        ("# see iss" + "ue #12", "an issue number"),
        ("path = '/wo" + "rk/x'", "a private path"),
        ("except" + ":", "a swallowed error"),
    ],
)
def test_the_word_rule_bites(tmp_path: Path, line: str, reason: str) -> None:
    """Each kind of forbidden word is found with its line."""
    (tmp_path / "seals").mkdir()
    (tmp_path / "seals" / "bad.py").write_text(f"x = 1\n{line}\n")
    assert forbidden_words(tmp_path)[0].startswith(f"seals/bad.py:2: {reason}")
