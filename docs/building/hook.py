"""What MkDocs calls while it builds the site: adds the generated pages and mends links.

Nothing generated is kept in the repository: plug-ins, verbs and recipes are read from what is
installed, and the pages outside of ``docs/`` from their own places.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import public_page
import recipe_pages
import repository_pages
from links import relinked
from mkdocs.structure.files import File, Files
from plugin_pages import pages as plugin_pages
from verb_pages import page as verb_page

ROOT = Path(__file__).resolve().parents[2]
WILDCARD = re.compile(r":`\$\{(\w)\}\*`\)")
"""Where the theme's search appends a wildcard to a term."""
WHOLE = 30
"""Weight of a whole word against a word that begins with it [1]."""


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of names, plug-ins, verbs, recipes, and those that lie beside ``docs/``."""
    texts = {
        **plugin_pages(),
        "reference/public.md": public_page.page(),
        "reference/verbs.md": verb_page(),
        "reference/recipes.md": recipe_pages.page(),
        "reference/channels.md": recipe_pages.channels(),
    }
    for place, text in texts.items():
        files.append(File.generated(config, place, content=text))
    for source, place in repository_pages.places(ROOT).items():
        files.append(File.generated(config, place, abs_src_path=str(ROOT / source)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Point the links of a page, which are those of the repository, to the site's pages."""
    del config
    outside = repository_pages.places(ROOT)
    sources = {place: source for source, place in outside.items()}
    here = page.file.src_uri
    known = {f"docs/{file.src_uri}": file.src_uri for file in files} | dict(outside)
    return relinked(
        markdown, source=sources.get(here, f"docs/{here}"), place=here, known=known, root=ROOT
    )


def on_post_build(config: Any) -> None:
    """Let the search find whole words before words that begin with them: wind before windows.

    The theme appends a wildcard to each term of a query; the bare term, weighted, is put before it.
    """
    for worker in (Path(config.site_dir) / "assets/javascripts/workers").glob("search.*.min.js"):
        text = worker.read_text(encoding="utf-8")
        mended = WILDCARD.sub(rf":`${{\1}}^{WHOLE} ${{\1}}*`)", text)
        worker.write_text(mended, encoding="utf-8")
