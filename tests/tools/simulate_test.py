#!/usr/bin/python3
"""bvhbench simulate and bvhbench frame from the outside: runs, what they keep, stopping, going on, replay.

Environment: that of tool_test.py, and TANDEM_BVHBENCH.
"""
import json
import os
import re
import signal
import subprocess
import time
import unittest

import h5py
import numpy as np

from bench_test import BVHBENCH, BenchTest, attributes, change, datasets
from tool_test import SOURCE_DIR, UNREADABLE_INPUT, USAGE

SLAB_OBJ = ("v -30 -30 -5\nv 30 -30 -5\nv 30 30 -5\nv -30 30 -5\nv -30 -30 0\nv 30 -30 0\nv 30 30 0\nv -30 30 0\n"
            "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n")
MEASURED = "/frames/seconds/"  # what no two runs have in common


class SimulateTest(BenchTest):
    """Each test has a cube about the origin, and a name for a run."""

    def setUp(self):
        super().setUp()
        self.run_file = self.outputs / "run.h5"
        self.cube_obj = (SOURCE_DIR / "assets/box_12.obj").read_bytes()
        self.cube = self.mesh_of("cube", self.cube_obj)

    def asset(self, name):
        return self.mesh_of(name, (SOURCE_DIR / f"assets/{name}.obj").read_bytes())

    def cows(self):
        return ["--mesh", self.asset("cow_1500"), "--ground", self.asset("ground")]

    def simulate(self, kind, *arguments, out=None):
        return self.passes("simulate", kind, *arguments, "-o", out or self.run_file)

    def stack(self, *arguments, out=None):
        return self.simulate("stack", "--mesh", self.cube, "--count", "27", *arguments, out=out)

    def contents(self, path):
        """All datasets and attributes but what is measured in seconds."""
        found = {"/" + name: data.tobytes() for name, data in datasets(path).items()} | {name: str(value) for name, value in attributes(path).items()}
        return {name: value for name, value in found.items() if not name.startswith(MEASURED)}

    def assert_same_run(self, first, second):
        a, b = self.contents(first), self.contents(second)
        self.assertEqual(sorted(a), sorted(b))
        self.assertEqual([name for name in a if a[name] != b[name]], [])


