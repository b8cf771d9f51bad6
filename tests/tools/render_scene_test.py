#!/usr/bin/python3
"""scripts/render_scene: what stands where in its pictures.

Environment: that of tool_test.py, TANDEM_BVHBENCH, and PYTHONPATH with scripts/ and tests/common/.
"""
import importlib.machinery
import importlib.util
import os
import sys
import unittest
import unittest.mock

import matplotlib.image
import numpy as np
from PIL import Image

import render
import scene_picture
import z_buffer
from bench_test import BVHBUILD, BenchTest, change
from scene_states import Bodies, Mesh, Shape, read
from tool_test import DONE, SOURCE_DIR, UNREADABLE_INPUT

SCRIPT = os.fspath(SOURCE_DIR / "scripts/render_scene")
render_scene = importlib.util.module_from_spec(importlib.util.spec_from_loader("render_scene", importlib.machinery.SourceFileLoader("render_scene", SCRIPT)))
render_scene.__loader__.exec_module(render_scene)

SLAB_OBJ = "v -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nf 1 2 3 4\n"
FROM_X = ("--azimuth", "0", "--elevation", "0", "--width", "120", "--height", "60")  # +y is right, +z up


class RenderTest(BenchTest):
    """Each test can render, and has a cube of side 1 that begins at the origin."""

    def write_scene(self, translations, motion=None):
        count = len(translations)
        super().write_scene([0] * count, [np.eye(3)] * count, translations, simulation_motion=None if motion is None else np.array(motion, "u4"))

    def render(self, source, *arguments, name="picture.png"):
        output = self.outputs / name
        result = self.run_tool(sys.executable, SCRIPT, os.fspath(source), "-o",
                               os.fspath(output), *arguments)
        return result, output

    def drawn(self, source, *arguments, name="picture.png"):
        """The file that the script writes, in this process, which has OpenGL ready."""
        output = self.outputs / name
        with unittest.mock.patch.object(sys, "argv", [SCRIPT, *map(os.fspath, (source, "-o", output, *arguments))]):
            render_scene.main()
        return output

    def picture(self, source, *arguments):
        return matplotlib.image.imread(self.drawn(source, *arguments))[..., :3]

    def pile(self):
        cow, slab = self.mesh_of("cow", (SOURCE_DIR / "assets/cow_1500.obj").read_bytes()), self.mesh_of("slab", SLAB_OBJ)
        run = self.outputs / "run.h5"
        self.passes("simulate", "pile", "--mesh", cow, "--ground", slab, "--count", "8", "--frames", "20", "--trajectory", "10", "-o", run)
        return run

    def is_backdrop(self, picture):
        """Per pixel: whether it is as the backdrop is in the leftmost pixel of its row, which shows no body."""
        return np.abs(picture - picture[:, :1]).max(axis=2) < 0.01


class RenderedMeshes(RenderTest):
    def test_a_mesh_fills_the_width_and_edges_are_dark(self):
        mesh, output = self.inputs / "square.obj", self.outputs / "square.png"
        mesh.write_text("v 0 0 0\nv 0 1 0\nv 0 1 1\nv 0 0 1\nf 1 2 3 4\n")
        shown = []
        for edges in ([], ["--edges"]):
            self.succeeds(sys.executable, SOURCE_DIR / "scripts/render_mesh", mesh, "-o", output, "--width", "100", "--azimuth", "0", "--elevation", "0", *edges)
            shown.append(matplotlib.image.imread(output)[..., :3])
        plain, edged = shown
        self.assertEqual(plain.shape, (100, 100, 3))
        self.assertTrue((plain[[1, 98]] == 1).all() and (plain[:, [1, 98]] == 1).all())
        self.assertEqual(np.ptp(plain[4:-4, 4:-4], axis=(0, 1)).max(), 0)
        dark = (edged < plain - 0.05).all(axis=2)
        self.assertTrue(dark[50, [3, 96]].all() and dark[50, 45:55].any())
        self.assertFalse(dark[50, 10:40].any())


