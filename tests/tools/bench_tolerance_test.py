#!/usr/bin/python3
"""bvhbench query --tolerance from the outside, at levels that bvhbuild makes: of a mesh of this repository, and of ten meshes,
scans, CAD, broken ones, of a folder: TANDEM_MESHES, else ../shared/meshes beside the sources. Where that is not there, its tests
are skipped. With TANDEM_LONG=1, all ten in 1,000 poses near contact; else four of them in 60.

Environment: that of bench_test.py.
"""
import json
import os
import pathlib
import unittest

import h5py
import numpy as np

from bench_test import BenchTest, drop_hint
from tool_test import DONE, SOURCE_DIR, USAGE

MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
LONG = os.environ.get("TANDEM_LONG") == "1"
FEW = ("spot.obj", "featuretype.STL", "moebius.obj", "triple_vierbein.obj")
TEN = FEW + ("bun_zipper.ply", "armadillo.obj", "koala.obj", "cycloidal.ply", "teapot.obj", "self_intersectA.obj")
APART, TOUCHING, WITHIN = range(3)


class ToleranceTest(BenchTest):
    def with_levels(self, mesh, levels="0.1%,0.3%,1%,3%"):
        """The file of a mesh with levels, and their errors."""
        path = self.inputs / f"{pathlib.Path(mesh).stem}.bvh"
        result = self.build(mesh, "-o", path, "--levels", levels, "--effort", "fast", "--json", timeout=300)
        self.assertEqual(result.returncode, DONE, result.stderr)
        return path, [level["error_bound"] for level in json.loads(self.info(path, "--json").stdout)["levels"]]

    def decide(self, tolerance, *arguments):
        verdicts = self.outputs / "verdicts.h5"
        report = json.loads(self.passes("query", self.scene, "--tolerance", repr(tolerance), "--json", "--out", verdicts, *arguments,
                                        timeout=300))
        with h5py.File(verdicts) as file:
            rows = {name: column[:] for name, column in file["verdict"].items()}
            return report, {"pairs": file["pairs"][:], **rows}, dict(file.attrs)

    def truth(self):
        """Of each pair whether its finest levels meet, and its distance, from above."""
        contacts, distances = self.outputs / "contacts.h5", self.outputs / "distances.h5"
        self.passes("query", self.scene, "--first-contact", "--out", contacts, timeout=300)
        self.passes("distance", self.scene, "--out", distances, timeout=300)
        with h5py.File(contacts) as first, h5py.File(distances) as apart:
            self.assertTrue((first["pairs"][:] == apart["pairs"][:]).all())
            meets = np.zeros(len(first["pairs"]), bool)
            meets[first["contacts/pair"][:]] = True
            return first["pairs"][:], meets, apart["distance/upper"][:]

    def assert_right(self, tolerances):
        """Verdicts at all tolerances are those of the finest levels. Result: how many pairs each verdict had."""
        pairs, meets, upper = self.truth()
        counted = []
        for tolerance in tolerances:
            report, rows, attributes = self.decide(tolerance)
            verdict = rows["verdict"]
            self.assertTrue((rows["pairs"] == pairs).all())
            self.assertFalse((meets & (verdict == APART)).any(), f"apart, and meet, at {tolerance}")
            self.assertFalse((~meets & (verdict == TOUCHING)).any(), f"touching, and apart, at {tolerance}")
            within = verdict == WITHIN
            self.assertTrue((upper[within] <= tolerance * (1 + 1e-5)).all(), f"beyond {tolerance}")
            self.assertTrue((within == (rows["level_a"] + rows["level_b"] > 0))[~(verdict == APART)].all())
            counted.append(np.bincount(verdict, minlength=3))
            self.assertEqual([report[name] for name in ("apart", "touching", "within_tolerance")], counted[-1].tolist())
            for name in ("hash", "tolerance", "object_pairs", "block_pairs", "candidates", "threads", "backend"):
                self.assertEqual(report[name], attributes[name], name)
            self.assertEqual(sum(row["pairs"] for row in report["decided_at"]), len(pairs))
        self.assertEqual(counted[0][WITHIN], 0)
        self.assertEqual(counted[0][TOUCHING], meets.sum())
        return counted

    def write_near_poses(self, path, count, share):
        """Pairs near contact: bodies of near_contact, moved by up to a share of their size in any direction."""
        poses = self.outputs / "poses.h5"
        self.passes("poses", path, "--count", str(count), "-o", poses, timeout=300)
        random = np.random.default_rng(1)
        with h5py.File(poses) as file:
            pairs, rotation, translation = (file[name][:] for name in
                                            ("pairs", "instances/rotation", "instances/translation"))
        size = json.loads(self.info(path, "--json").stdout)["bounds"]
        diagonal = np.linalg.norm(np.subtract(size["upper"], size["lower"]))
        translation[1:] += random.uniform(-share, share, (count, 3)) * diagonal
        self.write_scene(asset=np.zeros(count + 1), rotation=rotation, translation=translation,
                         assets=(os.path.relpath(path, self.outputs),), pairs=pairs)


