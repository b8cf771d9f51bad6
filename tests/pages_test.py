#!/usr/bin/python3
"""Tests of the parts of scripts/site that need neither the generator nor a browser. Environment: PYTHONPATH with scripts/, and TANDEM_BVHBUILD and its like, the programs."""
import re
import tempfile
import unittest
from pathlib import Path

from common import tools
from pages import check_links, commands, python_names, sources

ROOT = Path(__file__).resolve().parent.parent


def apart(text):
    return "\n".join(line for line, _ in sources.set_apart(text.split("\n")))


class SetApart(unittest.TestCase):
    def test_a_list_or_a_table_follows_an_empty_line(self):
        self.assertEqual(apart("These:\n- a\n- b"), "These:\n\n- a\n- b")
        self.assertEqual(apart("These:\n| a |\n|---|"), "These:\n\n| a |\n|---|")
        self.assertEqual(apart("| 1 |\n<!-- end -->"), "| 1 |\n\n<!-- end -->")

    def test_what_belongs_to_an_item_stands_four_spaces_in(self):
        self.assertEqual(apart("1. a\n   - b\n\n   more\n2. c"), "1. a\n    - b\n\n    more\n\n2. c")
        self.assertEqual(apart("- a\n\n  ```\n  - code\n  ```\n- b"), "- a\n\n    ```\n    - code\n    ```\n\n- b")

    def test_code_is_left_alone(self):
        for code in ("```\nx\n- y\n| z\n```", "a\n\n    - y\n    - z"):
            self.assertEqual(apart(code), code)


class Links(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        for path, text in {"docs/concepts.md": "# First\n", "docs/decisions/trees.md": "", "kernels/x.h": "int x;\n", "docs/images/p.png": "", "docs/images/p.svg": ""}.items():
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            (self.root / path).write_text(text)
        self.site = sources.Site(self.root, {"kernels/y.h": "reference/y.md"})

    def linked(self, text):
        return self.site.with_links("docs/decisions/trees.md", "decisions/trees.md", text)

    def test_links_lead_to_places_of_the_site(self):
        for before, after in (("[w](../concepts.md#first)", "[w](../concepts.md#first)"), ("[concepts.md](../concepts.md)", "[First](../concepts.md)"), ("[concepts.md](../concepts.md#first)", "[First](../concepts.md#first)"), ("[w](../../README.md)", "[w](../index.md)"),
                              ("[w](../../kernels/x.h)", "[w](../source/kernels/x.h.md)"), ("[w](../../kernels)", "w"), ("`[w](../../kernels)`", "`[w](../../kernels)`"),
                              ('<img src="../images/p.png">', '<img src="../images/p.svg">'), ("[w](https://example.org)", "[w](https://example.org)")):
            with self.subTest(link=before):
                if "README" in before:
                    (self.root / "README.md").write_text("")
                self.assertEqual(self.linked(before), after)
        self.assertEqual(self.site.missing, [])
        self.assertEqual(self.site.sources, {"kernels/x.h"})

    def test_a_link_to_nothing_is_named(self):
        self.linked("[w](../gone.md)")
        self.assertEqual(self.site.missing[0], "docs/decisions/trees.md: ../gone.md")


class Defects(unittest.TestCase):
    def defects(self, body):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "other.html").write_text('<p id="there">x</p>')
            (Path(folder) / "page.html").write_text(body)
            return check_links.defects(Path(folder))

    def test_a_sound_page_has_none(self):
        self.assertEqual(self.defects('<a href="other.html#there">x</a><a href="https://example.org">y</a><a href="#z"></a><p id="z">a|b</p><img src="other.html" alt="w">'), [])

    def test_each_defect_is_named(self):
        for body, words in (('<a href="gone.html">x</a>', "leads nowhere: gone.html"), ('<a href="other.html#gone">x</a>', "no such place: other.html#gone"),
                            ('<script src="https://example.org/x.js"></script>', "loads https://example.org/x.js"), ('<img src="other.html">', "a picture without words"),
                            ('<a href=".">x</a>', "leads to a folder"), ("<p>These:\n- a\n- b</p>", "Markdown is left"), ("<p>x\n| a | b |\n|---|---|</p>", "Markdown is left")):
            with self.subTest(body=body):
                found = self.defects(body)
                self.assertEqual(len(found), 1)
                self.assertIn(words, found[0])