class RenderedSamples(RenderTest):
    def test_samples_show_the_nearest_triangle_that_holds_them(self):
        random = np.random.default_rng(1)
        corners = random.uniform([-9, -9, -4], [9, 9, 4], (60, 3, 3))
        shapes = [Shape([Mesh(points, np.array([[0, 1, 2]]), False, np.zeros(1, int), 0.0)]) for points in corners]
        camera = scene_picture.Camera(np.eye(3), np.array([0.5, -0.3, 30]), 260.0, (96, 72))
        picture = scene_picture.Picture(Bodies(shapes, np.arange(60), np.zeros(60, bool), np.tile(np.eye(3), (60, 1, 1)), np.zeros((60, 3))), camera)
        picture.draw_surfaces()
        distance = picture.seen.read(0, np.float32)[..., 3]
        shown = np.where(distance > 0, picture.seen.read(1, np.int32)[..., 0], -1)
        away = corners - camera.eye
        x, y = (size / 2 + sign * camera.focal * away[..., k] / -away[..., 2] for k, size, sign in ((0, 96, 1), (1, 72, -1)))
        inverse, nearest = z_buffer.rasterise(np.stack([x, y, -1 / away[..., 2]], -1), camera.size)
        differ = shown != nearest
        self.assertLess(differ.sum(), 10)  # OpenGL rounds corners to fractions of a sample
        np.testing.assert_allclose(distance[~differ & (nearest >= 0)], 1 / inverse[~differ & (nearest >= 0)], rtol=1e-4)

    def test_what_is_behind_the_eye_is_not_seen(self):
        behind = Shape([Mesh(np.array([[-9.0, -9, 9], [9, -9, 9], [0, 9, 9]]), np.array([[0, 1, 2]]), False, np.zeros(1, int), 0.0)])
        bodies = Bodies([behind], np.array([0]), np.array([False]), np.eye(3)[None], np.zeros((1, 3)))
        picture = scene_picture.Picture(bodies, scene_picture.Camera(np.eye(3), np.zeros(3), 100.0, (24, 24)))
        picture.draw_surfaces()
        self.assertFalse(picture.seen.read(0, np.float32)[..., 3].any())


