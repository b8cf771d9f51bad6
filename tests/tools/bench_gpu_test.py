#!/usr/bin/python3
"""bvhbench query, impact, deform and simulate --backend cuda from the outside. Environment: that of bench_test.py."""
import json
import os
import re
import subprocess
import unittest

import h5py
import numpy as np

from bench_test import BVHBENCH, IDENTITY, BenchTest, table_of
from tool_test import DONE, SOURCE_DIR, UNREADABLE_INPUT, UNUSABLE_GPU, USAGE


class BenchGpu(BenchTest):
    """The backend cuda: with a GPU, without one, and where bvhbench was built without CUDA."""

    ON_GPU = ("--backend", "cuda")

    def setUp(self):
        super().setUp()
        self.built = "--backend cpu|cuda" in self.passes("query", "--help")

    def test_without_a_gpu_the_reason_is_told(self):
        self.write_scene()
        hidden = {**os.environ, "CUDA_VISIBLE_DEVICES": ""}
        if self.built:
            self.assert_refused_on_gpu("there is no GPU that can be used: ", env=hidden)
        else:
            result = self.bench("query", self.scene, *self.ON_GPU, env=hidden)
            self.assert_fails(result, USAGE, "built without CUDA")

    def test_a_driver_that_is_too_old_is_told_with_its_version(self):
        if not self.built:
            self.skipTest("built without CUDA")
        self.write_scene()
        libraries = f"{os.environ['TANDEM_OLD_DRIVER']}:{os.environ.get('LD_LIBRARY_PATH', '')}"
        self.assert_refused_on_gpu("the GPU's driver is too old", "it is for CUDA 8.0", env={**os.environ, "LD_LIBRARY_PATH": libraries})

    def assert_refused_on_gpu(self, *words, **options):
        for engine in ("tandem", "paper"):
            result = self.bench("query", self.scene, *self.ON_GPU, "--engine", engine, "--out", self.contacts, **options)
            self.assert_fails(result, UNUSABLE_GPU, "--backend cuda: ", *words)
            self.assertFalse(self.contacts.exists())
        result = self.bench("impact", self.scene, "--dt", "1", *self.ON_GPU, "--out", self.contacts, **options)
        self.assert_fails(result, UNUSABLE_GPU, "--backend cuda: ", *words)
        self.assertFalse(self.contacts.exists())

    def bend(self, mesh, kind, frames=6, number=np.float32):
        """A scene of a mesh that bends, and a rigid one in it."""
        self.mesh_of(mesh, (SOURCE_DIR / f"assets/{mesh}.obj").read_text())
        path = self.inputs / f"{kind}.h5"
        done = subprocess.run([SOURCE_DIR / "scripts/make_deformations", kind, self.inputs / f"{mesh}.bvh", "-o", path, "--frames", str(frames)], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with h5py.File(path, "r+") as file:
            positions = file["deformations/0"][:].astype(number)
            del file["deformations/0"]
            file["deformations/0"] = positions
        return path

    def test_deform_tells_why_there_is_no_gpu_and_which_options_are_for_the_cpu(self):
        scene, csv = self.bend("box_192", "wave"), self.inputs / "frames.csv"
        result = self.bench("deform", scene, *self.ON_GPU, "--rebuild", "--out", csv, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})
        if not self.built:
            return self.assert_fails(result, USAGE, "built without CUDA")
        self.assert_fails(result, UNUSABLE_GPU, "--backend cuda: there is no GPU that can be used: ")
        self.assertFalse(csv.exists())
        for words in (["--self"], ["--threads", "2"]):
            self.assert_fails(self.bench("deform", scene, *self.ON_GPU, *words), USAGE, words[0], "backend cpu")
        self.assert_fails(self.bench("deform", scene, "--peers", "tandem-cuda"), USAGE, "tandem-cuda is none of")

    def test_deformed_bodies_on_the_gpu_have_the_contacts_of_rebuilt_trees(self):
        self.need_gpu()
        for kind, number in (("twist", np.float32), ("collapse", np.float32), ("wave", np.float64)):
            scene = self.bend("cow_1500", kind, number=number)
            expected, told = (json.loads(self.passes("deform", scene, "--rebuild", "--repeat", "2", "--json", *words)) for words in ([], self.ON_GPU))
            self.assertEqual((told["backend"], told["threads"], told["worst_block_pairs"], told["peers"][0]["name"]), ("cuda", 0, None, "Tandem GPU"))
            counts = [[frame["contacts"] for frame in report["peers"][0]["each_frame"]] for report in (expected, told)]
            self.assertEqual(*counts)
            self.assertTrue(all(frame["update_nanoseconds"] > 0 and frame["query_seconds"] > 0 for frame in told["peers"][0]["each_frame"]))
            if kind == "twist":
                self.assertGreater(len(set(counts[0])), 2)

    def test_options_of_another_backend_or_engine_are_refused(self):
        if not self.built:
            self.skipTest("built without CUDA")
        self.write_scene()
        for words in ([*self.ON_GPU, "--self"], [*self.ON_GPU, "--threads", "2"], ["--engine", "paper"], ["--sorted"], ["--grouped"],
                      ["--traversal"], *([*self.ON_GPU, "--engine", "paper", word] for word in ("--first-contact", "--grouped", "--sorted", "--traversal")),
                      [*self.ON_GPU, "--engine", "paper", "--within", "2"],
                      [*self.ON_GPU, "--sorted", "--grouped"]):
            with self.subTest(words=words):
                self.assert_fails(self.bench("query", self.scene, *words), USAGE, words[-2] if words[-1] == "2" else "--")

        self.assert_fails(self.bench("impact", self.scene, "--dt", "1", *self.ON_GPU, "--threads", "2"), USAGE, "--threads")

    def simulate(self, *arguments, out, **options):
        cow, ground = (self.mesh_of(name, (SOURCE_DIR / f"assets/{name}.obj").read_bytes()) for name in ("cow_1500", "ground"))
        return self.bench("simulate", "pile", "--mesh", cow, "--ground", ground, "--count", "20", *arguments, "-o", out, **options)

    def contents(self, path):
        """All of a run file but what is measured."""
        found = {}
        with h5py.File(path) as file:
            file.visititems(lambda name, item: found.update({name: item[:].tobytes()}) if isinstance(item, h5py.Dataset) and "/seconds/" not in name else None)
        return found

    def test_simulate_tells_why_there_is_no_gpu_and_which_options_are_for_the_cpu(self):
        out = self.outputs / "run.h5"
        result = self.simulate("--frames", "1", *self.ON_GPU, out=out, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})
        if not self.built:
            return self.assert_fails(result, USAGE, "built without CUDA")
        self.assert_fails(result, UNUSABLE_GPU, "--backend cuda: there is no GPU that can be used: ")
        for words in (["--solver", "sweeps"], ["--engine", "fcl"], ["--fast"], ["--ask-all"], ["--cold"], ["--threads", "2"]):
            self.assert_fails(self.simulate("--frames", "1", *self.ON_GPU, *words, out=out), USAGE, words[0], "backend cpu")
        self.assertFalse(out.exists())

    def test_a_pile_on_the_gpu_comes_to_rest_as_on_the_cpu(self):
        self.need_gpu()
        ends = []
        for words in (["--solver", "soft"], ["--solver", "soft", *self.ON_GPU]):
            out = self.outputs / f"{len(words)}.h5"
            result = self.simulate("--frames", "360", "--sleep", *words, out=out)
            self.assertEqual((result.returncode, result.stderr), (DONE, b""))
            with h5py.File(out) as file:
                start = file["frames/potential_energy"][0]
                ends.append({name: file[f"frames/{name}"][-1] for name in ("sleeping", "contacts", "potential_energy", "penetration_max", "speed_max", "kinetic_energy")})
                self.assertGreater(file["frames/triangle_pairs"][:].max(), 100)
        cpu, gpu = ends
        self.assertEqual((cpu["sleeping"], gpu["sleeping"], gpu["speed_max"], gpu["kinetic_energy"]), (20, 20, 0, 0))
        # Heaps on rough ground part: a change of friction by a few thousandths moves the end by up to 5 % of what falling gives.
        self.assertAlmostEqual((start - gpu["potential_energy"]) / (start - cpu["potential_energy"]), 1, delta=0.1)

    def test_a_run_on_the_gpu_goes_on_to_the_same_bytes(self):
        self.need_gpu()
        whole, part = self.outputs / "whole.h5", self.outputs / "part.h5"
        self.simulate("--frames", "120", *self.ON_GPU, out=whole)
        self.simulate("--frames", "50", *self.ON_GPU, out=part)
        part.rename(f"{part}.part")
        self.simulate("--frames", "120", "--resume", *self.ON_GPU, out=part)
        expected, found = self.contents(whole), self.contents(part)
        # How many pairs are known to be apart depends on how far the last searches looked.
        names = [name for name in expected if not name.startswith("state/apart/")]
        self.assertEqual([name for name in names if expected[name] != found[name]], [])
        self.assertGreater(len(expected["state/contacts/depth"]), 100)

    def need_gpu(self):
        self.write_scene()
        if self.bench("query", self.scene, *self.ON_GPU).returncode != DONE:
            self.skipTest("no GPU can be used")

    def test_impacts_on_the_gpu_are_those_of_the_cpu_but_for_the_tolerance(self):
        self.need_gpu()
        self.make("pile", "--count", "60")
        random = np.random.default_rng(1)
        with h5py.File(self.scene, "r+") as file:
            file["/simulation/velocity"] = random.normal(size=(60, 3))
            file["/simulation/angular_velocity"] = random.normal(size=(60, 3))
        tables = []
        for words in ([], [*self.ON_GPU, "--repeat", "2"]):
            self.passes("impact", self.scene, "--dt", "0.5", "--out", self.contacts, *words)
            with h5py.File(self.contacts) as file:
                tables.append({name: file[name][:] for name in ("pairs", "impact/status", "impact/t_safe")})
        cpu, gpu = tables
        self.assertEqual(gpu["pairs"].tolist(), cpu["pairs"].tolist())
        self.assertEqual(gpu["impact/status"].tolist(), cpu["impact/status"].tolist())
        np.testing.assert_allclose(gpu["impact/t_safe"], cpu["impact/t_safe"], atol=1e-4)

    def test_the_gpu_finds_what_the_cpu_finds(self):
        self.need_gpu()
        self.make("pile", "--count", "60")
        for mode in ("exact", "fast", "boxes"):
            expected = self.query("--mode", mode, "--out", self.contacts)
            contacts = table_of(self.contacts)
            report = self.query("--mode", mode, "--repeat", "3", "--out", self.contacts, *self.ON_GPU)
            self.assertEqual((report["hash"], report["backend"]), (expected["hash"], "cuda"))
            self.assertEqual(len(report["contacts_seconds"]["all"]), 3)
            for name, column in table_of(self.contacts).items():
                self.assertEqual(column.tolist(), contacts[name].tolist())
            clearance = self.query("--mode", mode, "--within", "0.1")
            self.assertGreater(clearance["contacts"], expected["contacts"])
            report = self.query("--mode", mode, "--within", "0.1", "--repeat", "3", *self.ON_GPU)
            self.assertEqual((report["hash"], report["within"]), (clearance["hash"], 0.1))
            self.assertLessEqual(report["gpu_bytes"], report["gpu_bytes_bound"])
        exact = self.query()["hash"]
        self.assertEqual(self.query("--engine", "paper", *self.ON_GPU)["hash"], exact)
        self.assertEqual(self.query("--grouped", "--repeat", "2", *self.ON_GPU)["hash"], exact)
        report = self.query("--sorted", "--traversal", "--repeat", "2", *self.ON_GPU)
        self.assertEqual((report["hash"], len(report["traversal_seconds"]["all"])), (exact, 2))
        self.assertLessEqual(report["gpu_bytes"], report["gpu_bytes_bound"])

    def test_the_gpu_heeds_filters_as_the_cpu_does(self):
        self.need_gpu()
        self.make("field", "--fixed", "400", "--count", "64")
        random = np.random.default_rng(3)
        with h5py.File(self.scene, "a") as file:
            file["simulation/motion"][400:] = random.integers(0, 4, 64)
            file["instances/group"] = random.integers(0, 8, 464)
            file["instances/mask"] = random.integers(0, 8, 464)
            file["excluded"] = random.integers(400, 464, (200, 2))
        for clearance in ("0", "0.1"):
            expected = self.query("--within", clearance)
            self.assertGreater(expected["object_pairs"], 0)
            for words in ([], ["--sorted"]):
                report = self.query("--repeat", "3", "--within", clearance, *words, *self.ON_GPU)
                self.assertEqual((report["hash"], report["object_pairs"]), (expected["hash"], expected["object_pairs"]))
                self.assertLessEqual(report["gpu_bytes"], report["gpu_bytes_bound"])

    def test_gpu_memory_that_runs_out_is_told(self):
        self.need_gpu()
        self.make("lattice", "--count", "3000", "--spacing", "0.01")  # 4.5 million object pairs, 800 MB
        for megabytes in ("0", "1200"):
            command = [os.environ["TANDEM_FULL_GPU"], megabytes, BVHBENCH, "query", self.scene, *self.ON_GPU, "--mode", "boxes"]
            result = self.run_tool(*map(os.fspath, command))
            self.assertEqual((result.returncode, result.stdout), (UNUSABLE_GPU, b""))
            self.assertRegex(result.stderr, rb"^bvhbench: --backend cuda: [a-z ]+: not enough GPU memory")

    def test_the_gpu_names_the_instance_that_is_wrong(self):
        self.need_gpu()
        for pairs in ({}, {"pairs": np.array([[0, 1]], "u4")}):
            self.write_scene(rotation=(IDENTITY, 2 * IDENTITY), **pairs)
            self.assert_refused(UNREADABLE_INPUT, self.scene, "instance 1: a pose is not a rotation", arguments=self.ON_GPU)

    def test_the_keys_of_json_are_those_of_its_documentation(self):
        page = (SOURCE_DIR / "docs" / "gpu.md").read_text()
        added = [key for line in page.split("\n") if line.startswith("| `") and "`k" not in line
                 for key in re.findall(r"`(\w+)`", line.split("|")[1])]
        self.need_gpu()
        self.assertEqual(list(self.query(*self.ON_GPU)), [*self.query(), *added])


if __name__ == "__main__":
    unittest.main()
