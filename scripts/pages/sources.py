"""Collects the Markdown of the repository for the generator of the pages.

The pages stay good to read where they lie: a link leads from file to file, and lists stand as on a code host. The copies that the generator takes differ from
them in three things. Links lead to where the pages lie in the site, a link that shows the name of a file shows the title of the page, and lists and tables are
set apart as Python-Markdown wants them."""
import re
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath

from . import titles

# {page of the repository: its place in the site}, for those outside docs/ and those that the site alone has.
PLACES = {"docs/site/start.md": "index.md", "docs/site/reference.md": "reference/index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md",
          "formats/FORMAT.md": "formats/FORMAT.md", "assets/README.md": "assets/README.md"}
# Both list the pages, as the site's navigation does.
START = ("README.md", "docs/README.md")
LANGUAGES = {".h": "cpp", ".cuh": "cpp", ".cpp": "cpp", ".cu": "cpp", ".py": "python", ".c": "c", ".cmake": "cmake"}

_FENCE = re.compile(r"^\s*(```|~~~)")
_ITEM = re.compile(r"(?:[-*]|\d+\.) +(?=\S)")
_CODE = re.compile(r"(`+[^`]+`+)")
_LINK = re.compile(r"(?P<before>\]\()(?P<target>[^)\s]+)(?P<after>\))|(?P<name>\b(?:src|href|srcset)=\")(?P<value>[^\"]+)(?P<end>\")")
_WHOLE_LINK = re.compile(r"\[([^\]]+)\]\(([^)\s]+)\)")


def is_elsewhere(target):
    return re.match(r"[a-z]+:", target) is not None or target.startswith("#")


class Site:
    """The files of the site: `pages` are texts by place, `files` are paths to copy by place, `missing` names links that lead nowhere."""

    def __init__(self, root, headers):
        """headers: {path of a public header: the place of its page}."""
        self.root, self.headers = root, headers
        self.pages, self.files, self.missing = {}, {}, []
        self.sources = set()

    def place_of(self, path):
        """Where a file of the repository lies in the site, or None if it has no place there, as a folder."""
        if path in START:
            return "index.md"
        if path in PLACES:
            return PLACES[path]
        if path in self.headers:
            return self.headers[path]
        found = self.root / path
        if not found.is_file():
            return None
        inside = PurePosixPath(path)
        if inside.parts[0] == "docs" and (inside.suffix == ".md" or inside.parts[1] in ("images", "results")):
            return inside.relative_to("docs").as_posix()
        return f"source/{path}.md"

    def link(self, page, place, target):
        """The target of a link as the site has it; None if it leads to a folder."""
        path, hash_sign, anchor = target.partition("#")
        file = normpath((PurePosixPath(page).parent / path).as_posix())
        if file.endswith(".png") and self.root.joinpath(file).with_suffix(".svg").is_file():
            file = file[:-len("png")] + "svg"
        there = self.place_of(file)
        if there is None:
            if not (self.root / file).exists():
                self.missing.append(f"{page}: {target}")
            return None
        if there.startswith("source/"):
            self.sources.add(file)
        elif not there.endswith(".md"):
            self.files[there] = self.root / file
        return relpath(there, PurePosixPath(place).parent.as_posix()) + hash_sign + anchor

    def with_links(self, page, place, text):
        def replaced(match):
            target = match["target"] or match["value"]
            if is_elsewhere(target):
                return match[0]
            there = self.link(page, place, target) or target
            return f"{match['before']}{there}{match['after']}" if match["target"] else f"{match['name']}{there}{match['end']}"

        def shown(match):
            """A link to a folder loses its target; one to a page shows the title in place of the file's name."""
            words, target = match[1], match[2]
            if is_elsewhere(target):
                return match[0]
            if self.link(page, place, target) is None:
                return words
            file = (PurePosixPath(page).parent / target.partition("#")[0]).as_posix()
            return f"[{titles.title_of(self.root / normpath(file))}]({target})" if words == PurePosixPath(file).name else match[0]

        parts = _CODE.split(text)
        # Code may stand in the words of a link, so links are looked for in the whole text; code holds no links itself.
        hidden = {f"\0{k}\0": part for k, part in enumerate(parts) if k % 2}
        text = "".join(f"\0{k}\0" if k % 2 else part for k, part in enumerate(parts))
        text = _LINK.sub(replaced, _WHOLE_LINK.sub(shown, text))
        return re.sub(r"\0\d+\0", lambda match: hidden[match[0]], text)

    def add_page(self, page):
        """page: a path of the repository."""
        place = self.place_of(page)
        text = (self.root / page).read_text(encoding="utf-8")
        self.pages[place] = "\n".join(self.with_links(page, place, line) if not fenced else line for line, fenced in set_apart(text.splitlines())) + "\n"

    def add_sources(self):
        """Makes a page of each file that others link to and that is no page itself."""
        for path in sorted(self.sources):
            language = LANGUAGES.get(Path(path).suffix, "sh" if Path(path).parts[0] == "scripts" else "text")
            text = (self.root / path).read_text(encoding="utf-8")
            self.pages[f"source/{path}.md"] = f"---\nsearch:\n  exclude: true\nhide: [navigation]\n---\n# {path}\n\n````` {{.{language}}}\n{text}\n`````\n"


def set_apart(lines):
    """Lines as Python-Markdown wants them, each with whether it is code: nested items stand four spaces in, and a list or a table follows an empty line."""
    inside, fence_shift, before = [], None, ""  # columns at which the text of the open items begins; the shift of the open fence; the last line
    for line in lines:
        if fence_shift is not None:
            yield (" " * fence_shift + line if fence_shift > 0 else line, True)
            if _FENCE.match(line):
                fence_shift, before = None, line
            continue
        text = line.lstrip(" ")
        column = len(line) - len(text)
        if not text:
            yield "", False
            before = ""
            continue
        while inside and column < inside[-1]:
            inside.pop()
        item = _ITEM.match(text)
        last = before.lstrip()
        new_list = item and last and not _ITEM.match(last) and (not inside or before.startswith(" "))
        if new_list or text.startswith("|") and last and not last.startswith("|") or text.startswith("<!--") and last.startswith("|"):
            yield "", False
        shift = 4 * len(inside) - (inside[-1] if inside else 0)
        yield " " * max(column + shift, 0) + text, False
        if item:
            inside.append(column + item.end())
        if _FENCE.match(line):
            fence_shift = shift
        before = line


def collect(root, headers):
    """All pages of the repository that the site shows; see PLACES."""
    site = Site(root, headers)
    pages = sorted(path.relative_to(root).as_posix() for path in (root / "docs").rglob("*.md"))
    for page in [*PLACES, *(page for page in pages if page not in PLACES and page not in START and not page.startswith("docs/site/"))]:
        site.add_page(page)
    return site
