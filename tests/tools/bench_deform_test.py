#!/usr/bin/python3
"""bvhbench deform and query --frame from the outside, and the scenes of scripts/make_deformations.

Environment: that of bench_test.py.
"""
import csv
import json
import os
import unittest

import h5py
import numpy as np

import bvh_file
from animation_test import Worm
from bench_test import BenchTest, change, documented_keys, table_of
from tool_test import BVHBUILD, CUBE_OBJ, SOURCE_DIR, UNREADABLE_INPUT, USAGE, grid_ply

ENGINES = ("embree", "embree-refit", "fcl", "bullet")
FACES = [line.split()[1:] for line in CUBE_OBJ.split("\n") if line.startswith("f")]
CUBE_TRIANGLES = [[a, *pair] for a, b, c, d in FACES for pair in ((b, c), (c, d))]
CUBE = np.array([line.split()[1:] for line in CUBE_OBJ.split("\n") if line.startswith("v")], float)


def cube_obj(positions):
    """A cube of triangles whose corners are elsewhere."""
    return "".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in positions) + "".join(f"f {' '.join(face)}\n" for face in CUBE_TRIANGLES)


class DeformBenchTest(BenchTest):
    """The cube is one of triangles, which bend as they are."""

    def setUp(self):
        super().setUp()
        self.mesh = self.mesh_of("cube", cube_obj(CUBE))

    def write_frames(self, *frames, second=None, **datasets):
        """Two cubes, a quarter apart along every axis, of which the first, or both, have these positions frame by frame."""
        bodies = {0: np.array(frames)} | ({} if second is None else {1: np.array(second)})
        self.write_scene(assets=("../in/cube.bvh",) * 2, asset=(0, 1), translation=((0, 0, 0), (0.25, 0.25, 0.25)),
                         **{f"deformations_{body}": positions for body, positions in bodies.items()}, **datasets)

    def deform(self, *arguments, scene=None):
        return json.loads(self.passes("deform", scene or self.scene, "--json", *arguments))

    def assert_deform_fails(self, code, *words, arguments=()):
        self.assert_fails(self.bench("deform", self.scene, *arguments), code, *words)


