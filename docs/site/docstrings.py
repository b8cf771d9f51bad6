"""Docstrings as the pages want them: examples are code, and a page that a docstring names is a link."""
import re

import griffe

from pages import titles

_EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)


class Readable(griffe.Extension):
    def on_object(self, *, obj, loader, **arguments):
        if obj.docstring:
            text = _EXAMPLE.sub(r"```pycon\n\g<0>\n```", obj.docstring.value)
            obj.docstring.value = titles.linked(text, lambda name: f"../../{name}.html")
