#!/usr/bin/python3
"""bvhinfo of files with levels of detail: side by side, and their error bounds proved anew.

Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO (the binaries), TANDEM_SOURCE_DIR.
"""
import json
import math
import unittest

import bvh_file
import numpy as np

from tool_test import CUBE_OBJ, DONE, UNREADABLE_INPUT, USAGE, ToolTest


def hills(cells):
    """A height field, its border at height 0, as OBJ."""
    text = ""
    for i in range(cells + 1):
        for j in range(cells + 1):
            x, y = i / cells, j / cells
            height = 0.3 * math.sin(9 * x * y + x) * x * (1 - x) * y * (1 - y) + 0.02 * math.sin(40 * x) * math.sin(3 * math.pi * y)
            text += f"v {x} {y} {height}\n"
    for i in range(cells):
        for j in range(cells):
            a, b = i * (cells + 1) + j + 1, (i + 1) * (cells + 1) + j + 1
            text += f"f {a} {b} {b + 1} {a + 1}\n"
    return text


def with_error_bound(path, level, bound):
    """The .bvh file, another error bound written in, its hash right."""
    raw = bytearray(path.read_bytes())
    *_, section_count, _, _ = bvh_file.HEADER.unpack_from(raw)
    for i in range(section_count):
        kind, _, offset, _, count = bvh_file.SECTION.unpack_from(raw, bvh_file.HEADER.size + i * bvh_file.SECTION.size)
        if bvh_file.KINDS[kind][0] == "levels":
            np.frombuffer(raw, bvh_file.LEVEL, count, offset)["error_bound"][level] = bound
    raw[8:16] = bvh_file.xxh64(bytes(raw[16:])).to_bytes(8, "little")
    path.write_bytes(raw)
    return path


