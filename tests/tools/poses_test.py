#!/usr/bin/python3
"""bvhbench poses from the outside: what it prints, what is in its files, and what it refuses.

Environment: that of bench_test.py.
"""
import json
import os
import unittest

import h5py
import numpy as np

from bench_test import BenchTest, change, datasets
from tool_test import BVHBUILD, UNREADABLE_INPUT, UNWRITABLE_OUTPUT, USAGE, scattered_obj

COUNTERS = ("block_pairs", "candidates", "contacts")
ORIENTED = ("oriented_block_pairs", "oriented_candidates")


class PosesTest(BenchTest):
    """Each test has two trees over one mesh, and a name for a file of poses."""

    def setUp(self):
        super().setUp()
        self.minimal, self.free = self.tree("minimal"), self.tree("free")
        self.file, self.other = self.outputs / "poses.h5", self.outputs / "other.h5"

    def tree(self, imaginary, seed=1, *options):
        path = self.inputs / f"{imaginary}_{seed}{''.join(options)}.bvh"
        mesh = self.write("scattered.obj", scattered_obj(300, seed))
        self.succeeds(BVHBUILD, mesh, "-o", path, "--imaginary", imaginary, *options)
        return path

    def poses(self, *arguments):
        return json.loads(self.passes("poses", *arguments, "--json"))

    def refused(self, code, *arguments, words=()):
        self.assert_fails(self.bench("poses", *arguments), code, *words)
        self.assertFalse(self.other.exists())


class Poses(PosesTest):
    def test_the_same_arguments_give_the_same_bytes_on_any_number_of_threads(self):
        for threads in ("1", "2", "7"):
            self.passes("poses", self.minimal, "--count", "50", "--threads", threads, "-o", self.other)
            self.file.exists() or self.file.write_bytes(self.other.read_bytes())
            self.assertEqual(self.file.read_bytes(), self.other.read_bytes())

    def test_sets_and_seeds_differ_and_more_poses_begin_with_the_fewer(self):
        def translations(*arguments):
            self.passes("poses", self.minimal, *arguments, "-o", self.file)
            return datasets(self.file)["instances/translation"][1:]
        base = translations("--count", "30")
        self.assertTrue((base == translations("--count", "60")[:30]).all())
        self.assertTrue((base == translations("--count", "30", "--set", "validation", "--seed", "1")).all())
        for other in (("--set", "training"), ("--seed", "2")):
            self.assertFalse((base == translations("--count", "30", *other)).any())

    def test_poses_do_not_depend_on_the_tree(self):
        for tree, path in ((self.minimal, self.file), (self.free, self.other)):
            self.passes("poses", tree, "--count", "50", "-o", path)
        one, two = datasets(self.file), datasets(self.other)
        for name in ("instances/rotation", "instances/translation", "poses/depth", "poses/geometry", "counts/contacts"):
            self.assertTrue((one[name] == two[name]).all(), name)
        self.assertTrue((one["counts/block_pairs"] != two["counts/block_pairs"]).any())

    def test_stored_poses_give_the_figures_that_made_poses_give(self):
        made = self.poses(self.minimal, self.free, "--count", "50", "--seed", "3", "--set", "training", "-o", self.file)
        taken = self.poses(self.minimal, self.free, "--poses", self.file, "-o", self.other)
        self.assertEqual((taken["set"], taken["seed"], taken["count"]), ("training", "3", 50))
        self.assertEqual(made["trees"], taken["trees"])
        self.assertEqual(self.file.read_bytes(), self.other.read_bytes())
        alone = self.poses(self.free, "--poses", self.file)["trees"][0]
        self.assertEqual(alone["block_pairs"]["mean"], made["trees"][1]["block_pairs"]["mean"])
        self.assertEqual(alone["block_pairs"]["ratio"], 1)

    def test_figures_are_those_of_the_rows(self):
        trees = self.poses(self.minimal, self.free, "--count", "101", "-o", self.file)["trees"]
        with h5py.File(self.file) as file:
            self.assertEqual(list(file["counts/trees"].asstr()), ["../in/minimal_1.bvh", "../in/free_1.bvh"])
            self.assertTrue(((file["poses/depth"][:] >= 0) & (file["poses/depth"][:] < 0.05)).all())
            for name in COUNTERS + ORIENTED:
                rows = file[f"counts/{name}"][:]
                self.assertEqual((rows.dtype, rows.shape), ("u4", (2, 101)))
                for tree, row in zip(trees, rows.astype(float)):
                    self.assertAlmostEqual(tree[name]["mean"], row.mean(), 9)
                    self.assertAlmostEqual(tree[name]["standard_error"], row.std(ddof=1) / np.sqrt(101), 9)
                    np.testing.assert_allclose(tree[name]["quartiles"], np.percentile(row, [25, 50, 75]))
                    self.assertAlmostEqual(tree[name]["ratio"], row.mean() / rows[0].mean(), 9)
        self.assertAlmostEqual(trees[1]["box_tests"]["mean"], 16 * trees[1]["block_pairs"]["mean"], 6)

    def test_the_file_is_a_scene(self):
        tree = self.poses(self.minimal, "--count", "40", "-o", self.file)["trees"][0]
        query = json.loads(self.passes("query", self.file, "--json"))
        self.assertEqual(query["object_pairs"], 40)
        for name in COUNTERS:
            self.assertAlmostEqual(query[name], 40 * tree[name]["mean"], 6)

    def test_oriented_blocks_are_walked_where_there_are_some(self):
        without = self.tree("minimal", 1, "--no-gpu-blocks")
        trees = self.poses(self.minimal, without, "--count", "40", "-o", self.file)["trees"]
        self.assertEqual(trees[0]["block_pairs"], trees[1]["block_pairs"])
        with h5py.File(self.file) as file:
            for name in ORIENTED:
                rows = file[f"counts/{name}"][:]
                self.assertGreater(rows[0].max(), 1)
                self.assertFalse(rows[1].any())
                self.assertIsNone(trees[1][name])
            # What touches has overlapping boxes of either kind.
            for name in ("candidates", "oriented_candidates"):
                self.assertTrue((file[f"counts/{name}"][0] >= file["counts/contacts"][0]).all())
        swapped = self.poses(without, self.minimal, "--poses", self.file)["trees"][1]
        for name in ORIENTED:
            self.assertEqual(swapped[name]["mean"], trees[0][name]["mean"])
            self.assertIsNone(swapped[name]["ratio"])
        beside = self.poses(self.minimal, "--with", self.tree("minimal", 2, "--no-gpu-blocks"), "--count", "5")
        self.assertIsNone(beside["trees"][0]["oriented_block_pairs"])
        self.assertIn(" -\n", self.passes("poses", without, "--count", "5"))

    def test_a_second_mesh(self):
        second = self.tree("minimal", seed=2)
        made = self.poses(self.minimal, self.free, "--with", second, "--count", "30", "-o", self.file)
        self.assertEqual(made["with"], os.fspath(second))
        with h5py.File(self.file) as file:
            self.assertEqual(list(file["assets"].asstr()), ["../in/minimal_1.bvh", "../in/minimal_2.bvh"])
            self.assertEqual(list(file["instances/asset"][:]), [0] + 30 * [1])
        self.assertEqual(self.poses(self.minimal, self.free, "--poses", self.file)["trees"], made["trees"])
        other = self.tree("free", seed=2)
        taken = self.poses(self.minimal, "--poses", self.file, "--with", other)["trees"][0]
        self.assertEqual(taken["contacts"], made["trees"][0]["contacts"])
        self.assertNotEqual(taken["block_pairs"], made["trees"][0]["block_pairs"])

    def test_the_text_names_every_tree_and_its_ratio(self):
        text = self.passes("poses", self.minimal, self.free, "--count", "20")
        for word in ("20 validation poses", self.minimal, self.free, "block pairs", "candidates", "contacts", "x1.000"):
            self.assertIn(os.fspath(word), text)


