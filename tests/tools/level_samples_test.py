#!/usr/bin/python3
"""Attacks the error bounds of levels that bvhbuild makes: no sample may be farther than the bound, and the bound may be little more than the farthest sample.

Usage: level_samples_test.py OwnAssets|SharedMeshes. SharedMeshes takes ten meshes of TANDEM_MESHES (else ../shared/meshes beside the sources) and 10^7 samples each way: with TANDEM_LONG=1 only, as it takes half an hour.
Without, or where there are no meshes, it is skipped (exit code 77).
Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO, TANDEM_LEVEL_SAMPLES (the binaries), TANDEM_SOURCE_DIR.
"""
import os
import pathlib
import re
import sys
import unittest

import bvh_file
import numpy as np

from tool_test import DONE, SOURCE_DIR, ToolTest

MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
LEVEL_SAMPLES = os.environ["TANDEM_LEVEL_SAMPLES"]
SKIPPED = 77
LINE = re.compile(r" level (\d+) triangles (\d+) bound (\S+) sampled \S+ ratio (\S+) with_corners (\S+) violations (\d+)$", re.MULTILINE)

# Scans, CAD, terrain, open, self-intersecting and not manifold.
TEN = ("bun_zipper.ply", "koala.obj", "armadillo.obj", "scallop.glb", "cycloidal.ply", "featuretype.STL", "busted.STL", "triple_vierbein.obj", "moebius.obj",
       "self_intersectA.obj")


class Attack(ToolTest):
    def worst_ratio(self, mesh, samples):
        """The largest ratio of an error bound to the farthest sample, of all levels whose bounds are above rounding."""
        result = self.build(mesh, "-o", self.out, "--levels", "auto", "--effort", "fast", timeout=600)
        self.assertEqual(result.returncode, DONE, result.stderr)
        verified = self.info("--verify", "--levels", self.out, timeout=600)
        self.assertEqual((verified.returncode, verified.stderr), (DONE, b""))
        result = self.run_tool(LEVEL_SAMPLES, str(samples), self.out, timeout=7200)
        print(result.stdout.decode(), flush=True)
        self.assertEqual(result.returncode, DONE, result.stderr)
        rows = LINE.findall(result.stdout.decode())
        file = bvh_file.read(self.out)
        self.assertEqual(len(rows), len(file.levels) - 1)
        rounding = np.abs([file.lower, file.upper]).max() * 2.0**-20
        self.assertEqual({violations for *_, violations in rows}, {"0"})
        return max((float(ratio) for _, _, bound, ratio, *_ in rows if float(bound) > rounding), default=1)


class OwnAssets(Attack):
    def test_no_sample_is_beyond_an_error_bound(self):
        for name in ("cow_1500.obj", "ground.obj"):
            with self.subTest(mesh=name):
                self.assertLessEqual(self.worst_ratio(SOURCE_DIR / "assets" / name, 300_000), 1.2)


class SharedMeshes(Attack):
    def test_no_sample_is_beyond_an_error_bound_which_is_little_more_than_the_farthest(self):
        ratios = {name: self.worst_ratio(MESHES / name, 10_000_000) for name in TEN}
        print(ratios)
        self.assertLessEqual(max(ratios.values()), 1.2)
        self.assertGreaterEqual(sum(ratio <= 1.05 for ratio in ratios.values()), 8)


if __name__ == "__main__":
    if sys.argv[1:] == ["SharedMeshes"] and not (os.environ.get("TANDEM_LONG") and all((MESHES / name).is_file() for name in TEN)):
        print(f"needs TANDEM_LONG=1 and the meshes of {MESHES} (TANDEM_MESHES)")
        sys.exit(SKIPPED)
    unittest.main()
