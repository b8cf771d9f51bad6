"""The examples of docs/python.md, docs/gradients.md, docs/points_and_rays.md and of all docstrings run, and print what they say."""
import contextlib
import doctest
import importlib
import io
import os
import pkgutil
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES

ROOT = Path(os.environ["TANDEM_SOURCE_DIR"])
PAGES = ["docs/python.md", "docs/gradients.md", "docs/points_and_rays.md"]


@pytest.mark.parametrize("page", PAGES)
def test_pages_show_what_happens(page, tmp_path, monkeypatch):
    subprocess.run([os.environ["TANDEM_BVHBUILD"], ROOT / "assets/cow_1500.obj", "-o", tmp_path / "cow.bvh", "--quiet"], check=True)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```\n(?:```\n(.*?)^```\n)?", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert blocks
    names = {}
    for code, shown in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, page, "exec"), names)
        assert printed.getvalue() == shown


def modules():
    """All that are imported with the package alone."""
    names = [name for _, name, _ in pkgutil.iter_modules(tandem.__path__) if name in ("_arrays", "_asset", "_build", "_errors", "_rows", "_scene", "_world", "gradients")]
    return [tandem] + [importlib.import_module(f"tandem.{name}") for name in names]


def test_docstrings_show_what_happens():
    examples = 0
    for module in modules():
        box = tandem.build(BOX_VERTICES, BOX_FACES)
        failed, tried = doctest.testmod(module, extraglobs={"tandem": tandem, "np": np, "box": box, "scene": tandem.Scene([box])})
        assert failed == 0
        examples += tried
    assert examples > 25


def test_everything_public_has_a_docstring():
    for name in tandem.__all__:
        thing = getattr(tandem, name)
        if isinstance(thing, type):
            assert thing.__doc__, name
            for attribute, member in vars(thing).items():
                if not attribute.startswith("_") and (callable(member) or isinstance(member, (property, staticmethod))) and not hasattr(thing, "_fields"):
                    assert member.__doc__, f"{name}.{attribute}"
        elif callable(thing):
            assert thing.__doc__, name
