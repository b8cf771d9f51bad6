#!/usr/bin/python3
"""Scenes through the C interface: as many pairs and contacts as bvhbench query finds, with the same hash. And what the builder makes in memory: the
bytes that bvhbuild writes."""
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py

from scene_text import as_text

ROOT = Path(os.environ["TANDEM_SOURCE_DIR"])
BVHBUILD, BVHBENCH = os.environ["TANDEM_BVHBUILD"], os.environ["TANDEM_BVHBENCH"]
SCENE_HASH, BUILD_FILE = os.environ["TANDEM_SCENE_HASH"], os.environ["TANDEM_BUILD_FILE"]
MODES = {"exact": 0, "fast": 1, "boxes": 2}


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class CScenesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.holder.name)
        for name in ("box_12", "cow_1500", "ground"):
            run(BVHBUILD, ROOT / f"assets/{name}.obj", "-o", cls.folder / f"{name}.bvh", "--quiet")

    @classmethod
    def tearDownClass(cls):
        cls.holder.cleanup()

    def check(self, scene, mode="exact", first=0, self_pairs=0, within=0.0, threads=1):
        words = ["--mode", mode] + ["--first-contact"] * first + ["--self"] * self_pairs + (["--within", within] if within else [])
        expected = json.loads(run(BVHBENCH, "query", self.folder / scene, "--repeat", 1, "--json", *words))
        (self.folder / "scene.txt").write_text(as_text(self.folder / scene, self.folder), encoding="utf-8")
        found = run(SCENE_HASH, self.folder / "scene.txt", MODES[mode], first, self_pairs, repr(float(within)), threads).split()
        with self.subTest(scene=scene, mode=mode, first=first, self_pairs=self_pairs, within=within, threads=threads):
            self.assertEqual(found[:2], [str(expected["object_pairs"]), str(expected["contacts"])])
            if not first:  # which of the contacts is reported is unspecified
                self.assertEqual(found[2], expected["hash"])
            self.assertGreater(expected["contacts"], 0)

    def make(self, scene, *words):
        run(BVHBENCH, "scene", *words, "-o", self.folder / scene)

    def test_piles_in_every_mode(self):
        self.make("pile.h5", "pile", "--mesh", self.folder / "cow_1500.bvh", "--count", 100)
        for threads in (1, 3):
            self.check("pile.h5", threads=threads)
        self.check("pile.h5", mode="fast")
        self.check("pile.h5", mode="boxes")
        self.check("pile.h5", first=1)
        self.check("pile.h5", within=0.02, threads=2)

    def test_instances_with_themselves(self):
        self.make("few.h5", "pile", "--mesh", self.folder / "cow_1500.bvh", "--count", 8)
        self.check("few.h5", self_pairs=1)

    def test_exact_stacks(self):
        self.make("stack.h5", "stack", "--mesh", self.folder / "box_12.bvh", "--count", 125, "--exact")
        self.check("stack.h5")

    def test_slides_of_two_assets(self):
        self.make("slide.h5", "slide", "--mesh", self.folder / "cow_1500.bvh", "--ground", self.folder / "ground.bvh", "--count", 50)
        self.check("slide.h5")

    def test_given_pairs_and_coincident_bodies(self):
        self.make("coincident.h5", "coincident", "--mesh", self.folder / "box_12.bvh", "--count", 20)
        self.check("coincident.h5")
        with h5py.File(self.folder / "coincident.h5", "r+") as file:
            file.create_dataset("pairs", data=[[4, 5], [0, 1], [2, 2]], dtype="u4")
        self.check("coincident.h5")

    def test_levels_of_detail_by_tolerance(self):
        run(BVHBUILD, ROOT / "assets/cow.obj", "-o", self.folder / "levels.bvh", "--levels", "0.5%,2%", "--effort", "fast", "--quiet")
        self.make("levels.h5", "lattice", "--mesh", self.folder / "levels.bvh", "--count", 64, "--spacing", 0.9)
        (self.folder / "levels.txt").write_text(as_text(self.folder / "levels.h5", self.folder), encoding="utf-8")
        counts = set()
        for tolerance in (0, 0.05, 0.2):
            expected = json.loads(run(BVHBENCH, "query", self.folder / "levels.h5", "--tolerance", tolerance, "--repeat", 1, "--json"))
            found = run(SCENE_HASH, self.folder / "levels.txt", 0, 0, 0, 0, 2, tolerance).splitlines()[0].split()
            self.assertEqual(found, [str(expected[key]) for key in ("apart", "touching", "within_tolerance")])
            counts.add(tuple(found))
        self.assertGreater(len(counts), 1)

    def test_filtered_fields(self):
        self.make("field.h5", "field", "--mesh", self.folder / "box_12.bvh", "--fixed", 500, "--count", 64)
        self.check("field.h5", threads=2)

    def test_the_builder_makes_the_bytes_that_bvhbuild_writes(self):
        for name, words in (("box_48", []), ("cow_1500", ["--effort", "fast"]), ("ground", []), ("box_192", ["--no-topology", "--no-gpu-blocks"]),
                            ("cow_1500", ["--effort", "fast", "--imaginary", "free"])):
            with self.subTest(name=name, words=words):
                mesh, written, made = ROOT / f"assets/{name}.obj", self.folder / "written.bvh", self.folder / "made.bvh"
                run(BVHBUILD, mesh, "-o", written, "--quiet", *words)
                flags = [int("fast" in words), int("--no-gpu-blocks" in words), int("--no-topology" in words), int("free" in words)]
                run(BUILD_FILE, ROOT / "assets", f"{name}.obj", written, made, *flags)
                self.assertEqual(written.read_bytes(), made.read_bytes())


if __name__ == "__main__":
    unittest.main()
