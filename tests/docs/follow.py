"""Follow pages as they are printed, each in an empty folder: ``python -m tests.docs.follow PAGES``.

``--slow`` runs the slow blocks too. Exit code: 0 when all is as printed, 1 when not.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from tests.docs.pages import blocks
from tests.docs.session import Session


def follow(page: Path, folder: Path, *, slow: bool = False, loud: bool = False) -> int:
    """Run the blocks of a page in order; return how many there were.

    Args:
        page: the page in Markdown.
        folder: empty folder to work in.
        slow: whether slow blocks are run, too.
        loud: whether each block is told, with its seconds.

    Raises:
        AssertionError: a command ended or printed otherwise than the page says.
    """
    session = Session(folder)
    due = [b for b in blocks(page.read_text(encoding="utf-8")) if b.when in _whens(slow=slow)]
    for block in due:
        start = time.perf_counter()
        session.follow(block)
        if loud:
            told = block.text.partition("\n")[0][:70]
            print(
                f"{page.name}:{block.line}  {time.perf_counter() - start:.1f} s  {told}", flush=True
            )
    return len(due)


def _whens(*, slow: bool) -> tuple[str, ...]:
    return ("always", "slow") if slow else ("always",)


def main(words: list[str]) -> int:
    """Follow the pages named on the command line."""
    wrong = 0
    for name in (word for word in words if word != "--slow"):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place) / "bare"
            folder.mkdir()
            try:
                follow(Path(name), folder, slow="--slow" in words, loud=True)
            except AssertionError as failed:
                wrong += 1
                print(f"{name}: {failed}", file=sys.stderr)
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
