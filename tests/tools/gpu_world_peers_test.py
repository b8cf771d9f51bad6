#!/usr/bin/python3
"""scripts/gpu_world_peers: what its judge says of states that are known, and its table of a small pile that Tandem lets fall on the CPU.

Environment: that of tool_test.py, and TANDEM_BVHBENCH.
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

from common import tabular
from gpu_world_pile import Judge, Pile
from tool_test import SOURCE_DIR, ToolTest


class GpuWorldPeersTest(ToolTest):
    def setUp(self):
        super().setUp()
        self.pile = Pile(SOURCE_DIR / "assets/box_12.obj", 2)  # a cube of 1 m about its origin

    def state(self, *places):
        return np.tile(np.eye(3), (2, 1, 1)), np.array(places, float)

    def test_the_start_is_free_of_contacts(self):
        for count in (1, 20, 100):
            pile = Pile(SOURCE_DIR / "assets/cow_1500.obj", count)
            with tempfile.TemporaryDirectory() as folder:
                depths = Judge(pile, folder).depths([(pile.rotation, pile.translation)])
            self.assertEqual([len(depth) for depth in depths], [0])
            self.assertFalse(pile.lost(pile.rotation, pile.translation).any())

    def test_depths_are_those_of_each_state(self):
        free, sunk, stacked = self.state([0, 0, 1], [0, 0, 3]), self.state([0, 0, 0.49], [0, 0, 3]), self.state([0, 0, 0.5 - 1 / 256], [0, 0, 1.25])
        depths = Judge(self.pile, self.outputs).depths([free, sunk, stacked])
        self.assertEqual(len(depths[0]), 0)
        np.testing.assert_allclose(depths[1], 0.01, atol=1e-6)
        self.assertAlmostEqual(depths[2].max(), 0.25 - 1 / 256, places=6)
        self.assertAlmostEqual(depths[2].min(), 1 / 256, places=6)

    def test_bodies_that_left_the_tray_are_lost_and_not_judged(self):
        fallen, flown, nowhere = self.state([0, 0, -0.1], [0, 0, 3]), self.state([0, 0, 1], [9, 0, 3]), self.state([0, 0, 1], [np.nan, 0, 3])
        lost = [self.pile.lost(*state).tolist() for state in (fallen, flown, nowhere)]
        self.assertEqual(lost, [[True, False], [False, True], [False, True]])
        self.assertEqual([len(depth) for depth in Judge(self.pile, self.outputs).depths([fallen, flown, nowhere])], [0, 0, 0])

    def run_script(self, *options):
        table = self.outputs / "table.csv"
        done = subprocess.run([sys.executable, SOURCE_DIR / "scripts/gpu_world_peers", table, "--device", "cpu", "--mesh", SOURCE_DIR / "assets/box_12.obj", *options],
                              capture_output=True, text=True, timeout=200)
        self.assertEqual(done.returncode, 0, done.stderr)
        return tabular.read(table)

    def test_cubes_fall_and_rest(self):
        row, = self.run_script("--engines", "tandem", "--bodies", "2", "--seconds", "4")
        self.assertEqual([row[name] for name in ("engine", "bodies", "simulated_s", "lost", "at_rest", "notes")], ["tandem", "2", "4", "0", "yes", ""])
        for name in ("falling_ms", "piling_ms", "slowest_ms"):
            self.assertGreater(float(row[name]), 0)
        self.assertGreater(int(row["points"]), 0)
        self.assertLess(float(row["deepest_mm"]), 1)
        self.assertGreater(float(row["deepest_of_run_mm"]), float(row["deepest_mm"]))

    def test_a_row_replaces_its_like_and_a_run_that_ends_early_says_why(self):
        self.run_script("--engines", "tandem", "--bodies", "1", "2", "--seconds", "0.5")
        rows = self.run_script("--engines", "tandem", "--bodies", "2", "--budget", "0")
        self.assertEqual([(row["bodies"], row["simulated_s"], row["notes"]) for row in rows], [("1", "0.5", ""), ("2", "0", "ended after 0 s")])


if __name__ == "__main__":
    unittest.main()
