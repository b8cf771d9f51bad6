#!/usr/bin/python3
"""Tests of scripts/release on the kinds of files that take no compiler's time. It works in a clone, so that this checkout stays as it is.

Exit code 77: this is no git checkout, or git is not here."""
import hashlib
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["TANDEM_SOURCE_DIR"])


class ReleaseTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "a clone"
        cls.git("clone", "--quiet", "--no-local", "--depth", "1", SOURCE, cls.folder)
        said = (cls.folder / "CMakeLists.txt").read_text(encoding="utf-8")
        cls.version = said.partition("project(tandem VERSION ")[2].partition(" ")[0]

    @staticmethod
    def git(*words, **options):
        return subprocess.run(["git", *map(str, words)], check=True, text=True, stdout=subprocess.PIPE, **options).stdout

    def release(self, *words):
        return subprocess.run([self.folder / "scripts/release", *words], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def test_the_same_bytes_come_twice_and_recipes_name_them(self):
        done = self.release(self.version, "--only", "source", "recipes", "--check", "--url", "https://localhost/there")
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("Twice the same bytes.", done.stdout)
        files = self.folder / "build/dist"
        archive = files / f"tandem-{self.version}.tar.xz"
        listed = dict(reversed(line.split("  ")) for line in (files / "SHA256SUMS").read_text().splitlines())
        self.assertEqual(set(listed), {path.name for path in files.iterdir()} - {"SHA256SUMS"})
        self.assertEqual(listed[archive.name], hashlib.sha256(archive.read_bytes()).hexdigest())
        with tarfile.open(archive) as members:
            names = {member.name.partition("/")[2] for member in members if not member.isdir()}
        self.assertEqual(names, set(self.git("ls-files", "-z", cwd=self.folder).split("\0")) - {""})
        with tarfile.open(files / f"tandem-{self.version}-recipes.tar.xz") as members:
            texts = {member.name: members.extractfile(member).read().decode() for member in members if member.isfile()}
        self.assertEqual([name for name, text in texts.items() if "@VERSION@" in text or "@URL@" in text or "@SHA" in text], [])
        self.assertIn(listed[archive.name], texts["recipes/conan/conandata.yml"])
        self.assertIn(listed[archive.name], texts["recipes/conda/recipe.yaml"])
        self.assertIn(hashlib.sha512(archive.read_bytes()).hexdigest(), texts["recipes/vcpkg/portfile.cmake"])
        self.assertEqual(json.loads(texts["recipes/vcpkg/vcpkg.json"])["version"], self.version)
        self.assertIn(f"https://localhost/there/{archive.name}", texts["recipes/vcpkg/portfile.cmake"])

    def test_refuses_another_version(self):
        done = self.release("99.0.0", "--only", "source")
        self.assertEqual((done.returncode, done.stdout), (2, f"release: the project's version is {self.version}, not 99.0.0: change it in CMakeLists.txt\n"))

    def test_refuses_changed_files(self):
        extra = self.folder / "extra.txt"
        extra.touch()
        self.addCleanup(extra.unlink)
        done = self.release(self.version, "--only", "source")
        self.assertEqual((done.returncode, done.stdout), (2, "release: 1 files differ from the commit, such as extra.txt\n"))

    def test_refuses_a_version_that_the_changelog_does_not_have(self):
        changes = self.folder / "CHANGELOG.md"
        text = changes.read_text(encoding="utf-8")
        self.addCleanup(changes.write_text, text, encoding="utf-8")
        changes.write_text(text.replace(f"## {self.version}", "## Later"), encoding="utf-8")
        done = self.release(self.version, "--only", "source")
        self.assertEqual((done.returncode, done.stdout), (2, f"release: CHANGELOG.md has no section {self.version}\n"))


if __name__ == "__main__":
    if subprocess.run(["git", "-C", SOURCE, "rev-parse"], capture_output=True).returncode != 0:
        print("skipped: not a git checkout")
        sys.exit(77)
    unittest.main(verbosity=2)
