#!/usr/bin/python3
"""bvhbench distance and bvhbench query --within from the outside. Environment: that of bench_test.py."""
import json
import re
import unittest

import h5py
import numpy as np

from bench_test import BenchTest, IDENTITY
from tool_test import CUBE_OBJ, SOURCE_DIR, UNREADABLE_INPUT, USAGE


class Distance(BenchTest):
    def setUp(self):
        super().setUp()
        self.distances = self.outputs / "distances.h5"

    def row_of_cubes(self, *places, **more):
        self.write_scene(asset=(0,) * len(places), rotation=(IDENTITY,) * len(places), translation=[(x, 0, 0) for x in places], **more)

    def distance(self, *arguments):
        """The report, the datasets and the attributes."""
        report = json.loads(self.passes("distance", self.scene, "--json", "--out", self.distances, *arguments))
        with h5py.File(self.distances) as file:
            rows = {name: column[:] for name, column in file["distance"].items()}
            return report, {"pairs": file["pairs"][:], **rows}, dict(file.attrs)

    def test_files_hold_certified_intervals_and_witnesses(self):
        self.row_of_cubes(0, 1.25, 3)
        report, rows, attributes = self.distance()
        self.assertEqual({name: str(column.dtype) for name, column in rows.items()},
                         {"pairs": "uint32", "lower": "float64", "upper": "float64", "point_a": "float64", "point_b": "float64",
                          "face_a": "uint32", "face_b": "uint32"})
        self.assertEqual(rows["pairs"].tolist(), [[0, 1], [0, 2], [1, 2]])
        for row, truth in enumerate((0.25, 2, 0.75)):
            self.assertLessEqual(rows["lower"][row], truth)
            self.assertGreaterEqual(rows["upper"][row], truth)
            self.assertLessEqual(rows["upper"][row] - rows["lower"][row], 1e-6 * truth)
            self.assertAlmostEqual(np.linalg.norm(rows["point_a"][row] - rows["point_b"][row]), truth, delta=1e-12)
        faces = CUBE_OBJ.count("\nf ")
        self.assertTrue((rows["face_a"] < faces).all() and (rows["face_b"] < faces).all())
        for key in ("object_pairs", "touching", "block_pairs", "by_float32", "by_float64", "hash", "threads", "backend", "relative_tolerance"):
            self.assertEqual(report[key], attributes[key], key)
        self.assertEqual((report["object_pairs"], report["touching"], report["reach"]), (3, 0, None))
        self.assertAlmostEqual(report["least"], 0.25)

    def test_reach_leaves_out_what_is_beyond(self):
        self.row_of_cubes(0, 1.25, 3)
        self.assertEqual(self.distance("--reach", "0.3")[1]["pairs"].tolist(), [[0, 1]])

    def test_given_pairs_beyond_reach_are_told_to_be(self):
        self.row_of_cubes(0, 1.25, 3, pairs=np.array([[2, 0], [1, 0]], "u4"))
        report, rows, _ = self.distance("--reach", "1")
        self.assertTrue(report["given_pairs"])
        self.assertEqual(rows["pairs"].tolist(), [[0, 1], [0, 2]])
        self.assertEqual(rows["upper"][1], np.inf)
        self.assertGreaterEqual(rows["lower"][1], 1)
        self.assertEqual(rows["face_a"][1], 2**32 - 1)

    def test_touching_is_zero(self):
        self.row_of_cubes(0, 1)
        report, rows, _ = self.distance("--absolute", "0.5")
        self.assertEqual((report["touching"], rows["lower"][0], rows["upper"][0]), (1, 0, 0))

    def test_threads_and_repeats_change_no_bytes(self):
        self.make("pile", "--count", "40")
        expected = self.distance("--reach", "1", "--threads", "1")
        for arguments in (["--threads", "3"], ["--repeat", "3"]):
            report, rows, _ = self.distance("--reach", "1", *arguments)
            self.assertEqual(report["hash"], expected[0]["hash"])
            for name, column in rows.items():
                self.assertEqual(column.tobytes(), expected[1][name].tobytes(), name)

    def test_a_wider_tolerance_is_kept(self):
        self.make("pile", "--count", "40")
        _, narrow, _ = self.distance()
        _, wide, _ = self.distance("--tolerance", "0.2")
        self.assertTrue((wide["upper"] - wide["lower"] <= 0.2 * wide["upper"]).all())
        self.assertTrue((wide["lower"] <= narrow["upper"]).all() and (wide["upper"] >= narrow["lower"]).all())

    def test_people_are_told_too(self):
        self.row_of_cubes(0, 1.25)
        self.assertRegex(self.passes("distance", self.scene), r"object pairs +1  found\n(.*\n)*  least +0\.25\n")

    def test_what_is_wrong_is_refused(self):
        self.row_of_cubes(0, 1.25)
        for arguments in (["--reach", "-1"], ["--reach", "nan"], ["--tolerance", "2"], ["--absolute", "-1"], ["--threads", "0"]):
            self.assertEqual(self.bench("distance", self.scene, *arguments).returncode, USAGE, arguments)
        self.assertEqual(self.bench("distance", self.outputs / "none.h5").returncode, UNREADABLE_INPUT)

    def test_the_page_lists_the_keys(self):
        self.row_of_cubes(0, 1.25)
        page = (SOURCE_DIR / "docs/json.md").read_text(encoding="utf-8")
        section = page.partition("## `bvhbench distance SCENE.h5 --json`")[2].partition("\n## ")[0]
        listed = [key for row in re.findall(r"^\| (`.*?) \|", section, re.MULTILINE) for key in re.findall(r"`(\w+)`", row)]
        self.assertEqual(sorted(listed), sorted(self.distance()[0]))


