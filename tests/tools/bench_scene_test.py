#!/usr/bin/python3
"""bvhbench scene from the outside: what is in its files, and what it refuses. Environment: that of bench_test.py."""
import unittest

import h5py
import numpy as np

from bench_test import IDENTITY, BenchTest, datasets, table_of
from tool_test import CUBE_OBJ, UNREADABLE_INPUT, USAGE

SHEET_OBJ = "v -30 -30 0\nv 30 -30 0.5\nv 30 30 0\nv -30 30 0.5\nf 1 2 3\nf 1 3 4\n"


class Scenes(BenchTest):
    KINDS = {"stack": ["--count", "27"], "pile": ["--count", "60"], "coincident": ["--count", "5"], "lattice": ["--count", "30"],
             "slide": ["--count", "20", "--ground", None], "field": ["--fixed", "70", "--count", "27"]}

    def arguments(self, kind):
        sheet = self.mesh_of("sheet", SHEET_OBJ)
        return [sheet if word is None else word for word in self.KINDS[kind]]

    def places(self, scene=None):
        return datasets(scene or self.scene)["instances/translation"]

    def test_the_same_arguments_give_the_same_bytes_and_another_seed_other_poses(self):
        other = self.outputs / "other.h5"
        for kind in self.KINDS:
            with self.subTest(kind):
                arguments = self.arguments(kind)
                self.make(kind, *arguments)
                self.make(kind, *arguments, out=other)
                self.assertEqual(self.scene.read_bytes(), other.read_bytes())
                self.make(kind, *arguments, "--seed", "2", out=other)
                self.assertTrue((self.places() != self.places(other)).any())

    def test_poses_are_rigid_and_shapes_are_as_documented(self):
        for kind in self.KINDS:
            with self.subTest(kind):
                text = self.make(kind, *self.arguments(kind))
                with h5py.File(self.scene) as file:
                    rotation, count = file["instances/rotation"][:], len(file["instances/asset"])
                    self.assertEqual(file["instances/asset"].dtype, "u4")
                    self.assertEqual((rotation.shape, rotation.dtype), ((count, 3, 3), "f8"))
                    self.assertEqual(file["instances/translation"].shape, (count, 3))
                    self.assertEqual(file["assets"].asstr()[0], "../in/cube.bvh")
                product = rotation.transpose(0, 2, 1) @ rotation
                self.assertLess(np.abs(product - IDENTITY).max(), 1e-14)
                self.assertTrue((np.linalg.det(rotation) > 0.99).all())
                self.assertIn(f"{count} instances", text)

    def test_an_offset_is_added_to_every_translation(self):
        other = self.outputs / "other.h5"
        for kind in self.KINDS:
            self.make(kind, *self.arguments(kind))
            self.make(kind, *self.arguments(kind), "--offset", "-1000.5", "2e6", "3", out=other)
            self.assertTrue(np.allclose(self.places(other), self.places() + [-1000.5, 2e6, 3], rtol=1e-15, atol=1e-9))

    def test_faces_of_an_exact_stack_coincide_wherever_it_stands(self):
        corners, quads = CUBE_OBJ.split("f", 1)
        self.mesh = self.mesh_of("odd", corners.replace(" 1", " 1.1") + "f" + quads)
        page = self.info_json(self.mesh)
        for offset in (("0", "0", "0"), ("1234567.8", "-0.3", "1e-3")):
            self.make("stack", "--count", "64", "--exact", "--offset", *offset)
            translation = self.places()
            for axis, start in enumerate(map(float, offset)):
                row = np.unique(translation[:, axis])
                self.assertEqual((len(row), row[0]), (4, start))
                placed = page["origin"][axis] + row
                lower, upper = (page["bounds"][end][axis] for end in ("lower", "upper"))
                self.assertEqual((upper + placed[:-1]).tolist(), (lower + placed[1:]).tolist())
            neighbours = 3 * 3 * 16 + 6 * 9 * 4 + 4 * 27  # across faces, edges, corners
            self.assertEqual(self.query()["object_pairs"], neighbours)

    def test_a_jittered_stack_touches_its_neighbours_alone(self):
        self.make("stack", "--count", "27", "--jitter", "0.01")
        moved = self.places() - np.round(self.places())
        self.assertTrue((datasets(self.scene)["instances/rotation"] == IDENTITY).all())
        self.assertLessEqual(np.abs(moved).max(), 0.01)
        self.assertGreater(np.abs(moved).max(), 0.005)

    def test_a_pile_has_the_wanted_neighbours(self):
        for wanted in (2, 6.5):
            self.make("pile", "--count", "2000", "--neighbours", str(wanted))
            found = 2 * self.query("--mode", "boxes")["object_pairs"] / 2000
            self.assertLess(abs(found / wanted - 1), 0.01)

    def test_every_body_of_a_slide_touches_the_ground_and_lies_above_it(self):
        self.make("slide", *self.arguments("slide"), "--tilt", "15")
        self.query("--out", self.contacts)
        table = table_of(self.contacts)
        touched = table["pairs"][np.unique(table["contacts/pair"])]
        scene = datasets(self.scene)
        self.assertEqual(scene["instances/asset"].tolist(), [1] + [0] * 20)
        normal = scene["instances/rotation"][0][:, 2]
        self.assertEqual(sorted(touched[touched[:, 0] == 0][:, 1]), list(range(1, 21)))
        self.assertAlmostEqual(normal[0], np.sin(np.radians(15)))

    def test_a_slide_of_many_bodies_has_several_sheets_that_do_not_touch(self):
        arguments = self.arguments("slide")
        arguments[1] = "8000"
        self.make("slide", *arguments)
        self.assertEqual((datasets(self.scene)["instances/asset"] == 1).sum(), 4)
        self.query("--out", self.contacts)
        self.assertGreaterEqual(table_of(self.contacts)["pairs"][:, 1].min(), 4)

    def test_coincident_pairs_share_a_pose_and_touch_no_others(self):
        self.make("coincident", "--count", "5")
        for column in datasets(self.scene, "instances/rotation", "instances/translation").values():
            self.assertTrue((column[0::2] == column[1::2]).all())
        self.query("--out", self.contacts)
        self.assertEqual(table_of(self.contacts)["pairs"].tolist(), [[2 * i, 2 * i + 1] for i in range(5)])

    def test_wrong_arguments_are_told(self):
        self.assert_fails(self.bench("scene"), USAGE)
        self.assert_fails(self.bench("scene", "heap"), USAGE)
        sheet = self.mesh_of("sheet", SHEET_OBJ)
        for kind, words, told in (("stack", ["--count", "1001"], "1000"), ("stack", ["--count", "0"], "--count"),
                                  ("stack", ["--jitter", "nan"], "--jitter"),
                                  ("stack", ["--exact", "--jitter", "0.1"], "--exact"), ("stack", ["--seed", "-1"], "--seed"),
                                  ("stack", ["--offset", "1", "2"], "--offset"),
                                  ("stack", ["--offset", "1", "2", "inf"], "--offset"),
                                  ("pile", ["--neighbours", "0"], "--neighbours"),
                                  ("pile", ["--count", "3"], "3 bodies"), ("slide", [], "--ground"),
                                  ("slide", ["--ground", self.mesh], "too small"),
                                  ("slide", ["--ground", sheet, "--tilt", "91"], "--tilt")):
            with self.subTest(words=words):
                result = self.bench("scene", kind, "--mesh", self.mesh, "-o", self.scene, *words)
                self.assert_fails(result, USAGE, told)
        self.assert_nothing_written()

    def test_a_mesh_is_not_overwritten_by_its_scene(self):
        before = self.mesh.read_bytes()
        self.assert_fails(self.bench("scene", "pile", "--mesh", self.mesh, "-o", self.mesh), USAGE, "would be overwritten")
        self.assertEqual(self.mesh.read_bytes(), before)

    def test_a_mesh_that_cannot_be_read_is_named(self):
        for path, told in ((self.inputs / "none.bvh", "no such file"), (self.write("cube.obj", CUBE_OBJ), "not a Tandem")):
            self.assert_fails(self.bench("scene", "pile", "--mesh", path, "-o", self.scene), UNREADABLE_INPUT, path, told)
        self.assert_nothing_written()


if __name__ == "__main__":
    unittest.main()
