"""Docstrings as the pages want them: examples are code, and a page that a docstring names is a link."""
import re

import griffe

_EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)
_PAGE = re.compile(r"\bdocs/([\w/-]+)\.md\b")


class Readable(griffe.Extension):
    def on_object(self, *, obj, loader, **arguments):
        if obj.docstring:
            text = _EXAMPLE.sub(r"```pycon\n\g<0>\n```", obj.docstring.value)
            obj.docstring.value = _PAGE.sub(r"[\1.md](../../\1.html)", text)