class PosesRefusals(PosesTest):
    def test_another_mesh_is_refused(self):
        self.passes("poses", self.minimal, "--count", "5", "-o", self.file)
        other = self.tree("minimal", seed=2)
        for arguments in ([other, "--poses", self.file], [self.minimal, other], [self.minimal, "--poses", self.file, other]):
            self.refused(UNREADABLE_INPUT, *arguments, "-o", self.other, words=(other, "other triangles"))
        self.passes("poses", self.minimal, "--with", other, "--count", "5", "-o", self.file)
        self.refused(UNREADABLE_INPUT, self.minimal, "--with", self.free, "--poses", self.file, words=(self.free, "other triangles"))

    def test_scenes_that_are_not_of_poses_are_refused(self):
        self.passes("poses", self.minimal, "--count", "5", "-o", self.file)
        whole = self.file.read_bytes()

        for wrong in ({"pairs": np.zeros((5, 2), "u4")}, {"pairs": np.array([[0, i] for i in range(1, 5)], "u4")}, {"poses_depth": np.zeros(4)},
                      {"poses_geometry": ["a", "b"]}, {"poses_stream": ["training"]}, {"poses": None}):
            self.file.write_bytes(whole)
            change(self.file, **wrong)
            self.refused(UNREADABLE_INPUT, self.minimal, "--poses", self.file, words=(self.file, "none of poses"))
        self.file.write_bytes(whole[:-700])
        self.refused(UNREADABLE_INPUT, self.minimal, "--poses", self.file, words=(self.file,))

    def test_files_that_cannot_be_read_are_told(self):
        self.refused(UNREADABLE_INPUT, self.inputs / "none.bvh", words=("none.bvh", "no such file"))
        self.refused(UNREADABLE_INPUT, self.minimal, "--with", self.inputs / "none.bvh", words=("none.bvh",))
        self.refused(UNREADABLE_INPUT, self.minimal, "--poses", self.inputs / "none.h5", words=("none.h5",))

    def test_arguments_that_contradict_each_other_are_told(self):
        self.passes("poses", self.minimal, "--count", "5", "-o", self.file)
        self.refused(USAGE, self.minimal, "--poses", self.file, "--with", self.free, words=("--with",))
        for option in (("--count", "5"), ("--seed", "1"), ("--set", "training")):
            self.refused(USAGE, self.minimal, "--poses", self.file, *option, words=(option[0], "--poses"))
        self.refused(USAGE, self.minimal, "-o", self.minimal, words=(self.minimal, "overwritten"))
        self.refused(USAGE, self.minimal, "--poses", self.file, "-o", self.file, words=(self.file, "overwritten"))
        for words in (["--count", "0"], ["--set", "test"], ["--threads", "0"], ["--seed", "-1"], ["-o", ""]):
            self.refused(USAGE, self.minimal, *words)
        self.refused(USAGE, words=("TREE",))

    def test_an_output_that_cannot_be_written_is_told(self):
        self.refused(UNWRITABLE_OUTPUT, self.minimal, "--count", "5", "-o", "/dev/full", words=("/dev/full", "No space left"))


if __name__ == "__main__":
    unittest.main()