class Tolerance(ToleranceTest):
    def test_verdicts_are_those_of_the_finest_levels(self):
        path, errors = self.with_levels(SOURCE_DIR / "assets" / "cow.obj")
        self.assertGreater(len(errors), 3)
        self.write_near_poses(path, 80, 0.02)
        counted = self.assert_right([0] + [4.001 * error for error in errors[1:]])
        self.assertGreater(counted[0][APART], 10)
        self.assertGreater(counted[0][TOUCHING], 10)
        self.assertGreater(counted[-1][WITHIN], counted[1][WITHIN])

    def test_threads_change_nothing(self):
        path, errors = self.with_levels(SOURCE_DIR / "assets" / "cow.obj")
        self.write_near_poses(path, 40, 0.02)
        one, two = (self.decide(5 * errors[2], "--threads", threads) for threads in "12")
        self.assertEqual(one[0]["hash"], two[0]["hash"])
        self.assertTrue(all((one[1][name] == two[1][name]).all() for name in one[1]))

    def test_a_file_of_one_level_is_decided_exactly(self):
        self.write_scene(translation=((0, 0, 0), (1, 0, 0)))
        report, rows, _ = self.decide(100)
        self.assertEqual((rows["verdict"].tolist(), report["touching"]), ([TOUCHING], 1))
        self.assertEqual(report["decided_at"], [{"level_a": 0, "level_b": 0, "pairs": 1}])
        self.assertIn("touching", self.passes("query", self.scene, "--tolerance", "0"))

    def test_options_about_contacts_do_not_go_with_it(self):
        self.write_scene()
        for option in (("--mode", "fast"), ("--first-contact",), ("--manifolds",), ("--contained",), ("--within", "1"), ("--self",)):
            self.assert_fails(self.bench("query", self.scene, "--tolerance", "1", *option), USAGE, "--tolerance")
        for bad in ("-1", "nan", "x", "1e301"):
            self.assert_fails(drop_hint(self.bench("query", self.scene, "--tolerance", bad)), USAGE, "--tolerance")


@unittest.skipUnless(MESHES.is_dir(), f"no folder of meshes: {MESHES}")
class SharedMeshes(ToleranceTest):
    def test_near_contact_no_level_calls_bodies_apart_that_meet(self):
        touching = apart = 0
        for name in TEN if LONG else FEW:
            with self.subTest(mesh=name):
                path, errors = self.with_levels(MESHES / name)
                self.write_near_poses(path, 100 if LONG else 15, 0.02)
                counted = self.assert_right([0] + [4.001 * error for error in errors[1:]])
                touching, apart = touching + counted[0][TOUCHING], apart + counted[0][APART]
        self.assertGreater(touching, 250 if LONG else 15)
        self.assertGreater(apart, 250 if LONG else 15)


if __name__ == "__main__":
    unittest.main()
