"""For mkdocs: the front page and linked files from elsewhere in the repository, beside the pages of docs/.

On a code host the documents link across folders, such as from docs/ to ../results/. The site holds all of that:
README.md is its first page, every other linked file keeps its path, and links are changed to match.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
FRONT_PAGE = ROOT / "README.md"
_LINK = re.compile(r"(\]\()([^()\s#]+)((?:#[^()\s]*)?\))")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the front page, and whatever lies outside docs/ and is linked from a page."""
    waiting = [FRONT_PAGE, *(DOCS / file.src_uri for file in files.documentation_pages())]
    seen = set(waiting)
    while waiting:
        path = waiting.pop()
        if not path.is_relative_to(DOCS):
            files.append(File.generated(config, _site_uri(path), abs_src_path=str(path)))
        for linked in _linked_files(path):
            if linked not in seen and not linked.is_relative_to(DOCS):
                seen.add(linked)
                waiting.append(linked)
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """The page with its links led to where the site has the files."""
    source = Path(page.file.abs_src_path or "")

    def led(match: re.Match[str]) -> str:
        before, name, after = match.groups()
        target = _target(source, name)
        if ":" in name or not target.is_file():
            return match.group()  # elsewhere on the web, or broken: the build says so
        return before + posixpath.relpath(_site_uri(target), posixpath.dirname(page.file.src_uri) or ".") + after

    return _LINK.sub(led, markdown)


def _linked_files(page: Path) -> list[Path]:
    if page.suffix != ".md":
        return []
    targets = [_target(page, name) for _, name, _ in _LINK.findall(page.read_text(encoding="utf-8"))]
    return [target for target in targets if target.is_file()]


def _target(source: Path, name: str) -> Path:
    return (source.parent / name).resolve()


def _site_uri(path: Path) -> str:
    if path == FRONT_PAGE:
        return "index.md"
    return path.relative_to(DOCS if path.is_relative_to(DOCS) else ROOT).as_posix()