class Deform(DeformBenchTest):
    def test_every_frame_has_the_contacts_of_a_mesh_of_its_positions(self):
        random = np.random.default_rng(3)
        frames = [CUBE, *(CUBE + 0.3 * random.random((5, 8, 3)))]
        for kind in (np.float32, np.float64):
            frames = np.array(frames, kind)
            self.write_frames(*frames)
            told = self.deform("--rebuild")
            counts = [frame["contacts"] for frame in told["peers"][0]["each_frame"]]
            self.assertEqual([frame["contacts"] for frame in told["peers"][1]["each_frame"]], counts)
            if kind == np.float64:  # which no file holds
                continue
            for number, positions in enumerate(frames):
                self.succeeds(BVHBUILD, self.write("bent.obj", cube_obj(positions)), "-o", self.inputs / "bent.bvh")
                self.write_scene(assets=("../in/bent.bvh", "../in/cube.bvh"), asset=(0, 1), translation=((0, 0, 0), (0.25, 0.25, 0.25)))
                self.assertEqual(self.query()["contacts"], counts[number], number)

    def test_query_takes_a_frame(self):
        self.write_frames(CUBE, CUBE + 10, CUBE / 2 + 0.5)
        told = self.deform()["peers"][0]["each_frame"]
        self.assertEqual(told[1]["contacts"], 0)
        for frame in range(3):
            report = self.query("--frame", str(frame), "--out", self.contacts)
            self.assertEqual((report["frame"], report["contacts"]), (frame, told[frame]["contacts"]))
            self.assertEqual(len(table_of(self.contacts)["contacts/pair"]), report["contacts"])
        self.assertEqual(self.query()["contacts"], told[0]["contacts"])
        for other in ("--contained", "--at=0 0 0", "--tolerance=1"):
            arguments = other.replace("=", " ", 1).split()
            self.assert_fails(self.bench("query", self.scene, "--frame", "0", *arguments), USAGE, "do not go with it" if "tol" in other else "--frame")
        self.assert_fails(self.bench("query", self.scene, "--frame", "3"), USAGE, "has 3 frames, so there is no frame 3")

    def test_assets_that_are_listed_twice_bend_by_themselves(self):
        self.write_frames(CUBE, CUBE, second=(CUBE, CUBE + 5))
        self.assertEqual([frame["contacts"] > 0 for frame in self.deform("--rebuild")["peers"][0]["each_frame"]], [True, False])

    def test_a_body_without_area_has_no_rebuilt_tree(self):
        self.write_frames(CUBE, CUBE * 0 + 0.5, CUBE)
        told = self.deform("--rebuild")
        self.assertEqual((told["frames"], told["common_frames"]), (3, 2))
        self.assertEqual([frame is None for frame in told["peers"][1]["each_frame"]], [False, True, False])
        self.assertEqual([frame is None for frame in told["peers"][0]["each_frame"]], [False] * 3)

    def test_peers_find_as_many_contacts(self):
        built = [name for name in ENGINES if b"is none of" not in self.bench("deform", "x", "--peers", name).stderr]
        self.write("sheet.ply", grid_ply(12))
        mesh = self.inputs / "sheet.bvh"
        self.succeeds(BVHBUILD, self.inputs / "sheet.ply", "-o", mesh)
        file = bvh_file.read(mesh)
        rest = np.zeros((file.source_vertex_count, 3), np.float32)
        rest[file.source_vertices[file.topology["vertex"]]] = file.corners
        frames = np.stack([rest + [0, 0, height] for height in (0, 0.25, 0.5)]).astype("f4")
        frames[:, :, 2] += 0.37 * frames[:, :, 0]
        self.write_scene(assets=("../in/sheet.bvh",) * 2, asset=(0, 1), translation=((0, 0, 0), (0, 0.4, 2.3)), deformations_0=frames)
        told = self.deform("--peers", ",".join(built)) if built else self.deform()
        self.assertEqual(len(told["peers"]), 1 + len(built))
        for peer in told["peers"]:
            if peer["name"] == "Bullet":  # its boxes do not leave the bounds that they were built with
                continue
            with self.subTest(peer=peer["name"]):
                self.assertGreater(peer["contacts"], 10)
                self.assertAlmostEqual(peer["contacts"], told["peers"][0]["contacts"])

    def test_the_csv_file_has_a_row_for_each_peer_and_frame(self):
        self.write_frames(CUBE, CUBE * 1.5, CUBE)
        out = self.outputs / "frames.csv"
        self.passes("deform", self.scene, "--rebuild", "--frames", "2", "--repeat", "2", "--out", out)
        with open(out, newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([(row["scene"], row["peer"], row["frame"]) for row in rows],
                         [("scene", peer, frame) for peer in ("Tandem exact", "Tandem rebuilt") for frame in "01"])
        page = (SOURCE_DIR / "docs/scenes.md").read_text(encoding="utf-8").partition("### Frames file")[2]
        self.assertEqual([line.split("`")[1] for line in page.partition("\n#")[0].split("\n") if line.startswith("- `")], list(rows[0]))
        self.assertEqual([rows[0]["block_pairs"], rows[0]["looseness"]], [rows[2]["block_pairs"], "1"])

    def test_the_keys_of_json_are_those_of_its_documentation(self):
        self.write_frames(CUBE, CUBE)
        told, keys = self.deform("--rebuild"), documented_keys("deform", "\n\n[*][*]")
        self.assertEqual([list(told), list(told["peers"][0]), list(told["peers"][0]["each_frame"][0])], keys)

    def test_self_contacts_are_asked_for(self):
        flat = CUBE * [1, 1, 0]
        self.write_frames(CUBE, flat)
        alone, both = self.deform("--rebuild")["peers"][0], self.deform("--rebuild", "--self")["peers"][0]
        self.assertGreater(both["contacts"], alone["contacts"])
        self.assert_deform_fails(USAGE, "--self is for Tandem alone", arguments=("--self", "--peers", "fcl"))

    def test_frames_that_do_not_fit_are_refused(self):
        self.write_frames(CUBE[:7])
        self.assert_deform_fails(UNREADABLE_INPUT, self.scene, "/deformations/0", "expected n x 8 x 3, found 1 x 7 x 3")
        self.write_frames(CUBE, CUBE, second=[CUBE])
        self.assert_deform_fails(UNREADABLE_INPUT, "/deformations/1", "1 frames", "/deformations/0 has 2")
        self.write_frames(CUBE)
        self.assert_deform_fails(USAGE, "has 1 frames, not 2", arguments=("--frames", "2"))
        change(self.scene, deformations_0=np.zeros((0, 8, 3)))
        self.assert_deform_fails(UNREADABLE_INPUT, "/deformations/0", "0 frames")
        self.assert_deform_fails(USAGE, "--frames", arguments=("--frames", "0"))
        for name in ("2", "01", "x"):
            self.write_frames(CUBE, **{f"deformations_{name}": np.array([CUBE])})
            self.assert_deform_fails(UNREADABLE_INPUT, f"/deformations/{name}", "none of 2 assets")
        self.write_frames(CUBE)
        change(self.scene, deformations_0=np.full((1, 8, 3), "x", dtype=h5py.string_dtype()))
        self.assert_deform_fails(UNREADABLE_INPUT, "/deformations/0", "expected floating-point numbers, found strings")
        self.write_scene()
        self.assert_deform_fails(UNREADABLE_INPUT, self.scene, "/deformations", "there is none")

    def test_positions_that_are_no_numbers_are_refused(self):
        for bad in (np.nan, np.inf, 1e39):
            frames = np.array([CUBE, CUBE])
            frames[1, 5, 2] = bad
            self.write_frames(*frames)
            self.assert_deform_fails(UNREADABLE_INPUT, self.scene, "frame 1", "vertex 5")

    def test_an_asset_without_source_vertices_is_refused(self):
        self.succeeds(BVHBUILD, self.write("plain.obj", CUBE_OBJ), "-o", self.inputs / "plain.bvh", "--no-refit")
        self.write_scene(assets=("../in/plain.bvh",), deformations_0=np.array([CUBE]))
        self.assert_deform_fails(UNREADABLE_INPUT, "/deformations/0", "plain.bvh", "--no-refit")

    def test_other_commands_ask_about_bodies_at_rest(self):
        self.write_frames(CUBE + 10)
        self.assertGreater(self.query()["contacts"], 0)
        self.assertEqual(json.loads(self.passes("distance", self.scene, "--json"))["touching"], 1)


class Animations(DeformBenchTest):
    def setUp(self):
        super().setUp()
        self.worm = self.write("worm.glb", Worm().file)

    def test_an_animation_is_followed(self):
        told = self.deform("--rebuild", "--frames", "5", scene=self.worm)
        contacts = [frame["contacts"] for frame in told["peers"][0]["each_frame"]]
        self.assertEqual((told["frames"], told["triangles"]), (5, len(Worm().faces)))
        self.assertEqual([frame["contacts"] for frame in told["peers"][1]["each_frame"]], contacts)
        self.assertGreater(min(contacts), 0)
        self.assertGreater(len(set(contacts)), 1)
        with_self = self.deform("--rebuild", "--self", "--leave-out-rings", "1", "--frames", "5", scene=self.worm)
        self.assertGreater(with_self["peers"][0]["contacts"], told["peers"][0]["contacts"])

    def test_the_tree_of_a_file_gives_the_same_contacts(self):
        for options in ((), ("--animation",)):
            self.succeeds(BVHBUILD, self.worm, "-o", self.out, *options)
            built, of_file = (self.deform("--frames", "4", *arguments, scene=self.worm)["peers"][0] for arguments in ((), ("--asset", self.out)))
            self.assertEqual(*([frame["contacts"] for frame in peer["each_frame"]] for peer in (built, of_file)))

    def test_what_is_refused(self):
        self.assert_fails(self.bench("deform", self.worm, "--asset", self.mesh), UNREADABLE_INPUT, "cube.bvh", "is of 8 vertices")
        self.assert_fails(self.bench("deform", self.write("none.glb", b"glTF")), UNREADABLE_INPUT, "none.glb")
        self.write_frames(CUBE)
        self.assert_deform_fails(USAGE, "--asset is for animations", arguments=("--asset", self.mesh))


class MadeDeformations(DeformBenchTest):
    def test_every_kind_has_contacts_in_most_frames(self):
        cow, ground = (self.inputs / f"{name}.bvh" for name in ("cow_1500", "sheet"))
        self.succeeds(BVHBUILD, SOURCE_DIR / "assets/cow_1500.obj", "-o", cow)
        self.write("sheet.ply", grid_ply(20))
        self.succeeds(BVHBUILD, self.inputs / "sheet.ply", "-o", ground)
        script = SOURCE_DIR / "scripts/make_deformations"
        for kind in ("twist", "fold", "tear", "inflate", "collapse", "wave", "walk", "morph", "cloth"):
            with self.subTest(kind=kind):
                self.succeeds("/usr/bin/python3", script, kind, ground if kind == "cloth" else cow, "-o", self.scene, "--frames", "6", *(["--both"] if kind == "wave" else []))
                told = self.deform("--rebuild")
                self.assertEqual(told["triangles"], {"cloth": 800, "wave": 3000}.get(kind, 1500))
                self.assertGreaterEqual(sum(frame["contacts"] > 0 for frame in told["peers"][0]["each_frame"]), 4)

    def test_a_mesh_without_source_vertices_is_refused(self):
        plain = self.inputs / "plain.bvh"
        self.succeeds(BVHBUILD, self.write("plain.obj", CUBE_OBJ), "-o", plain, "--no-refit")
        result = self.run_tool("/usr/bin/python3", SOURCE_DIR / "scripts/make_deformations", "fold", plain, "-o", self.scene)
        self.assertEqual((result.returncode, self.scene.exists()), (2, False))
        self.assertIn(b"has no source vertices", result.stderr)

    def test_the_peer_on_a_gpu_is_skipped_aloud_where_it_is_not_installed(self):
        self.write_frames(CUBE)
        self.write("warp.py", "raise ImportError('no warp here')")
        result = self.run_tool("/usr/bin/python3", SOURCE_DIR / "scripts/deform_peers", self.scene, "--out", self.out, env={**os.environ, "PYTHONPATH": str(self.inputs)})
        self.assertEqual((result.returncode, result.stderr, self.out.exists()), (77, b"deform_peers: skipped: no warp here\n", False))


if __name__ == "__main__":
    unittest.main()
