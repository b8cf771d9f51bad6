#!/usr/bin/python3
"""bvhinfo from the outside: its page and its JSON, several files, files that are not there or are wrong. Levels side by side, and their error
bounds proved anew.

Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO (the binaries), TANDEM_SOURCE_DIR.
"""
import json
import math
import os
import unittest

import bvh_file
import numpy as np

from tool_test import CUBE_OBJ, DONE, TRIANGLE_OBJ, UNREADABLE_INPUT, USAGE, ToolTest, obj, sheet


class Info(ToolTest):
    KEYS = {"file", "version", "hash", "bytes", "triangles", "nodes", "leaf_nodes", "internal_nodes", "imaginary_nodes",
            "imaginary_minimum", "imaginary_fraction", "leaf_blocks", "internal_blocks", "partial_leaf_blocks", "depth",
            "leaf_fill", "sah_cost", "expected_block_pairs", "expected_candidates", "expected_oriented_block_pairs",
            "expected_oriented_candidates", "surface", "leaf_blocks_at_depth",
            "blocks_with_fill", "bounds", "origin", "rounding_error", "source_faces", "source_vertices", "source", "parts", "levels",
            "sections"}
    VERDICT_KEYS = {"file", "sound", "status", "where", "error", "bytes", "check_seconds"}

    def test_the_page_shows_what_people_look_for(self):
        page = self.info(self.built("cube.obj", CUBE_OBJ))
        self.assertEqual((page.returncode, page.stderr), (DONE, b""))
        for word in ("cube.obj", "triangles    12", "1 imaginary", "minimum 1", "0 partial leaf blocks", "depth", "SAH cost",
                     "block pairs", "oriented block pairs", "oriented_blocks", "8 vertices, 1 component, closed", "topology",
                     "components", "source_vertices", "8 source vertices", "bounds", "origin", "sections", "provenance"):
            self.assertIn(word, page.stdout.decode())

    def test_the_page_sends_no_control_characters_of_a_file_to_a_terminal(self):
        page = self.info(self.built("red\x1b[31m\x07.obj", "o part\x1b[2J\n" + CUBE_OBJ)).stdout
        self.assertIn("red\ufffd[31m\ufffd.obj", page.decode())
        self.assertNotIn(b"\x1b", page)
        self.assertNotIn(b"\x07", page)

    def test_the_page_says_how_the_tree_was_built_and_nothing_of_interrupts_where_there_was_none(self):
        page = self.info(self.built("cube.obj", CUBE_OBJ, "--imaginary", "free", "--effort", "fast")).stdout
        self.assertIn(b", imaginary nodes free, effort fast\n", page)

    def test_the_page_tells_parts_of_one_face_many_and_none(self):
        mesh = "o one\n" + TRIANGLE_OBJ + "o two\nf 1 2 3\no many\nf 1 2 3\n"
        page = self.info(changed(self.built("a.obj", mesh), empty_second_part)).stdout
        for line in (b"one  face 0\n", b"(no name)  no faces\n", b"many  faces 1 to 2\n"):
            self.assertIn(line, page)

    def test_json_of_one_file_is_an_object_with_all_keys(self):
        info = self.info_json(self.built("cube.obj", CUBE_OBJ))
        self.assertEqual(set(info), self.KEYS)
        self.assertEqual((info["triangles"], info["imaginary_nodes"], info["partial_leaf_blocks"]), (12, 1, 0))
        self.assertEqual(info["bounds"], {"lower": [0, 0, 0], "upper": [1, 1, 1]})
        self.assertEqual(info["source"]["input"]["file"], "cube.obj")

    def test_json_of_two_files_is_an_array(self):
        out = self.built("cube.obj", CUBE_OBJ)
        pair = self.info_json(out, out)
        self.assertEqual([info["triangles"] for info in pair], [12, 12])

    def test_two_files_are_set_side_by_side(self):
        a = self.built("cube.obj", CUBE_OBJ).rename(self.outputs / "a.bvh")
        b = self.built("cube.obj", CUBE_OBJ, "--imaginary", "free").rename(self.outputs / "b.bvh")
        table = self.info(a, b)
        self.assertEqual(table.returncode, DONE)
        rows = {line.split()[0]: line.split()[1:] for line in table.stdout.decode().splitlines()}
        self.assertEqual(rows["a.bvh"], ["b.bvh"])
        self.assertEqual(rows["triangles"], ["12", "12", "x1.000"])
        counts = [info["imaginary_nodes"] for info in self.info_json(a, b)]
        self.assertEqual(rows["imaginary_nodes"][:2], [str(count) for count in counts])

    def test_a_file_without_oriented_blocks_says_so(self):
        a = self.built("cube.obj", CUBE_OBJ).rename(self.outputs / "a.bvh")
        b = self.built("cube.obj", CUBE_OBJ, "--no-gpu-blocks").rename(self.outputs / "b.bvh")
        with_them, without = self.info_json(a, b)
        self.assertGreaterEqual(with_them["expected_oriented_block_pairs"], 1)
        self.assertEqual(without["expected_block_pairs"], with_them["expected_block_pairs"])
        for key in ("expected_oriented_block_pairs", "expected_oriented_candidates"):
            self.assertIsNone(without[key])
        self.assertIn(b"no oriented blocks", self.info(b).stdout)
        self.assertNotIn(b"no oriented blocks", self.info(a).stdout)
        rows = {line.split()[0]: line.split()[1:] for line in self.info(a, b).stdout.decode().splitlines()}
        self.assertEqual(rows["expected_oriented_block_pairs"][1:], ["-"])

    def test_the_surface_is_described_and_one_without_topology_is_told(self):
        turned = CUBE_OBJ.splitlines()
        face = next(i for i, line in enumerate(turned) if line.startswith("f"))
        words = turned[face].split()
        turned[face] = " ".join([words[0], *words[:0:-1]])
        a = self.built("cube.obj", "\n".join(turned) + "\n").rename(self.outputs / "a.bvh")
        b = self.built("cube.obj", CUBE_OBJ, "--no-topology").rename(self.outputs / "b.bvh")
        c = self.built("one.obj", TRIANGLE_OBJ).rename(self.outputs / "c.bvh")
        with_it, without, one = self.info_json(a, b, c)
        self.assertEqual(with_it["surface"], {"vertices": 8, "components": 1, "closed_components": 1, "turned_triangles": 2,
                                              "boundary_edges": 0, "sides_at_edges_of_many": 0})
        self.assertEqual((one["surface"]["boundary_edges"], one["surface"]["closed_components"]), (3, 0))
        self.assertIsNone(without["surface"])
        self.assertIn(b"no topology", self.info(b).stdout)
        self.assertIn(b"2 triangles taken to be wound the other way", self.info(a).stdout)

    def test_verify_says_that_a_file_is_sound(self):
        out = self.built("cube.obj", CUBE_OBJ)
        result = self.info("--verify", out)
        self.assertEqual(result.returncode, DONE)
        self.assertIn(f"{out}: sound", result.stdout.decode())
        verdict = self.info_json("--verify", out)
        self.assertEqual(set(verdict), self.VERDICT_KEYS)
        self.assertEqual((verdict["sound"], verdict["status"], verdict["error"]), (True, "Ok", None))

    def damaged(self):
        whole = self.built("cube.obj", CUBE_OBJ).read_bytes()
        flipped = bytearray(whole)
        flipped[-700] ^= 1
        return {"Truncated": whole[:-1], "TrailingBytes": whole + b"\0", "ContentChanged": bytes(flipped),
                "NotTandem": b"solid cube\n", "BiovisionMotionCapture": b"HIERARCHY\nROOT Hips\n",
                "DamagedByTextTransfer": whole[:4] + whole[4:].replace(b"\r\n", b"\n"),
                "UnsupportedVersion": whole[:20] + b"\2\0" + whole[22:],
                "WrongByteOrder": whole[:16] + b"\1\2\3\4" + whole[20:]}

    def test_a_file_that_is_not_sound_is_refused_by_the_name_of_its_defect(self):
        for status, content in self.damaged().items():
            for option in ([], ["--verify"]):
                with self.subTest(status=status, option=option):
                    path = self.write(f"{status}.bvh", content)
                    self.assert_fails(self.info(path, *option), UNREADABLE_INPUT, path, status)
                    result = self.info(path, "--json", *option)
                    verdict = json.loads(result.stdout)
                    self.assertEqual(result.returncode, UNREADABLE_INPUT)
                    self.assertEqual(set(verdict), self.VERDICT_KEYS)
                    self.assertEqual((verdict["sound"], verdict["status"]), (False, status))
                    self.assertEqual(result.stderr.decode(), f"bvhinfo: {verdict['error']}\n")

    def test_a_bad_file_beside_a_good_one_is_told(self):
        out, missing = self.built("cube.obj", CUBE_OBJ), self.inputs / "none.bvh"
        for files, words in (((out, missing), ["triangles    12"]), ((out, missing, out), ["triangles", "x1.000"])):
            result = self.info(*files)
            self.assertEqual(result.returncode, UNREADABLE_INPUT)
            self.assertEqual(result.stderr.decode(), f"bvhinfo: {missing}: no such file (FileNotFound)\n")
            for word in words:
                self.assertIn(word, result.stdout.decode())
        sound = [verdict["sound"] for verdict in self.info_json("--verify", out, missing)]
        self.assertEqual(sound, [True, False])

    def test_folders_pipes_and_empty_files_are_refused(self):
        os.mkfifo(self.inputs / "pipe.bvh")
        self.assert_fails(self.info(self.inputs / "pipe.bvh"), UNREADABLE_INPUT, "not a regular file")
        self.assert_fails(self.info(self.inputs), UNREADABLE_INPUT, "not a regular file")
        self.assert_fails(self.info(self.write("empty.bvh", b"")), UNREADABLE_INPUT, "not a Tandem .bvh file")