class Within(BenchTest):
    def test_clearance_counts_ties_and_nothing_beyond(self):
        self.write_scene(translation=((0, 0, 0), (1.25, 0, 0)))
        self.assertEqual(self.query()["contacts"], 0)
        report = self.query("--within", "0.25", "--out", self.contacts)
        self.assertGreater(report["contacts"], 0)
        self.assertEqual((report["within"], report["object_pairs"]), (0.25, 1))
        with h5py.File(self.contacts) as file:
            self.assertEqual(file.attrs["within"], 0.25)
            self.assertEqual(len(file["contacts/face_a"]), report["contacts"])
        self.assertEqual(self.query("--within", "0.2499999999999999")["contacts"], 0)

    def test_manifolds_and_distances_that_are_none_are_refused(self):
        self.write_scene()
        for arguments in (["--manifolds"], ["--contained"]):
            self.assertEqual(self.bench("query", self.scene, "--within", "1", *arguments).returncode, USAGE)
        for distance in ("-1", "nan", "inf"):
            self.assertEqual(self.bench("query", self.scene, "--within", distance).returncode, USAGE)


class CompareDistances(BenchTest):
    def test_all_agree(self):
        self.make("pile", "--count", "60")
        report = json.loads(self.passes("compare", self.scene, "--distance", "1", "--repeat", "2", "--json"))
        scene = report["scenes"][0]
        self.assertGreater(scene["object_pairs"], 50)
        self.assertEqual(scene["peers"][0]["name"], "Tandem")
        self.assertLess(scene["peers"][0]["worst_error"], 1e-6)
        for peer in scene["peers"]:
            self.assertLess(peer["worst_error"], 1e-5, peer["name"])
        self.assertEqual((scene["peers"][-1]["name"], scene["peers"][-1]["outside"]), ("CGAL", 0))

    def test_what_is_of_contacts_is_refused(self):
        self.write_scene()
        self.assertEqual(self.bench("compare", self.scene, "--distance", "1", "--peers", "fcl").returncode, USAGE)


if __name__ == "__main__":
    unittest.main()