class Runs(SimulateTest):
    def test_a_stack_stands_and_says_so(self):
        summary = json.loads(self.stack("--frames", "120", "--json"))
        self.assertEqual((summary["bodies"], summary["triangles"], summary["steps"]), (36, 27 * 12, 120))
        self.assertLess(summary["last"]["speed_max"], 1e-3)
        told, run = attributes(self.run_file), datasets(self.run_file)
        self.assertEqual((told["configuration"], told["iterations"]), ("stack", 30))
        self.assertIn("tandem_version", told)
        self.assertTrue(np.array_equal(run["frames/contact_ratio"], run["frames/triangle_pairs"] / (27 * 12)))
        energy = run["frames/kinetic_energy"] + run["frames/potential_energy"]
        self.assertLessEqual(energy[-1], energy[0] + 1e-3 * abs(energy[0]))
        self.assertTrue((run["frames/seconds/step"] > 0).all())

    def test_pairs_that_keep_their_contacts_are_not_asked_about_unless_all_are(self):
        self.stack("--frames", "60")
        kept = datasets(self.run_file)
        self.stack("--frames", "60", "--ask-all")
        asked = datasets(self.run_file)
        counted = {"frames/" + name for name in ("object_pairs", "block_pairs", "candidates", "triangle_pairs", "contact_ratio")}
        for name in kept:
            if "seconds" not in name and name not in counted:
                self.assertTrue(np.array_equal(kept[name], asked[name]), name)
        self.assertGreater(kept["frames/kept_pairs"][-1], 0)
        self.assertEqual(kept["frames/object_pairs"][-1], 0)
        self.assertGreater(asked["frames/object_pairs"][-1], 0)

    def test_threads_do_not_change_the_results(self):
        others = self.outputs / "others.h5"
        pile = [*self.cows(), "--count", "20", "--frames", "90", "--trajectory", "10"]
        self.simulate("pile", *pile, "--threads", "1")
        self.simulate("pile", *pile, "--threads", "4", out=others)
        self.assert_same_run(self.run_file, others)

    def test_another_seed_gives_another_pile(self):
        others = self.outputs / "others.h5"
        pile = [*self.cows(), "--count", "8", "--frames", "1", "--trajectory", "1"]
        self.simulate("pile", *pile)
        self.simulate("pile", *pile, "--seed", "2", out=others)
        self.assertNotEqual(self.contents(self.run_file)["start"], self.contents(others)["start"])

    def test_rocks_that_leave_the_slide_come_back_at_its_top(self):
        self.simulate("slide", *self.cows(), "--count", "100", "--tilt", "45", "--friction", "0.1",
                      "--frames", "60", "--trajectory", "1")
        run = datasets(self.run_file)
        self.assertGreater(run["frames/reentered"].sum(), 0)
        x = run["trajectory/position"][:, run["bodies/motion"] == 0, 0]
        self.assertLess(np.diff(x, axis=0).min(), -30)
        self.assertLess(np.abs(x).max(), 25)

    def test_a_scene_moves_as_its_file_says(self):
        slab = self.mesh_of("slab", SLAB_OBJ)
        self.write_scene((0, 1, 1), [np.eye(3)] * 3, [[0, 0, 0], [0, 0, 0.5], [5, 0, 20]], [os.fspath(slab), os.fspath(self.cube)],
                         simulation_motion=np.array([1, 0, 2], "u4"), simulation_velocity=np.array([[0, 0, 0], [2, 0, 0], [0, 1.5, 0]]),
                         simulation_density=np.array([1, 500.0, 1]))
        self.simulate("scene", self.scene, "--frames", "60", "--trajectory", "60", "--friction", "0.25")
        run = datasets(self.run_file)
        moved = run["trajectory/position"][1] - run["trajectory/position"][0]
        self.assertEqual(list(moved[0]), [0, 0, 0])
        self.assertAlmostEqual(run["bodies/mass"][1], 500, places=6)
        # 2 m/s braked by 0.25 g come to rest after 0.82 s, 0.815 m further on.
        self.assertAlmostEqual(moved[1, 0], 2**2 / (2 * 0.25 * 9.81), delta=0.03)
        np.testing.assert_allclose(moved[2], [0, 1.5, 0], atol=1e-12)

    def cubes_over_a_slab(self, places, **datasets):
        """A scene of a fixed slab, whose top is z = 0, and of cubes of half a metre's reach at these places."""
        slab = self.mesh_of("slab", SLAB_OBJ)
        self.write_scene([0] + [1] * len(places), [np.eye(3)] * (1 + len(places)), [[0, 0, 0], *places],
                         [os.fspath(slab), os.fspath(self.cube)], simulation_motion=np.array([1] + [0] * len(places), "u4"), **datasets)

    def test_groups_masks_and_excluded_pairs_are_heeded(self):
        every, one = 2**32 - 1, np.uint32(1)
        self.cubes_over_a_slab([(5 * i, 0, 0.5) for i in range(4)], excluded=np.array([[2, 0]], "u4"),
                               instances_group=np.array([every, every, every, 2, every], "u4"),
                               instances_mask=np.array([every ^ 2, every, every, every, every ^ one], "u4"))
        for options in ((), ("--continuous",), ("--engine", "embree-refit"), ("--sleep",)):
            with self.subTest(options=options):
                if "embree-refit" in options and b"built without" in self.bench("simulate", "scene", self.scene, "--frames", "1", *options, "-o", self.run_file).stderr:
                    continue
                self.simulate("scene", self.scene, "--frames", "60", "--trajectory", "60", *options)
                fallen = datasets(self.run_file)["trajectory/position"][1, :, 2] < -1
                self.assertEqual(fallen.tolist(), [False, False, True, True, False])

    def test_resume_tells_runs_with_other_filters_apart(self):
        self.cubes_over_a_slab([(0, 0, 0.5)])
        self.simulate("scene", self.scene, "--frames", "2")
        self.cubes_over_a_slab([(0, 0, 0.5)], excluded=np.array([[0, 1]], "u4"))
        self.assert_fails(self.bench("simulate", "scene", self.scene, "--frames", "2", "--resume", "-o", self.run_file), UNREADABLE_INPUT,
                          "run.h5", "whose start is")

    def test_meshes_of_a_scene_are_not_overwritten(self):
        self.cubes_over_a_slab([(0, 0, 0.5)])
        before = self.cube.read_bytes()
        for command in (["simulate", "scene", self.scene, "--frames", "1", "-o"], ["compare", self.scene, "--out"]):
            self.assert_fails(self.bench(*command, self.cube), USAGE, "cube.bvh", "is read too")
            self.assertEqual(self.cube.read_bytes(), before)

    def test_what_a_run_reads_is_not_its_part_file(self):
        part = self.outputs / "run.h5.part"
        self.cubes_over_a_slab([(0, 0, 0.5)])
        scene = self.scene.rename(part)
        self.assert_part_file_is_kept(scene, part)
        part.unlink()
        self.cube = self.cube.rename(part)
        self.cubes_over_a_slab([(0, 0, 0.5)])
        self.assert_part_file_is_kept(self.scene, part)

    def assert_part_file_is_kept(self, scene, part):
        before = part.read_bytes()
        result = self.bench("simulate", "scene", scene, "--frames", "3", "--checkpoint", "0", "-o", self.run_file)
        self.assert_fails(result, USAGE, "run.h5.part", "is read too")
        self.assertEqual(part.read_bytes(), before)

    def test_given_pairs_are_refused_by_name(self):
        self.cubes_over_a_slab([(0, 0, 0.5)], pairs=np.array([[0, 1]], "u4"))
        self.assert_fails(self.bench("simulate", "scene", self.scene, "--frames", "1", "-o", self.run_file), UNREADABLE_INPUT, "scene.h5", "/pairs")
        self.assert_nothing_but(self.scene)

    def test_places_that_are_no_numbers_or_too_far_are_refused_by_instance(self):
        for wrong in (1e308, -1e301, np.inf, np.nan):
            with self.subTest(wrong=wrong):
                self.cubes_over_a_slab([(0, 0, 0.5), (0, wrong, 2)])
                result = self.bench("simulate", "scene", self.scene, "--frames", "2", "-o", self.run_file)
                self.assert_fails(result, UNREADABLE_INPUT, "scene.h5", "instance 2: a ")
                self.assert_nothing_but(self.scene)

    def test_speeds_that_overflow_are_told_by_step_and_body(self):
        for name, options in (("velocity", ()), ("velocity", ("--solver", "sweeps")), ("velocity", ("--continuous",)), ("angular_velocity", ()),
                              ("angular_velocity", ("--continuous",))):
            with self.subTest(name=name, options=options):
                self.cubes_over_a_slab([(0, 0, 0.5), (0, 0, 2)])
                with h5py.File(self.scene, "a") as file:
                    file[f"simulation/{name}"] = np.array([(0, 0, 0), (0, 0, 0), (0, 1e308, -1e308)])
                result = self.bench("simulate", "scene", self.scene, "--frames", "20", *options, "-o", self.run_file)
                self.assert_fails(result, UNREADABLE_INPUT, "run.h5", "step", "body 2")
                self.assert_nothing_but(self.scene)

    def assert_nothing_but(self, path):
        self.assertEqual(os.listdir(self.outputs), [path.name])

    def test_continuous_keeps_fast_plates_from_passing_through(self):
        plate = self.mesh_of("plate", re.sub(rb"^v (\S+) (\S+) (\S+)", lambda v: b"v %s %s %f" % (v[1], v[2], 0.01 * float(v[3])),
                                             self.cube_obj, flags=re.M))
        speeds = np.array([1.0, 3, 10, 30, 100])
        at = np.array([(3 * i, 0, z) for i, speed in enumerate(speeds) for z in (0, 0.02 + speed / 30)])
        self.write_scene([0] * 10, [np.eye(3)] * 10, at, [os.fspath(plate)], simulation_motion=np.array([1, 0] * 5, "u4"),
                         simulation_velocity=np.array([(0, 0, v) for speed in speeds for v in (0, -speed)]))
        arguments = [self.scene, "--frames", "12", "--trajectory", "12", "--gravity", "0"]
        behind = []
        for options in ((), ("--continuous",)):
            self.simulate("scene", *arguments, *options)
            behind.append((datasets(self.run_file)["trajectory/position"][-1, 1::2, 2] < 0).tolist())
        self.assertEqual(behind[0], [False, False, False, False, True])
        self.assertEqual(behind[1], [False] * 5)

    def test_continuous_changes_nothing_where_nothing_is_fast(self):
        runs = []
        for options in ((), ("--continuous",)):
            self.stack("--frames", "60", "--trajectory", "20", *options)
            runs.append({name: data for name, data in self.contents(self.run_file).items() if name.startswith(("/trajectory", "/frames", "/state"))})
        self.assertEqual(runs[0], runs[1])

    def test_usage_errors_say_what_is_wrong(self):
        for mesh, options, code, words in ((self.cube, ["--count", "26"], USAGE, ["26 is no cube of a whole number"]),
                                           (self.cube, ["--engine", "magic"], USAGE, ["magic", "tandem"]),
                                           (self.cube, ["--dt", "10"], USAGE, ["--dt", "fraction from 1e-09 to 1"]),
                                           (self.cube, ["--dt", "1/0"], USAGE, ["--dt"]),
                                           (self.cube, ["--iterations", "9"], USAGE, ["--iterations", "--solver sweeps"]),
                                           (self.cube, ["--shock"], USAGE, ["--shock", "--solver sweeps"]),
                                           (self.inputs / "none.bvh", [], UNREADABLE_INPUT, ["none.bvh", "no such file"])):
            self.assert_fails(self.bench("simulate", "stack", "--mesh", mesh, *options, "--frames", "1", "-o", self.run_file), code, *words)
        self.assert_nothing_written()


