#!/usr/bin/python3
"""Builds a tree of every mesh of a corpus of good and nasty files, and holds each against what must come out of it.

The corpus is a folder with an INDEX.tsv whose columns `file` and `triangles` say what is in it: TANDEM_MESHES, else
../shared/meshes beside the sources. Without one the test is skipped (exit code 77).
Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO (the binaries), TANDEM_SOURCE_DIR.
"""
import csv
import dataclasses
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import unittest

import bvh_file
from tool_test import BVHBUILD, DONE, NO_TRIANGLE, SOURCE_DIR, UNREADABLE_INPUT, ToolTest

MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
SKIPPED = 77
MOST_SECONDS = 10
MOST_BYTES = 1 << 30

# This must come out of the meshes: triangles of the tree (-1: it cannot be read), what the message says where there is no tree, counts that the report
# must show, and why the triangles are not those of the index, where they are not.
with open(SOURCE_DIR / "tests/meshing/shared_meshes.csv", encoding="utf-8", newline="") as table:
    EXPECTED = {row["file"]: row | {"triangles": int(row["triangles"])} for row in csv.DictReader(table)}
FINDINGS = {name: {key: int(count) for key, count in (pair.split("=") for pair in row["findings"].split(";"))}
            for name, row in EXPECTED.items() if row["findings"]}


def failure_of(name):
    """Exit code and a word of the message, or DONE."""
    row = EXPECTED.get(name, {"triangles": 1, "message": ""})
    return {-1: UNREADABLE_INPUT, 0: NO_TRIANGLE}.get(row["triangles"], DONE), row["message"]


@dataclasses.dataclass
class Run:
    code: int
    report: dict
    message: str


def index():
    """The names of the meshes and their triangles, None where the index does not know."""
    with open(MESHES / "INDEX.tsv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
    return {row["file"]: int(row["triangles"]) if row["triangles"].isdigit() else None
            for row in rows if row["format"] != "glTF buffer"}


class Corpus(ToolTest):
    def measured_build(self, name, *arguments):
        """Runs bvhbuild and checks what holds for every file: no crash, no hang, no hunger."""
        streams = [open(self.root / stream, "w+b") for stream in ("stdout", "stderr")]
        process = subprocess.Popen([BVHBUILD, MESHES / name, "-o", self.out, "--json", *arguments], stdout=streams[0],
                                   stderr=streams[1])
        killer = threading.Timer(MOST_SECONDS, process.send_signal, [signal.SIGKILL])
        killer.start()
        _, status, usage = os.wait4(process.pid, 0)
        killer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in streams:
            stream.seek(0)
            texts.append(stream.read().decode())
            stream.close()
        self.assertNotEqual(process.returncode, -signal.SIGKILL, f"took more than {MOST_SECONDS} s")
        self.assertIn(process.returncode, (DONE, UNREADABLE_INPUT, NO_TRIANGLE), texts[1])
        self.assertLess(usage.ru_maxrss * 1024, MOST_BYTES)
        return Run(process.returncode, json.loads(texts[0]), texts[1])

    def assert_sound_output(self, minimal=True):
        self.assertEqual(os.listdir(self.outputs), [self.out.name])
        self.assertEqual(self.info("--verify", self.out).returncode, DONE)
        info = json.loads(self.info("--json", self.out).stdout)
        self.assertEqual(info["partial_leaf_blocks"], 0)
        self.assertEqual(info["leaf_nodes"], info["triangles"])
        if minimal:
            self.assertEqual(info["imaginary_nodes"], info["imaginary_minimum"])
        self.assertEqual(bvh_file.defects_of_topology(bvh_file.read(self.out)), [])
        self.assertGreaterEqual(info["imaginary_nodes"], info["imaginary_minimum"])
        self.out.unlink()
        return info

    def assert_refused(self, run, name):
        self.assertEqual(run.message, f"bvhbuild: {run.report['error']}\n")
        self.assertIn(name, run.message)
        self.assert_nothing_written()

    def test_every_file_of_the_index_is_there(self):
        for name in [*index(), *EXPECTED]:
            self.assertTrue((MESHES / name).is_file(), name)
            self.assertIn(name, index())

    def test_every_file_gives_the_right_tree_or_the_right_message(self):
        for name, triangles in index().items():
            with self.subTest(file=name):
                run = self.measured_build(name)
                code, word = failure_of(name)
                self.assertEqual(run.code, code, run.message)
                if code == DONE:
                    self.assertEqual(run.message, "")
                    row = EXPECTED.get(name, {"triangles": triangles, "differs": ""})
                    self.assertEqual(self.assert_sound_output()["triangles"], row["triangles"])
                    self.assertEqual(row["triangles"] != triangles, row["differs"] != "")
                    for key, count in FINDINGS.get(name, {}).items():
                        self.assertEqual(run.report["findings"][key], count, key)
                else:
                    self.assert_refused(run, name)
                    self.assertIn(word, run.message)

    def test_assimp_never_takes_the_tool_along(self):
        for name in index():
            with self.subTest(file=name):
                run = self.measured_build(name, "--reader", "assimp", "--time-limit", "5")
                if run.code == DONE:
                    self.assertIn("assimp", run.report["reader"])
                    self.assert_sound_output()
                else:
                    self.assert_refused(run, name)

    def test_free_trees_are_sound_too(self):
        for name in ("teapot.obj", "Star_ascii.stl", "CesiumMilkTruck.glb", "elephant.ply", "w_duplicates.obj",
                     "w_huge_coords.stl", "w_degenerate.obj"):
            with self.subTest(file=name):
                self.assertEqual(self.measured_build(name, "--imaginary", "free").code, DONE)
                self.assert_sound_output(minimal=False)

    def test_strict_refuses_what_has_defects_and_nothing_else(self):
        for name in [*FINDINGS, "cow.obj", "dodecahedron_poly.obj", "link5.stl", "elephant.ply", "ballA.off"]:
            with self.subTest(file=name):
                run = self.measured_build(name, "--strict")
                self.assertEqual(run.code, UNREADABLE_INPUT if name in FINDINGS else DONE, run.message)
                if name in FINDINGS:
                    self.assert_refused(run, name)
                    self.assertIn("--strict", run.message)
                else:
                    self.assert_sound_output()


if __name__ == "__main__":
    if not (MESHES / "INDEX.tsv").is_file():
        print(f"SKIPPED: there is no corpus of meshes in {MESHES} (set TANDEM_MESHES)")
        sys.exit(SKIPPED)
    unittest.main()
