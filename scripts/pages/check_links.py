"""Tests of the built pages that need no browser: every link and anchor leads somewhere in the folder, pictures have words, and nothing is asked of other hosts."""
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Markdown that the generator took for plain text.
LEFTOVER = re.compile(r"^(?:[-*] |\d+\. |\|[^|\n]*\|[^|\n]*\||#+ |```)", re.MULTILINE)
_ATTRIBUTES = {"a": "href", "img": "src", "link": "href", "script": "src", "source": "srcset", "iframe": "src", "video": "src", "object": "data"}


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.anchors, self.links, self.loads, self.wordless, self.leftovers = set(), [], [], [], []
        self.paragraph, self.code = None, 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        target = given.get(_ATTRIBUTES.get(tag, ""))
        if target and given.get("rel") != "canonical":
            (self.links if tag == "a" else self.loads).append(target)
        if tag == "img" and not given.get("alt"):
            self.wordless.append(given.get("src"))
        if tag == "p":
            self.paragraph = ""
        self.code += tag in ("code", "pre")

    def handle_endtag(self, tag):
        self.code -= tag in ("code", "pre")
        if tag == "p" and self.paragraph is not None:
            if LEFTOVER.search(self.paragraph):
                self.leftovers.append(self.paragraph.strip()[:60])
            self.paragraph = None

    def handle_data(self, data):
        if self.paragraph is not None and not self.code:
            self.paragraph += data


def defects(site):
    """Returns a line for each defect of the pages below the folder."""
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html")) if "playground" not in path.relative_to(site).parts}
    found = []
    for path, page in pages.items():
        name = path.relative_to(site.resolve())
        found += [f"{name}: a picture without words: {source}" for source in page.wordless]
        found += [f"{name}: Markdown is left in the text: {text}" for text in page.leftovers]
        for target in page.links + page.loads:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                if target in page.loads:
                    found.append(f"{name}: loads {target}")
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if there.is_dir():
                found.append(f"{name}: leads to a folder, which a browser lists if there is no server: {target}")
            elif not there.is_file() and Path(site.resolve(), "playground") not in there.parents:
                found.append(f"{name}: leads nowhere: {target}")
            elif parts.fragment and there in pages and unquote(parts.fragment) not in pages[there].anchors:
                found.append(f"{name}: there is no such place: {target}")
    return found
