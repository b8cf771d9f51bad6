#!/usr/bin/python3
"""Tests of the pages: tables are those of their CSV files, what a page names is there, and sources include what docs/architecture.md lets them.

Usage: docs_test.py TablesTest|LinksTest|IncludesTest."""
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
CODE = re.compile(r"`([^`\n]+)`")
FILE_NAME = re.compile(r"[\w.-]+(/[\w.-]+)*/?")
SOURCE_ENDINGS = {".h", ".cuh", ".cu", ".cpp", ".py", ".cmake", ".csv", ".md", ".yaml"}
MENTION = re.compile(r"(?:docs|formats)/[\w/-]+\.md")

INCLUDE = re.compile(r'^#include ["<]([^">]+/[^">]+)[">]', re.MULTILINE)
# Starts of include paths, and what docs/architecture.md calls them.
LIBRARIES = {"CGAL": "CGAL", "CLI": "CLI11", "Eigen": "Eigen", "assimp": "assimp", "fcl": "FCL", "coal": "Coal", "embree3": "Embree", "ode": "ODE", "oneapi": "oneTBB",
             "tbb": "oneTBB", "nanobind": "nanobind", "nlohmann": "nlohmann-json", "cub": "CUB", "thrust": "CUB", "BulletCollision": "Bullet", "sys": None}


def folders():
    """Folders of the repository; not what builds and tools leave there."""
    return [path for path in sorted(ROOT.iterdir()) if path.is_dir() and path.name not in ("build", "out", "shared") and path.name[0] != "."]


FILES = [path for folder in folders() for path in sorted(folder.rglob("*")) if path.is_file() and "__pycache__" not in path.parts]
PAGES = sorted(ROOT.glob("*.md")) + [path for path in FILES if path.suffix == ".md"]


