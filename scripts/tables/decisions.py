"""The index of docs/decisions, from its pages."""
import re

from common.tabular import markdown

HEAD = re.compile(r"# (?P<title>.+)\n\n(?P<date>\d{4}-\d\d-\d\d) · (?P<status>\*(?:holds|superseded by \[\d{4}\]\(\d{4}[\w-]*\.md\))\*.*)\n\n"
                  r"\*\*Question\.\*\* ")
VERDICT = re.compile(r"^\*\*Verdict\.\*\* (?P<first>.+?\.)(?:\s|\Z)", re.MULTILINE | re.DOTALL)


def read(folder):
    """[(path, fields of HEAD and VERDICT), ...] of the pages by number. Raises ValueError for a page of another form, and where a number is missing."""
    pages = []
    for path in sorted(path for path in folder.glob("*.md") if path.name != "README.md"):
        text = path.read_text(encoding="utf-8")
        head, verdict = HEAD.match(text), VERDICT.search(text)
        if not head or not verdict or "\n**Figures.** " not in text and "\n**Figures.**\n" not in text:
            raise ValueError(f"{path.name}: not a title, a date, a status, **Question.**, **Figures.** and **Verdict.**")
        pages.append((path, {**head.groupdict(), **verdict.groupdict()}))
    numbers = [path.name[:4] for path, _ in pages]
    if numbers != [f"{n:04}" for n in range(1, len(pages) + 1)]:
        raise ValueError(f"{folder.name}: numbers are not 0001 to {len(pages):04}, each once")
    return pages


def index(pages):
    """Newest first."""
    rows = [[f"[{path.name[:4]}]({path.name})", fields["title"], fields["date"], fields["status"], fields["first"].replace("\n", " ")]
            for path, fields in reversed(pages)]
    return markdown(["", "decision", "date", "status", "verdict"], rows, "lllll")