def changed(path, change):
    """The .bvh file after change(its tables by name, as arrays that can be written to), its hash right."""
    raw = bytearray(path.read_bytes())
    *_, section_count, _, _, _ = bvh_file.HEADER.unpack_from(raw)
    tables = {}
    for i in range(section_count):
        kind, _, offset, _, count = bvh_file.SECTION.unpack_from(raw, bvh_file.HEADER.size + i * bvh_file.SECTION.size)
        name, row = bvh_file.KINDS[kind]
        tables[name] = np.frombuffer(raw, row, count, offset)
    change(tables)
    raw[8:16] = bvh_file.xxh64(bytes(raw[16:])).to_bytes(8, "little")
    path.write_bytes(raw)
    return path


def empty_second_part(tables):
    """Takes name and faces from the second part: other tools may write such parts."""
    parts, part_of = tables["parts"], tables["triangles"]["corner"]["w"][:, 1]
    parts["first_face"][2] -= parts["face_count"][1]
    parts["face_count"][2] += parts["face_count"][1]
    parts["face_count"][1] = parts["name_bytes"][1] = 0
    part_of[part_of == 1] = 2


def hills(cells):
    """A height field, its border at height 0, as OBJ."""
    return obj(*sheet(cells, lambda x, y: 0.3 * np.sin(9 * x * y + x) * x * (1 - x) * y * (1 - y) + 0.02 * np.sin(40 * x) * np.sin(3 * np.pi * y)))