def anchors(text):
    """What GitHub makes of headings."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


class TablesTest(unittest.TestCase):
    def check(self, docs):
        return subprocess.run([ROOT / "scripts/write_tables", "--check", "--docs", docs], capture_output=True, text=True)

    def changed(self, file, before, after):
        """What the check says of a copy of docs/ in which the first `before` of a file is `after`."""
        with tempfile.TemporaryDirectory() as folder:
            docs = Path(folder) / "docs"
            shutil.copytree(ROOT / "docs", docs, ignore=shutil.ignore_patterns("images"))
            text = (docs / file).read_text(encoding="utf-8")
            self.assertIn(before, text)
            (docs / file).write_text(text.replace(before, after, 1), encoding="utf-8")
            return self.check(docs)

    def test_tables_are_those_of_their_files(self):
        done = self.check(ROOT / "docs")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""), "run scripts/write_tables")

    def test_a_changed_figure_fails(self):
        for file, before, after in (("results/gpu_tables.md", "| stack 12 | 2,955 |", "| stack 12 | 2,956 |"),
                                    ("results/cpu/compare.csv", "stack_12,FCL,3", "stack_12,FCL,4"),
                                    ("results/h100/paper.csv", ",fcl,", ",tandem,")):
            with self.subTest(file=file):
                done = self.changed(file, before, after)
                self.assertEqual((done.returncode, done.stderr), (1, ""))
                self.assertIn("by its figures", done.stdout)

    def test_a_page_of_another_form_is_named(self):
        done = self.changed("comparison.md", "<!-- table wrong -->", "<!-- table right -->")
        self.assertEqual(done.returncode, 1)
        self.assertIn("comparison.md", done.stderr)


class LinksTest(unittest.TestCase):
    def test_links_lead_somewhere(self):
        for page in PAGES:
            text = CODE.sub("", FENCE.sub("", page.read_text(encoding="utf-8")))
            for link in (first or second for first, second in LINK.findall(text)):
                if link.startswith(("http:", "https:")):
                    continue
                path, _, anchor = link.partition("#")
                target = page.parent / path if path else page
                with self.subTest(page=page.name, link=link):
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, anchors(target.read_text(encoding="utf-8")))

    def test_named_files_exist(self):
        """Decisions speak of their day, and may name what has gone."""
        paths = [path.relative_to(ROOT).as_posix() for path in FILES]
        names = {path.name for path in FILES} | {path.name for path in ROOT.iterdir()}
        tops = {folder.name for folder in folders()}
        for page in PAGES:
            if page.parent.name == "decisions":
                continue
            for name in CODE.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
                name = name.split()[0].partition(",")[0] if name.split() else ""
                if not FILE_NAME.fullmatch(name):
                    continue
                with self.subTest(page=page.name, name=name):
                    if name.partition("/")[0] in tops and "/" in name:
                        self.assertTrue((ROOT / name).exists())
                    elif Path(name).suffix in SOURCE_ENDINGS and not name.startswith("out/"):
                        self.assertTrue(name in names or any(path.endswith("/" + name) for path in paths))

    def test_pages_that_sources_name_exist(self):
        for path in FILES:
            if path.suffix not in SOURCE_ENDINGS - {".csv", ".md"} and path.parent.name not in ("scripts", "paper"):
                continue
            for mention in MENTION.finditer(path.read_text(encoding="utf-8", errors="replace")):
                with self.subTest(file=path.name, mention=mention[0]):
                    self.assertTrue((ROOT / mention[0]).exists())


    def test_the_filter_of_queries_md_is_that_of_a_test(self):
        shown = re.search(r"^## Filters$.*?^```cpp\n(.*?)^```$", (ROOT / "docs/queries.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)[1]
        test = (ROOT / "tests/kernels/scene/pair_filter_test.cpp").read_text(encoding="utf-8")
        self.assertIn("".join(f"  {line}\n" for line in shown.splitlines()), test)


    def test_excerpts_are_those_of_their_programs(self):
        for page, start, program in (("docs/gpu.md", "for (int step = 0", "tests/gpu/example_contacts.cu"),
                                     ("docs/contacts.md", "manifolds.rows()", "tests/consumer/game_loop.cpp"),
                                     ("docs/c_gpu.md", "tandem_gpu_broad_phase_find(", "tests/c/gpu_contacts.c")):
            shown = [block for block in re.findall(r"^```c(?:pp)?\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL) if start in block]
            self.assertEqual(len(shown), 1, page)
            lines = "\n".join(line.strip() for line in (ROOT / program).read_text(encoding="utf-8").splitlines())
            self.assertIn("\n".join(line.strip() for line in shown[0].splitlines()), lines)


class IncludesTest(unittest.TestCase):
    def setUp(self):
        page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8").partition("## What belongs where")[2]
        rows = re.findall(r"^\| (`[^|]+`) \| ([^|]+) \|", page, re.MULTILINE)
        self.allowed = {folder: {name.strip("` ") for name in includes.split(",")} for folders, includes in rows for folder in re.findall("`([^`]+)`", folders)}

    def folder_of(self, path):
        """The row of a source file: its longest folder that has one."""
        return max((folder for folder in self.allowed if path.startswith(folder)), key=len, default=None)

    def included(self, name):
        """The row or the library of an include path; None for the system's."""
        first, second, *_ = name.split("/")
        if name in ("tandem/tandem.h", "tandem/tandem_cuda.h"):
            return "bindings/c/"
        if name.startswith("tandem/build/"):
            return "tools/bvhbuild/include/"
        if first == "tandem":
            return second + "/"
        if first == "kernels":
            return self.folder_of(name)
        return LIBRARIES[first] if first in LIBRARIES else self.folder_of(f"tools/{name}")

    def test_every_folder_includes_what_its_row_says(self):
        used = {folder: set() for folder in self.allowed}
        for path in (path for path in FILES if path.suffix in (".h", ".cpp", ".cu", ".cuh")):
            folder = self.folder_of(path.relative_to(ROOT).as_posix())
            if folder:
                used[folder] |= {self.included(name) for name in INCLUDE.findall(path.read_text(encoding="utf-8"))} - {folder, None}
        for folder, names in used.items():
            with self.subTest(folder=folder):
                self.assertEqual(names - self.allowed[folder], set())


if __name__ == "__main__":
    unittest.main()