class RenderedScenes(RenderTest):
    def test_bodies_appear_where_they_are_and_nothing_is_cut_off(self):
        self.write_scene([[0, 0, 0], [0, 3, 0]])
        picture = self.picture(self.scene, *FROM_X)
        self.assertEqual(picture.shape, (60, 120, 3))
        empty = self.is_backdrop(picture)
        columns = np.nonzero(~empty.all(axis=0))[0]
        rows = np.nonzero(~empty.all(axis=1))[0]
        # Four lengths from the left of the one to the right of the other fill the width but for 3 % on either side.
        self.assertTrue(2 <= columns[0] <= 5 and 114 <= columns[-1] <= 117, columns)
        self.assertAlmostEqual((rows[0] + rows[-1]) / 2, 29.5, delta=1)
        gap = np.nonzero(empty.all(axis=0))[0]
        gap = gap[(gap > columns[0]) & (gap < columns[-1])]
        self.assertAlmostEqual((gap[0] + gap[-1]) / 2, 59.5, delta=1)
        # Two lengths of four, seen between the far edges: 24 degrees wide, the picture is 10 lengths from the near ones.
        self.assertAlmostEqual(len(gap) / (columns[-1] - columns[0] + 1), 2 / 4 * 10 / 11, delta=0.03)

    def test_the_nearer_body_hides_the_other(self):
        self.write_scene([[0, 0, 0], [4, 0, 0]])
        both = self.picture(self.scene, *FROM_X)
        self.write_scene([[0, 0, 0], [4, 0, 0]], motion=[0, 1])  # grey is what is fixed
        second_is_grey = self.picture(self.scene, *FROM_X)
        self.assertGreater(np.ptp(both[30, 60]), 2 * np.ptp(second_is_grey[30, 60]))
        self.write_scene([[0, 0, 0], [4, 0, 0]], motion=[1, 0])
        np.testing.assert_allclose(self.picture(self.scene, *FROM_X)[30, 60], both[30, 60], atol=0.01)

    def test_a_shadow_falls_away_from_the_sun_which_is_on_the_left(self):
        plate = self.mesh_of("plate", "v -1 -1 0\nv 2 -1 0\nv 2 2 0\nv -1 2 0\nf 1 2 3 4\n")
        self.write_scene([[0, 0, 0], [0, 0, 0]])
        change(self.scene, assets=[f"../in/{mesh.name}" for mesh in (self.mesh, plate)], instances_asset=np.array([0, 1], "u4"))
        picture = self.picture(self.scene, "--azimuth", "0", "--elevation", "70", "--width", "120", "--height", "120")
        left, right = (picture[60:80, columns].mean() for columns in (slice(24, 30), slice(90, 96)))
        self.assertLess(right, 0.8 * left)
        self.assertGreater(right, 0.2)  # no black holes

    def test_far_bodies_are_drawn_by_coarser_levels_which_look_the_same(self):
        self.mesh = self.inputs / "levels.bvh"
        self.succeeds(BVHBUILD, SOURCE_DIR / "assets/cow_1500.obj", "-o", self.mesh, "--levels", "2%,10%")
        self.write_scene([[0, 0, 0], [30, 2, 0], [300, 20, 0]])
        change(self.scene, assets=[f"../in/{self.mesh.name}"])
        (bodies,) = read(self.scene)
        counts = [len(mesh.corners) for mesh in bodies.shapes[0].levels]
        self.assertEqual((counts[0], counts), (1500, sorted(counts, reverse=True)))
        camera = scene_picture.Camera(render.axes_of_view(180, 0), np.array([-5, 0, 0.5]), 600.0, (360, 240))
        picture = scene_picture.Picture(bodies, camera)
        self.assertEqual(picture.level.tolist(), [0, 1, 2])
        coarse = picture.draw()
        with unittest.mock.patch.object(scene_picture, "ERROR_SEEN", 0):
            fine = scene_picture.Picture(bodies, camera)
        self.assertFalse(fine.level.any())
        self.assertLess(np.abs(fine.draw().astype(int) - coarse).mean(), 0.1)
        self.assertGreater((fine.draw() != coarse).sum(), 0)

    def test_the_camera_can_be_on_the_ground_alone(self):
        self.write_scene([[0, 0, 0], [0, 0, 40]], motion=[1, 0])
        columns = lambda picture: (~self.is_backdrop(picture)).any(axis=0).sum()
        self.assertGreater(columns(self.picture(self.scene, *FROM_X, "--on", "ground")), 10 * columns(self.picture(self.scene, *FROM_X)))
        self.write_scene([[0, 0, 0]], motion=[0])
        result, _ = self.render(self.scene, *FROM_X, "--on", "ground")
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"holds no fixed body", result.stderr)

    def test_the_same_scene_gives_the_same_bytes(self):
        self.write_scene([[0, 0, 0], [0, 3, 0]])
        result, output = self.render(self.scene, name="a.png")
        self.assertEqual((result.returncode, result.stderr), (DONE, b""))
        self.assertEqual(self.drawn(self.scene, name="b.png").read_bytes(), output.read_bytes())


class RenderedContacts(RenderTest):
    def picture_of_contacts(self, translations):
        self.write_scene(translations)
        self.passes("query", self.scene, "--out", self.contacts)
        return self.picture(self.scene, "--contacts", self.contacts, *FROM_X)

    def redness(self, picture):
        return picture[..., 0] - picture[..., 1:].max(axis=-1)

    def test_triangles_that_meet_are_red_and_no_others(self):
        red = self.redness(self.picture_of_contacts([[0, 0, 0], [0, 0.5, 0.5], [0, 3, 0]])) > 0.4
        self.assertGreater(red[:, :60].mean(), 0.05)
        self.assertFalse(red[:, 80:].any())
        self.assertFalse((self.redness(self.picture(self.scene, *FROM_X)) > 0.4).any())

    def test_a_body_that_hides_them_lets_them_shine_through(self):
        met = self.picture_of_contacts([[0, 0, 0], [0.2, 0.1, 0.1], [1.3, 0.05, 0.05]])
        apart = self.picture_of_contacts([[0, 0, 0], [0, 5, 0], [1.3, 0.05, 0.05]])
        self.assertGreater(self.redness(met[30, 55:65]).min(), 0.1)
        self.assertLess(self.redness(apart).max(), 0.1)

    def test_contacts_of_another_scene_are_refused(self):
        self.picture_of_contacts([[0, 0, 0], [0, 0.5, 0.5], [0, 3, 0]])
        self.write_scene([[0, 0, 0]])
        result, _ = self.render(self.scene, "--contacts", self.contacts)
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"holds the contacts of another scene", result.stderr)