def with_error_bound(path, level, bound):
    def change(tables):
        tables["levels"]["error_bound"][level] = bound
    return changed(path, change)


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

    def test_levels_are_shown_side_by_side(self):
        info = self.info_json(self.file)
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
        closed = self.info_json(self.built("cube.obj", CUBE_OBJ))["levels"]
        unknown = self.info_json(self.built("cube.obj", CUBE_OBJ, "--no-topology"))["levels"]
        self.assertEqual([closed[0]["closed"], unknown[0]["closed"]], [True, None])
        self.assertNotIn(b"  levels       triangles", self.info(self.built("cube.obj", CUBE_OBJ)).stdout)

    def test_error_bounds_that_hold_are_proved(self):
        result = self.info("--verify", "--levels", self.file)
        self.assertEqual((result.returncode, result.stderr), (DONE, b""))
        self.assertIn(f"{self.file}: sound", result.stdout.decode())
        verdict = self.info_json("--verify", "--levels", self.file)
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
                verdict = self.info_json("--verify", "--levels", bad)
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
        check = self.info_json("--verify", "--levels", large)["levels"][1]
        self.assertEqual(check["status"], "Ok")
        self.assertLessEqual(check["distance_upper"], self.bounds[2])

    def test_a_file_of_one_level_has_nothing_to_prove(self):
        verdict = self.info_json("--verify", "--levels", self.built("cube.obj", CUBE_OBJ))
        self.assertEqual((verdict["sound"], verdict["levels"]), (True, []))

    def test_a_file_that_the_checker_refuses_has_no_levels(self):
        cut = self.write("cut.bvh", self.file.read_bytes()[:-1])
        self.assert_fails(self.info("--verify", "--levels", cut), UNREADABLE_INPUT, cut, "Truncated")
        self.assertNotIn("levels", self.info_json("--verify", "--levels", cut))

    def test_levels_are_an_option_of_verify(self):
        self.assertEqual(self.info("--levels", self.file).returncode, USAGE)


if __name__ == "__main__":
    unittest.main()