class PythonNames(unittest.TestCase):
    def test_every_public_name_has_a_page(self):
        pages = python_names.pages(ROOT / "bindings/python/tandem")
        self.assertIn("::: tandem.Scene\n", pages["reference/python/scenes.md"])
        self.assertIn("`normal`: float64 × 3", pages["reference/python/rows.md"])

    def test_a_name_without_a_page_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            for file in ("_rows.py", "_scene.py"):
                (Path(folder) / file).write_text("")
            (Path(folder) / "__init__.py").write_text('__all__ = ["nobody_knows"]\n')
            with self.assertRaisesRegex(ValueError, "nobody_knows"):
                python_names.pages(Path(folder))


class Commands(unittest.TestCase):
    HELP = {(): "answers questions\nUsage: tool [OPTIONS] SUBCOMMAND\n\nOptions:\n  -h,--help                   prints this\n\nSubcommands:\n  ask                         asks <one>\n\nExit codes: 0 done",
            ("ask",): "asks one question\nUsage: tool ask [OPTIONS] FILE\n\nPositionals:\n  FILE                        what to read\n\nOptions:\n  -h,--help                   prints this\n"
                      "  --number N [1]              how often\n  --lone Excludes: --number --memory\n                              alone\n  --a-very-long-name-of-an-option FILE\n                              a meaning\n                              of two lines\n[Option Group: limit]\n   \n  [Exactly 1 of these]\n  Options:\n    --memory BYTES_OF_THE_WHOLE of it all\n\nExit codes: 0 done"}

    def test_a_section_has_usage_arguments_and_options(self):
        parts = list(commands.sections(lambda *words: self.HELP[words[1:]], "tool"))
        self.assertEqual(len(parts), 2)
        self.assertTrue(parts[0].startswith("## tool\n\nAnswers questions.\n"))
        self.assertIn("- [`ask`](#tool-ask): asks \\<one\\>\n", parts[0])
        self.assertEqual(parts[1], "### tool ask\n\nAsks one question.\n\n```\ntool ask [OPTIONS] FILE\n```\n\nArguments:\n\n- `FILE`: what to read\n\n"
                                   "#### `--number N [1]` {#tool-ask-number .option}\n\nhow often\n\n#### `--lone` {#tool-ask-lone .option}\n\nalone (not with --number, --memory)\n\n"
                                   "#### `--a-very-long-name-of-an-option FILE` {#tool-ask-a-very-long-name-of-an-option .option}\n\na meaning of two lines\n\n"
                                   "Exactly 1 of these.\n\n#### `--memory BYTES_OF_THE_WHOLE` {#tool-ask-memory .option}\n\nof it all\n")

    def test_every_option_of_the_programs_has_a_row(self):
        asked = {}

        def help_of(*words):
            asked[words] = tools.run(tools.tool(words[0]), *words[1:], "--help")
            return asked[words]

        page = commands.page(help_of)
        self.assertGreater(len(asked), 15)
        sections = dict(zip(asked, re.split(r"^#{2,3} (?=bvh)", page, flags=re.MULTILINE)[1:], strict=True))
        for words, text in asked.items():
            self.assertTrue(sections[words].startswith(" ".join(words) + "\n"), words)
            for option in re.findall(r"^ +(?:-\w,)?(--[\w-]+)", text, re.MULTILINE):
                if option != "--help":
                    self.assertRegex(sections[words], rf"(?m)^#### `(?:-\w,)?{option}\b", words)


if __name__ == "__main__":
    unittest.main()