class RenderedRuns(RenderTest):
    def test_a_state_of_a_run_looks_as_the_scene_made_of_it(self):
        run = self.pile()
        self.passes("frame", run, "--frame", "10", "-o", self.scene)
        of_run = self.picture(run, "--frame", "10", "--width", "160")
        self.assertLess(np.abs(of_run - self.picture(self.scene, "--width", "160")).max(axis=2).mean(), 1e-3)
        self.assertGreater(np.abs(of_run - self.picture(run, "--width", "160")).max(axis=2).mean(), 1e-2)

    def test_each_state_of_an_animation_has_its_own_contacts(self):
        run, files = self.pile(), []
        for frame in (0, 10, 20):
            self.passes("frame", run, "--frame", str(frame), "-o", self.scene)
            files.append(self.outputs / f"contacts_{frame}.h5")
            self.passes("query", self.scene, "--out", files[-1])
        of_run = self.picture(run, "--frame", "20", "--contacts", files[2], "--width", "160")
        np.testing.assert_allclose(of_run, self.picture(self.scene, "--contacts", files[2], "--width", "160"), atol=0.02)
        result, _ = self.render(run, "--frames", "0:20:10", "--contacts", *files[:2], name="run.gif")
        self.assertEqual(result.returncode, 2)
        self.assertIn(b"one file for each state", result.stderr)
        with Image.open(self.drawn(run, "--frames", "0:20:10", "--contacts", *files, "--width", "96", name="run.webp")) as animation:
            self.assertEqual((animation.n_frames, animation.size), (3, (96, 60)))

    def test_an_animation_shows_the_frames_in_real_time(self):
        run = self.pile()
        for name in ("run.webp", "run.gif"):
            with Image.open(self.drawn(run, "--frames", "0:20:10", "--width", "96", name=name)) as animation:
                self.assertEqual((animation.n_frames, animation.size), (3, (96, 60)))
                animation.seek(1)
                animation.load()
                self.assertAlmostEqual(animation.info["duration"], 10 / 60 * 1000, delta=10)

    def test_a_thinned_run_looks_the_same(self):
        run, thinned = self.pile(), self.outputs / "thinned.h5"
        script = SOURCE_DIR / "scripts/thin_run"
        self.succeeds(sys.executable, script, run, "-o", thinned, "--precision", "0.001")
        self.assertLess(thinned.stat().st_size, run.stat().st_size / 2)
        for whole, part in zip(read(run, [0, 10, 20]), read(thinned, [0, 10, 20]), strict=True):
            np.testing.assert_allclose(part.rotation, whole.rotation, atol=0.004)
            np.testing.assert_allclose(part.translation, whole.translation, atol=0.006)
        self.assertLess(np.abs(self.picture(thinned, "--width", "160") - self.picture(run, "--width", "160")).mean(), 2e-3)
        self.write_scene([[0, 0, 0]])
        result = self.run_tool(sys.executable, os.fspath(script), os.fspath(self.scene), "-o", os.fspath(self.scene.with_name("no.h5")))
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"keeps no state", result.stderr)
        self.assertFalse(self.scene.with_name("no.h5").exists())

    def test_what_cannot_be_shown_is_said(self):
        result, _ = self.render(self.pile(), "--frame", "7")
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"does not keep the state after step 7, but every 10th up to 20", result.stderr)
        result, _ = self.render(self.scene, name="picture.bmp")
        self.assertIn(b"picture.bmp: neither .png nor .webp nor .gif", result.stderr)
        result, _ = self.render(self.mesh)
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"cube.bvh", result.stderr)


class BrokenAssets(RenderTest):
    def test_an_asset_that_is_not_one_is_named(self):
        self.write_scene([[0, 0, 0]])
        for broken in (b"", b"no asset", self.mesh.read_bytes()[:-7]):
            self.mesh.write_bytes(broken)
            result, output = self.render(self.scene)
            self.assertEqual(result.returncode, UNREADABLE_INPUT)
            self.assertIn(b"cube.bvh: not a .bvh file", result.stderr)
            self.assertFalse(output.exists())


if __name__ == "__main__":
    unittest.main()