class InfoOfLevels(ToolTest):
    LEVEL_KEYS = {"triangles", "blocks", "depth", "bytes", "error_bound", "error_bound_relative", "closed",
                  "expected_block_pairs", "expected_candidates", "expected_oriented_block_pairs",
                  "expected_oriented_candidates"}
    CHECK_KEYS = {"level", "status", "triangles", "error_bound", "distance_lower", "distance_upper"}

    def setUp(self):
        super().setUp()
        self.file = self.built("hills.obj", hills(24), "--levels", "0.3%,2%")
        self.bounds = [float(bound) for bound in bvh_file.read(self.file).levels["error_bound"]]
        self.assertEqual(len(self.bounds), 3)

    def json_of(self, *arguments):
        return json.loads(self.info("--json", *arguments).stdout)

    def test_levels_are_shown_side_by_side(self):
        info = self.json_of(self.file)
        for level in info["levels"]:
            self.assertEqual(set(level), self.LEVEL_KEYS)
        finest, *coarser = info["levels"]
        for key in ("triangles", "depth", "expected_block_pairs", "expected_oriented_candidates"):
            self.assertEqual(finest[key], info[key])
        counts = [level["triangles"] for level in info["levels"]]
        self.assertEqual(counts, sorted(counts, reverse=True))
        bounds = info["bounds"]
        diagonal = math.dist(bounds["lower"], bounds["upper"])
        for level, bound in zip(coarser, self.bounds[1:]):
            self.assertEqual(level["error_bound"], bound)
            self.assertAlmostEqual(level["error_bound_relative"], bound / diagonal, 12)
            self.assertFalse(level["closed"])
            self.assertNotEqual(level["expected_block_pairs"], finest["expected_block_pairs"])
        for i, level in enumerate(info["levels"]):
            kinds = bvh_file.OF_A_LEVEL
            self.assertEqual(level["bytes"], sum(s["bytes"] for s in info["sections"] if s["level"] == i and s["kind"] in kinds))
        page = self.info(self.file).stdout.decode()
        self.assertIn("  levels       triangles", page)
        for count in counts:
            self.assertIn(f" {count:,} ", page)

    def test_a_closed_level_is_said_to_be_closed_and_one_without_topology_is_not_judged(self):
        closed = self.json_of(self.built("cube.obj", CUBE_OBJ))["levels"]
        unknown = self.json_of(self.built("cube.obj", CUBE_OBJ, "--no-topology"))["levels"]
        self.assertEqual([closed[0]["closed"], unknown[0]["closed"]], [True, None])
        self.assertNotIn(b"  levels       triangles", self.info(self.built("cube.obj", CUBE_OBJ)).stdout)

    def test_error_bounds_that_hold_are_proved(self):
        result = self.info("--verify", "--levels", self.file)
        self.assertEqual((result.returncode, result.stderr), (DONE, b""))
        self.assertIn(f"{self.file}: sound", result.stdout.decode())
        verdict = self.json_of("--verify", "--levels", self.file)
        self.assertEqual((verdict["sound"], verdict["status"], verdict["where"]), (True, "Ok", None))
        self.assertEqual([check["level"] for check in verdict["levels"]], [1, 2])
        for check, bound in zip(verdict["levels"], self.bounds[1:]):
            self.assertEqual(set(check), self.CHECK_KEYS)
            self.assertEqual((check["status"], check["error_bound"]), ("Ok", bound))
            self.assertLessEqual(check["distance_lower"], check["distance_upper"])
            self.assertLessEqual(check["distance_upper"], bound)
            self.assertGreater(check["distance_lower"], bound / 1.05)

    def test_a_bound_that_is_too_small_is_found(self):
        for level, factor in ((1, 0.99), (1, 0), (2, 0.99)):
            with self.subTest(level=level, factor=factor):
                bad = with_error_bound(self.built("hills.obj", hills(24), "--levels", "0.3%,2%"), level,
                                       factor * self.bounds[level])
                self.assertEqual(self.info("--verify", bad).returncode, DONE)  # the checker can't know
                result = self.info("--verify", "--levels", bad)
                self.assert_fails(result, UNREADABLE_INPUT, bad, "ErrorBoundTooSmall", f"level {level}",
                                  f"{factor * self.bounds[level]:.12g}")
                verdict = self.json_of("--verify", "--levels", bad)
                self.assertEqual((verdict["sound"], verdict["status"], verdict["where"], verdict["bytes"]),
                                 (False, "ErrorBoundTooSmall", level, None))
                statuses = ["Ok", "Ok"]
                statuses[level - 1] = "ErrorBoundTooSmall"
                self.assertEqual([check["status"] for check in verdict["levels"]], statuses)
                self.assertGreater(verdict["levels"][level - 1]["distance_lower"], factor * self.bounds[level])
                self.assertIn(f"{verdict['levels'][level - 1]['distance_lower']:.12g}", verdict["error"])

    def test_a_bound_that_is_too_large_holds(self):
        large = with_error_bound(self.file, 2, 7 * self.bounds[2])
        self.assertEqual(self.info("--verify", "--levels", large).returncode, DONE)
        check = self.json_of("--verify", "--levels", large)["levels"][1]
        self.assertEqual(check["status"], "Ok")
        self.assertLessEqual(check["distance_upper"], self.bounds[2])

    def test_a_file_of_one_level_has_nothing_to_prove(self):
        verdict = self.json_of("--verify", "--levels", self.built("cube.obj", CUBE_OBJ))
        self.assertEqual((verdict["sound"], verdict["levels"]), (True, []))

    def test_a_file_that_the_checker_refuses_has_no_levels(self):
        cut = self.write("cut.bvh", self.file.read_bytes()[:-1])
        self.assert_fails(self.info("--verify", "--levels", cut), UNREADABLE_INPUT, cut, "Truncated")
        self.assertNotIn("levels", self.json_of("--verify", "--levels", cut))

    def test_levels_are_an_option_of_verify(self):
        self.assertEqual(self.info("--levels", self.file).returncode, USAGE)


if __name__ == "__main__":
    unittest.main()
