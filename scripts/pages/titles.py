"""Links to pages of docs/ by their titles, in place of the names of their files, which comments and docstrings have."""
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"
_HEADING = re.compile(r"^# (.+)$", re.MULTILINE)
_PAGE = re.compile(r"\bdocs/([\w/-]+(?:\\_[\w/-]+)*)\.md\b")  # Markdown's backslash may stand before an underscore


def title_of(path):
    """The first heading of a page; the name of any other file."""
    heading = _HEADING.search(path.read_text(encoding="utf-8")) if path.suffix == ".md" else None
    return heading[1] if heading else path.name


def linked(text, target):
    """Text with a link in place of each path of a page of docs/. target: returns where a link to a page, by its name, leads."""
    def link(match):
        name = match[1].replace("\\", "")
        return f"[{title_of(DOCS / f'{name}.md')}]({target(name)})"

    return _PAGE.sub(link, text)
