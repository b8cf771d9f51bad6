#!/usr/bin/python3
"""bvhbench compare from the outside: its answers, its files, and what it refuses.

Environment: that of tool_test.py, and TANDEM_BVHBENCH.
"""
import json
import subprocess
import unittest

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from bench_test import BenchTest
from tool_test import DONE, SOURCE_DIR, UNREADABLE_INPUT, UNWRITABLE_OUTPUT, USAGE

PLOT = SOURCE_DIR / "scripts/plot_compare"
TANDEM = ["Tandem exact", "Tandem fast", "Tandem boxes"]
ARRAYS = {"build_seconds", "update_seconds", "query_seconds_best", "query_seconds_median", "contacts", "missed", "invented",
          "memory_bytes", "work_bytes"}


class CompareTest(BenchTest):
    def setUp(self):
        super().setUp()
        self.results = self.outputs / "results.h5"

    def scene_of(self, name, rotation, translation, pairs=None):
        self.scene = self.outputs / f"{name}.h5"
        self.write_scene([0] * len(rotation), rotation, translation, pairs=None if pairs is None else np.array(pairs, "u4"))
        return self.scene

    def heap(self):
        """Cubes in general position, close enough to meet."""
        rng = np.random.default_rng(1)
        return self.scene_of("heap", Rotation.random(20, rng).as_matrix(), rng.uniform(0, 2.5, (20, 3)))

    def stack(self):
        """Cubes that share corners, edges and faces, all turned by the same rotation: rounding parts some of them."""
        grid = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
        rotation = Rotation.random(random_state=np.random.default_rng(2)).as_matrix()
        return self.scene_of("stack", np.tile(rotation, (27, 1, 1)), grid @ rotation.T)

    def compared(self, *arguments):
        """The JSON: a list of scenes, each with its peers by name."""
        scenes = json.loads(self.passes("compare", *arguments, "--json", "--repeat", "2"))["scenes"]
        for scene in scenes:
            scene["peers"] = {peer["name"]: peer for peer in scene["peers"]}
        return scenes

    def test_exact_is_what_cgal_finds(self):
        scenes = self.compared(self.heap(), self.stack(), "--peers", "cgal,tandem")
        self.assertEqual([scene["scene"] for scene in scenes], ["heap", "stack"])
        for scene in scenes:
            exact, cgal = scene["peers"]["Tandem exact"], scene["peers"]["CGAL"]
            self.assertEqual(scene["reference"], "CGAL")
            self.assertGreater(cgal["contacts"], 100)
            self.assertEqual((exact["missed"], exact["invented"]), (0, 0))
            self.assertEqual((exact["contacts"], exact["hash"]), (cgal["contacts"], cgal["hash"]))

    def test_candidates_count_as_invented(self):
        scene, = self.compared(self.heap(), "--peers", "tandem,cgal")
        boxes, exact = scene["peers"]["Tandem boxes"], scene["peers"]["Tandem exact"]
        self.assertGreater(boxes["contacts"], exact["contacts"])
        self.assertEqual((boxes["missed"], boxes["invented"]), (0, boxes["contacts"] - exact["contacts"]))

    def test_every_peer_runs(self):
        scene, = self.compared(self.heap())
        self.assertEqual(list(scene["peers"])[:3], TANDEM)
        for name, peer in scene["peers"].items():
            with self.subTest(name):
                self.assertGreater(peer["query_seconds_best"], 0)
                self.assertGreaterEqual(peer["query_seconds_median"], peer["query_seconds_best"])
                self.assertEqual(len(peer["query_seconds"]), 1 if name == "CGAL" else 2)
                self.assertGreater(peer["memory_bytes"], 0)
                if name != "ODE":
                    self.assertLess(peer["missed"], 0.1 * scene["peers"]["CGAL"]["contacts"])
        for name in {"FCL", "Embree", "Embree refit"} & scene["peers"].keys():
            self.assertEqual((scene["peers"][name]["missed"], scene["peers"][name]["invented"]), (0, 0), name)

    def test_exact_is_the_reference_without_cgal(self):
        scene, = self.compared(self.heap(), "--peers", "tandem")
        self.assertEqual(scene["reference"], "Tandem exact")
        self.assertEqual(list(scene["peers"]), TANDEM)

    def test_given_pairs_alone_are_asked(self):
        rotation = np.tile(np.eye(3), (3, 1, 1))
        scene, = self.compared(self.scene_of("given", rotation, [[0, 0, 0], [0.5, 0.5, 0.5], [1, 1, 1]], [[1, 0]]))
        self.assertEqual(scene["object_pairs"], 1)
        self.assertEqual(scene["peers"]["Tandem exact"]["missed"], 0)

    def test_the_file_holds_what_the_json_says(self):
        scene, = self.compared(self.stack(), "--out", self.results)
        with h5py.File(self.results) as file:
            self.assertEqual(set(file.attrs), {"machine", "commit", "repeats"})
            self.assertEqual(list(file), ["stack"])
            group = file["stack"]
            names = [name.decode() for name in group["name"]]
            self.assertEqual(names, list(scene["peers"]))
            self.assertEqual(group["query_seconds"].shape, (len(names), 2))
            self.assertEqual(group["reference"][0], b"CGAL")
            self.assertEqual(group["object_pairs"][0], scene["object_pairs"])
            for array in ARRAYS:
                expected = [np.nan if peer[array] is None else peer[array] for peer in scene["peers"].values()]
                np.testing.assert_array_equal(group[array][:], expected, array)
            block_pairs = group["counters/block_pairs"][:]
            self.assertEqual(block_pairs[0], scene["peers"]["Tandem exact"]["counters"]["block_pairs"])
            self.assertTrue(np.isnan(block_pairs[names.index("CGAL")]))

    def need_matplotlib(self):
        try:
            subprocess.run(["/usr/bin/python3", "-c", "import matplotlib"], check=True, stderr=subprocess.DEVNULL)
        except (OSError, subprocess.CalledProcessError):
            self.skipTest("no matplotlib")

    def test_the_chart_is_drawn_of_the_file(self):
        self.need_matplotlib()
        self.compared(self.stack(), "--out", self.results)
        self.assertIn("| Tandem exact |", self.succeeds(PLOT, self.results, "-o", self.outputs / "chart"))
        self.assertGreater((self.outputs / "chart.png").stat().st_size, 1000)
        self.assertIn(b"<svg", (self.outputs / "chart.svg").read_bytes()[:2000])

    def test_a_table_of_the_file_gives_the_same_tables_and_chart(self):
        self.need_matplotlib()
        self.compared(self.stack(), "--out", self.results)
        table = self.outputs / "table.csv"
        table.write_bytes(self.run_tool(PLOT, self.results, "--csv").stdout)
        drawn = [self.run_tool(PLOT, source, "-o", self.outputs / source.stem) for source in (self.results, table)]
        self.assertEqual([result.returncode for result in drawn], [DONE, DONE])
        self.assertEqual(drawn[0].stdout, drawn[1].stdout)
        self.assertEqual((self.outputs / "results.svg").read_bytes(), (self.outputs / "table.svg").read_bytes())

    def test_refuses_what_it_cannot_compare(self):
        heap = self.heap()
        itself = self.scene_of("itself", np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 3)), [[1, 1]])
        skewed = self.scene_of("skewed", np.full((2, 3, 3), 0.5), np.zeros((2, 3)))
        for arguments, code, words in [
                ([heap, "--peers", "tandem,rapid"], USAGE, ["rapid"]), ([heap, "--repeat", "0"], USAGE, ["--repeat"]),
                ([heap, heap], USAGE, ["heap.h5", "same name"]), ([self.outputs / "none.h5"], UNREADABLE_INPUT, ["none.h5"]),
                ([itself], UNREADABLE_INPUT, ["itself.h5", "/pairs"]),
                ([skewed], UNREADABLE_INPUT, ["skewed.h5", "instance 0", "rigid"]),
                ([heap, "--peers", "tandem", "--out", "/none/r.h5"], UNWRITABLE_OUTPUT, ["/none/r.h5"])]:
            with self.subTest(words):
                self.assert_fails(self.bench("compare", *arguments), code, *words)


if __name__ == "__main__":
    unittest.main()