class Resuming(SimulateTest):
    OPTIONS = ["--frames", "100", "--trajectory", "5", "--sleep"]

    def start(self, *arguments):
        """A run in the background that writes a checkpoint after every step."""
        return subprocess.Popen(
            list(map(os.fspath, [BVHBENCH, "simulate", "stack", "--mesh", self.cube, "--count", "64", *arguments,
                                 "--checkpoint", "0", "-o", self.run_file])),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def wait_for_part(self):
        part = self.outputs / "run.h5.part"
        for _ in range(600):
            if part.exists():
                return part
            time.sleep(0.01)
        self.fail("no part file")

    def test_a_stopped_run_goes_on_to_the_same_results(self):
        whole = self.outputs / "whole.h5"
        self.simulate("stack", "--mesh", self.cube, "--count", "64", *self.OPTIONS, out=whole)
        for sent in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            with self.subTest(signal=sent):
                process = self.start(*self.OPTIONS)
                part = self.wait_for_part()
                process.send_signal(sent)
                process.communicate(timeout=60)
                self.assertEqual(process.returncode, -sent)
                self.assertFalse(self.run_file.exists())
                self.assertLess(attributes(part)["steps"], 100)
                self.simulate("stack", "--mesh", self.cube, "--count", "64", *self.OPTIONS, "--resume")
                self.assertFalse(part.exists())
                self.assert_same_run(whole, self.run_file)
                self.run_file.unlink()

    def test_bodies_in_flight_go_on_to_the_same_results(self):
        """What is known of pairs that do not touch yet goes on too, and with it which pairs are asked about."""
        pile = ["pile", *self.cows(), "--count", "20", "--frames"]
        whole = self.outputs / "whole.h5"
        self.simulate(*pile, "60", out=whole)
        for made in ("1", "20", "40"):
            with self.subTest(steps=made):
                self.simulate(*pile, made)
                self.run_file.rename(f"{self.run_file}.part")
                self.simulate(*pile, "60", "--resume")
                self.assert_same_run(whole, self.run_file)
                self.run_file.unlink()

    def test_resume_starts_where_nothing_is_and_leaves_what_is_done(self):
        self.stack("--frames", "3", "--resume")
        before = self.run_file.read_bytes()
        self.assertIn("is done", self.stack("--frames", "3", "--resume"))
        self.assertEqual(self.run_file.read_bytes(), before)

    def test_resume_refuses_a_run_whose_datasets_differ_in_length(self):
        self.stack("--frames", "3")
        change(self.run_file, frames_contacts=datasets(self.run_file)["frames/contacts"][:2])
        result = self.bench("simulate", "stack", "--mesh", self.cube, "--count", "27", "--frames", "3", "--resume", "-o", self.run_file)
        self.assert_fails(result, UNREADABLE_INPUT, "run.h5", "/frames: datasets of different lengths")

    def test_resume_refuses_a_state_that_is_not_finite_by_row(self):
        self.stack("--frames", "3")
        for name, row in (("state/velocity", 5), ("state/position", 2), ("state/contacts/in_a", 1), ("state/contacts/normal_impulse", 0),
                          ("state/before/position", 4)):
            with self.subTest(name=name):
                sound = datasets(self.run_file)[name]
                wrong = sound.copy()
                wrong[row] = np.nan
                change(self.run_file, **{name.replace("/", "_", 1): wrong})
                result = self.bench("simulate", "stack", "--mesh", self.cube, "--count", "27", "--frames", "3", "--resume", "-o", self.run_file)
                self.assert_fails(result, UNREADABLE_INPUT, "run.h5", f"/{name}: row {row}: a number is not finite")
                change(self.run_file, **{name.replace("/", "_", 1): sound})

    def test_resume_refuses_the_part_of_another_run(self):
        process = self.start(*self.OPTIONS)
        part = self.wait_for_part()
        process.terminate()
        process.communicate(timeout=60)
        before = part.read_bytes()
        result = self.bench("simulate", "stack", "--mesh", self.cube, "--count", "64", *self.OPTIONS, "--resume",
                            "--friction", "0.75", "-o", self.run_file)
        self.assert_fails(result, UNREADABLE_INPUT, "run.h5.part", "friction is 0.5, not 0.75")
        self.assertEqual(part.read_bytes(), before)


class Frames(SimulateTest):
    def test_a_frame_is_a_scene_with_the_contacts_of_the_run(self):
        self.simulate("pile", *self.cows(), "--count", "20", "--frames", "80", "--trajectory", "20", "--ask-all", "--solver", "sweeps")
        for frame in (0, 60):
            scene = self.outputs / f"frame{frame}.h5"
            self.passes("frame", self.run_file, "--frame", str(frame), "-o", scene)
            found = json.loads(self.passes("query", scene, "--json"))
            self.assertEqual(found["contacts"], datasets(self.run_file)["frames/triangle_pairs"][frame])
        self.assertGreater(found["contacts"], 0)
        self.assertIn("Tandem exact", self.passes("compare", scene))

    def test_a_simulation_goes_on_from_a_frame(self):
        """What is fixed stays fixed, and the others go on as they moved, but that no contact is remembered."""
        self.simulate("pile", *self.cows(), "--count", "4", "--frames", "20", "--trajectory", "1", "--density", "700")
        scene = self.outputs / "frame.h5"
        self.passes("frame", self.run_file, "--frame", "10", "-o", scene)
        before, went_on = datasets(self.run_file), self.outputs / "on.h5"
        self.passes("simulate", "scene", scene, "--frames", "10", "--trajectory", "1", "-o", went_on)
        after = datasets(went_on)
        for name in ("motion", "density", "mass"):
            self.assertEqual(after[f"bodies/{name}"][1:].tolist(), before[f"bodies/{name}"][1:].tolist())
        np.testing.assert_allclose(after["trajectory/velocity"][0], before["trajectory/velocity"][10], atol=1e-12)
        np.testing.assert_allclose(after["trajectory/position"][5], before["trajectory/position"][15], atol=1e-6)

    def test_a_frame_that_is_not_kept_is_refused_with_those_that_are(self):
        self.stack("--frames", "4", "--trajectory", "2")
        scene = self.outputs / "scene.h5"
        self.assert_fails(self.bench("frame", self.run_file, "--frame", "3", "-o", scene), UNREADABLE_INPUT, "run.h5",
                          "no frame 3", "0 to 4, every 2")
        self.stack("--frames", "1")
        self.assert_fails(self.bench("frame", self.run_file, "--frame", "0", "-o", scene), UNREADABLE_INPUT,
                          "keeps no trajectory")

    def test_a_run_whose_datasets_have_other_lengths_is_refused_by_name(self):
        self.stack("--frames", "2", "--trajectory", "1")
        sound = datasets(self.run_file)
        scene = self.outputs / "scene.h5"
        bodies = len(sound["bodies/asset"])
        for name, rows, words in (("bodies/centre_of_mass", 0, ["/bodies/centre_of_mass", f"0 rows for {bodies} bodies"]),
                                  ("bodies/centre_of_mass", 1, ["/bodies/centre_of_mass", f"1 rows for {bodies} bodies"]),
                                  ("trajectory/frame", 2, ["/trajectory"]), ("trajectory/position", 1, ["/trajectory"]),
                                  ("trajectory/orientation", 0, ["/trajectory"]), ("bodies/asset", 1, ["/bodies/centre_of_mass", f"{bodies} rows for 1 bodies"])):
            with self.subTest(name=name, rows=rows):
                change(self.run_file, **{name.replace("/", "_", 1): sound[name][:rows]})
                self.assert_fails(self.bench("frame", self.run_file, "--frame", "1", "-o", scene), UNREADABLE_INPUT, "run.h5", *words)
                self.assertFalse(scene.exists())
                change(self.run_file, **{name.replace("/", "_", 1): sound[name]})

    def test_a_body_of_an_asset_that_the_run_has_not_is_refused(self):
        self.stack("--frames", "1", "--trajectory", "1")
        asset = datasets(self.run_file)["bodies/asset"]
        asset[3] = 7
        change(self.run_file, bodies_asset=asset)
        self.assert_fails(self.bench("frame", self.run_file, "--frame", "1", "-o", self.outputs / "scene.h5"), UNREADABLE_INPUT,
                          "run.h5", "/bodies/asset", "body 3 is of asset 7 of 1")


if __name__ == "__main__":
    unittest.main()
