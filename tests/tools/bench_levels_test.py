#!/usr/bin/python3
"""Scenes at levels of detail, and bvhbench economy, from the outside.

Environment: that of tool_test.py, and TANDEM_BVHBENCH.
"""
import json
import pathlib
import subprocess
import time
import unittest

import h5py
import numpy as np

import bvh_file
from bench_test import BVHBENCH, IDENTITY, BenchTest, change, datasets, documented_keys, table_of
from tool_test import BVHBUILD, DONE, SOURCE_DIR, UNREADABLE_INPUT, USAGE

ERRORS = "1%,5%"  # of two coarser levels


def obj_of(triangles):
    """An OBJ of float64[triangles, 3 corners, 3], whose corners are the same float32 numbers."""
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    lines = ["v %.17g %.17g %.17g" % tuple(corner) for corner in corners]
    return "\n".join(lines + ["f %d %d %d" % tuple(face + 1) for face in index.reshape(-1, 3)]) + "\n"


def levels_in(scene):
    return datasets(scene)["instances/level"].tolist()


class LevelsBenchTest(BenchTest):
    """Each test has the cow of 1,500 triangles with two coarser levels, in/cow.bvh."""

    cow_with_levels = None

    def setUp(self):
        super().setUp()
        self.cow = self.inputs / "cow.bvh"
        if self.cow_with_levels is None:
            self.succeeds(BVHBUILD, SOURCE_DIR / "assets/cow_1500.obj", "-o", self.cow, "--levels", ERRORS, "-q")
            type(self).cow_with_levels = self.cow.read_bytes()
        self.cow.write_bytes(self.cow_with_levels)
        self.triangles = [len(bvh_file.read(self.cow, level).triangles) for level in range(3)]

    def bench(self, *arguments, **options):
        return super().bench(*map(str, arguments), **options)

    def write_cows(self, count=20, apart=0.5, **datasets):
        """Cows in a row; unless told otherwise so close that each meets the next."""
        rng = np.random.default_rng(1)
        turns = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(count)]
        turns = [turn * np.linalg.det(turn) for turn in turns]
        self.write_scene(asset=(0,) * count, rotation=turns, translation=[(apart * i, 0, 0) for i in range(count)],
                         assets=("../in/cow.bvh",), **datasets)

    def levels(self, *values):
        return {"instances_level": np.array(values, "u4")}

    def economy(self, *arguments):
        return json.loads(self.passes("economy", self.scene, "--json", "--repeat", 1, *arguments))


class SceneLevels(LevelsBenchTest):
    LEVELS = [0, 1, 2, 1, 0, 2] * 5

    def write_at_levels(self, apart=0.5):
        """Cows at levels, and pairs of neighbours."""
        self.write_cows(30, apart, pairs=np.array([(i, i + 1) for i in range(29)], "u4"), simulation_velocity=np.eye(3)[np.arange(30) % 3],
                        **self.levels(*self.LEVELS))

    def take_files_of_one_level(self):
        """The oracle: the same scene with files of one level each, made of the levels' triangles, as assets of their own."""
        names = []
        for i in range(3):
            path = self.mesh_of(f"level_{i}", obj_of(bvh_file.read(self.cow, i).world))
            self.assertEqual(len(bvh_file.read(path).triangles), self.triangles[i])
            names.append(f"../in/{path.name}")
        change(self.scene, assets=np.array(names, dtype=h5py.string_dtype()), instances_level=None, instances_asset=np.array(self.LEVELS, "u4"))

    def test_a_query_takes_the_meshes_of_the_levels(self):
        self.write_at_levels()
        found = self.query("--out", self.contacts, "--manifolds")
        self.assertEqual(found["triangles"], sum(self.triangles[i] for i in self.LEVELS))
        self.take_files_of_one_level()
        alone = self.query("--manifolds")
        for key in ("triangles", "object_pairs", "contacts", "manifolds", "segments"):
            self.assertEqual(found[key], alone[key], key)
        self.assertAlmostEqual(found["points"], alone["points"], delta=3)  # ties go by the numbers of triangles
        self.assertGreater(found["contacts"], 100)
        self.assertLess(table_of(self.contacts)["contacts/face_a"].max(), 1500)  # faces are of the source file, at any level

    def results(self, command, *words):
        out = self.outputs / f"{command}.h5"
        self.passes(command, self.scene, *words, "--out", out)
        return {name.removeprefix(f"{command}/"): column for name, column in datasets(out).items() if name.startswith(command)}

    def test_distances_are_those_of_the_levels(self):
        self.write_at_levels(apart=2.5)
        found = self.results("distance")
        self.take_files_of_one_level()
        alone = self.results("distance")
        self.assertGreater(found["lower"].min(), 0)
        self.assertTrue((np.maximum(found["lower"], alone["lower"]) <= np.minimum(found["upper"], alone["upper"])).all())

    def test_impacts_are_those_of_the_levels(self):
        self.write_at_levels(apart=1.5)
        found = self.results("impact", "--dt", "2")
        self.take_files_of_one_level()
        alone = self.results("impact", "--dt", "2")
        self.assertGreater((found["status"] == 1).sum(), 0)
        self.assertEqual(found["status"].tolist(), alone["status"].tolist())
        self.assertLess(np.abs(found["t_safe"] - alone["t_safe"]).max(), 1e-3)

    def test_level_0_of_all_is_the_scene_without_levels(self):
        self.write_cows()
        without = self.query()["hash"]
        self.write_cows(**self.levels(*[0] * 20))
        self.assertEqual(self.query()["hash"], without)
        self.write_cows(**self.levels(*[1] * 20))
        self.assertNotEqual(self.query()["hash"], without)

    def test_levels_that_are_not_there_are_refused(self):
        self.write_cows(2, **self.levels(0, 3))
        self.assert_refused(UNREADABLE_INPUT, "/instances/level", "instance 1 is at level 3", "cow.bvh, which has 3")
        self.write_cows(2, **self.levels(0, 1, 2))
        self.assert_refused(UNREADABLE_INPUT, "/instances/level", "3 rows for 2 instances")
        self.write_cows(2, instances_level=np.array([0, -1]))
        self.assert_refused(UNREADABLE_INPUT, "/instances/level")

    def test_scenes_are_made_at_a_level(self):
        self.passes("scene", "pile", "--mesh", self.cow, "--count", 20, "--level", 2, "-o", self.scene)
        self.assertEqual(levels_in(self.scene), [2] * 20)
        at_2 = datasets(self.scene)["instances/translation"]
        plain = self.outputs / "plain.h5"
        self.passes("scene", "pile", "--mesh", self.cow, "--count", 20, "--level", 0, "-o", plain)
        self.assertNotIn("instances/level", datasets(plain))
        self.assertTrue((datasets(plain)["instances/translation"] == at_2).all())  # boxes are those of level 0
        result = self.bench("scene", "pile", "--mesh", self.cow, "--level", 3, "-o", self.outputs / "none.h5")
        self.assert_fails(result, USAGE, "cow.bvh", "has 3 levels, so there is no level 3")

    def test_only_bodies_are_at_the_level_not_the_ground(self):
        self.passes("scene", "slide", "--mesh", self.cow, "--ground", self.mesh_of("ground", (SOURCE_DIR / "assets/ground.obj").read_bytes()),
                    "--count", 5, "--level", 1, "-o", self.scene)
        self.assertEqual(levels_in(self.scene), [0] + [1] * 5)


class SimulatedLevels(LevelsBenchTest):
    def run_of(self, name, *arguments):
        path = self.outputs / name
        self.passes("simulate", "scene", self.scene, "--frames", 4, "--trajectory", 4, "--threads", 1, *arguments, "-o", path)
        return path

    def test_a_body_weighs_what_its_finest_level_weighs(self):
        self.write_cows(3)
        finest = datasets(self.run_of("finest.h5"))
        self.assertNotIn("bodies/level", finest)
        self.write_cows(3, **self.levels(0, 2, 1))
        coarser = datasets(self.run_of("coarser.h5"))
        self.assertEqual([coarser[f"bodies/{name}"].tolist() for name in ("level", "asset")], [[0, 2, 1], [0, 0, 0]])
        self.assertEqual(len(coarser["assets"]), 1)
        for name in ("bodies/mass", "bodies/inertia", "bodies/centre_of_mass"):
            self.assertTrue((coarser[name] == finest[name]).all(), name)

    def test_a_frame_keeps_the_levels(self):
        self.write_cows(3, **self.levels(0, 2, 1))
        frame = self.outputs / "frame.h5"
        self.passes("frame", self.run_of("run.h5"), "--frame", 4, "-o", frame)
        self.assertEqual(levels_in(frame), [0, 2, 1])
        self.assertEqual(datasets(frame)["instances/asset"].tolist(), [0, 0, 0])
        self.passes("query", frame)

    def test_a_run_does_not_go_on_at_other_levels(self):
        self.write_cows(3, **self.levels(1, 1, 1))
        part = self.outputs / "run.h5.part"
        self.run_of("run.h5").rename(part)
        self.write_cows(3, **self.levels(2, 2, 2))
        result = self.bench("simulate", "scene", self.scene, "--frames", 4, "--trajectory", 4, "--resume", "-o", self.outputs / "run.h5")
        self.assert_fails(result, UNREADABLE_INPUT, "of another run, whose start is")


class Economy(LevelsBenchTest):
    def test_a_row_of_each_level_is_what_a_query_finds(self):
        self.write_cows()
        told = self.economy("--tolerance", "10%")
        self.assertEqual([row["triangles"] for row in told["assets"][0]["levels"]], self.triangles)
        for level, row in enumerate(told["assets"][0]["levels"]):
            self.write_cows(**self.levels(*[level] * 20))
            found = self.query("--manifolds")
            for key in ("object_pairs", "contacts", "manifolds"):
                self.assertEqual(row[key], found[key], (level, key))
        finest = told["assets"][0]["levels"][0]
        self.assertEqual((finest["lost_pairs"], finest["new_pairs"], finest["depth_error"]["largest"]), (0, 0, 0))
        self.assertEqual((finest["changeable_pairs"], finest["matched_manifolds"]), (0, 0))
        coarser = told["assets"][0]["levels"][1]
        self.assertEqual(coarser["changeable_pairs"], finest["touching_pairs"])
        self.assertEqual(coarser["matched_manifolds"] + coarser["lost_manifolds"], finest["manifolds"])

    def test_the_recommended_level_keeps_the_tolerance_and_the_next_does_not(self):
        self.write_cows()
        for tolerance in (0.001, 0.01, 0.03, 0.05, 0.2):
            told = self.economy("--tolerance", f"{100 * tolerance}%")
            asset = told["assets"][0]
            limit = tolerance * asset["diagonal"]
            keeps = [row["error_bound"] <= limit and row["depth_error"]["median"] <= limit for row in asset["levels"]]
            self.assertTrue(keeps[0])
            self.assertEqual(asset["recommended_level"], max(level for level in range(3) if keeps[level]))
            self.assertEqual(told["tolerance_relative"], tolerance)

    def test_subdivided_cows_need_no_more_than_the_first(self):
        """cow.obj is cow_1500.obj, each triangle split into four: the same surface."""
        self.cow.unlink()
        self.succeeds(BVHBUILD, SOURCE_DIR / "assets/cow.obj", "-o", self.cow, "--levels", "0.001%", "-q")
        self.write_cows()
        told = self.economy("--tolerance", "0.001%")
        levels, chosen = told["assets"][0]["levels"], told["assets"][0]["recommended_level"]
        self.assertEqual(levels[0]["triangles"], 6000)
        self.assertLessEqual(levels[chosen]["triangles"], 1500)
        self.assertEqual((told["recommended"]["lost_pairs"], told["recommended"]["new_pairs"]), (0, 0))

    def test_budgets(self):
        self.write_cows()
        finest = self.economy("--tolerance", "0")["assets"][0]
        bytes_of = [row["bytes"] for row in finest["levels"]]
        self.assertEqual(finest["recommended_level"], 0)
        for level, budget in ((0, bytes_of[0]), (1, bytes_of[0] - 1), (1, bytes_of[1]), (2, bytes_of[1] - 1)):
            told = self.economy("--memory", budget)
            self.assertEqual(told["recommended"]["levels"], [level])
            self.assertTrue(told["recommended"]["within_limit"])
        self.assertEqual(self.economy("--time", 1e6)["recommended"]["levels"], [0])

    def test_a_budget_that_cannot_be_met_fails_and_applies_nothing(self):
        self.write_cows()
        applied = self.outputs / "applied.h5"
        for words, reason in ((("--memory", 1), "--memory 1: the cheapest levels take"), (("--time", 0), "--time 0: the cheapest levels take")):
            result = self.bench("economy", self.scene, "--json", "--repeat", 1, *words, "--apply", applied)
            self.assertEqual(result.returncode, USAGE)
            self.assertIn(reason, result.stderr.decode())
            self.assertIn("applied.h5 is not written", result.stderr.decode())
            self.assertFalse(applied.exists())
            told = json.loads(result.stdout)
            self.assertFalse(told["recommended"]["within_limit"])
        self.assertEqual(self.bench("economy", self.scene, "--memory", 1).returncode, USAGE)

    def write_cows_and_cubes(self, cubes, cube_side=1, **datasets):
        """Two cows that meet, and far from them a row of cubes each of which meets the next."""
        corners = cube_side * np.array([(i & 1, i >> 1 & 1, i >> 2) for i in range(8)], "f8")
        faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
        self.mesh_of("block", obj_of(corners[np.array(faces)]))
        places = [(0, 0, 0), (0.3, 0.1, 0.2)] + [(20 + 0.9 * cube_side * i, 0.05 * i, 0.03 * i) for i in range(cubes)]
        self.write_scene(asset=(0, 0) + (1,) * cubes, rotation=(IDENTITY,) * (2 + cubes), translation=places,
                         assets=("../in/cow.bvh", "../in/block.bvh", "../in/cow.bvh"), **datasets)

    def test_an_asset_is_judged_by_the_pairs_that_it_is_in(self):
        self.write_cows_and_cubes(0)
        alone = self.economy("--tolerance", "1%")["assets"][0]["levels"]
        self.write_cows_and_cubes(40)
        told = self.economy("--tolerance", "1%")
        among = told["assets"][0]["levels"]
        self.assertGreater(alone[2]["depth_error"]["median"], 0)
        for level in (1, 2):
            self.assertEqual(among[level]["changeable_pairs"], 1)
            self.assertGreater(among[level]["touching_pairs"], 30)
            for key in ("depth_error", "normal_error_degrees", "matched_manifolds", "lost_manifolds", "new_manifolds"):
                self.assertEqual(among[level][key], alone[level][key], key)
        self.assertIn(f"of {among[0]['touching_pairs']} pairs that touch", self.passes("economy", self.scene, "--tolerance", "20%"))

    def test_a_tolerance_in_per_cent_is_of_the_smallest_that_moves(self):
        self.write_cows_and_cubes(3, cube_side=0.01, simulation_motion=np.array([1, 1, 0, 0, 0], "u4"))
        told = self.economy("--tolerance", "5%")
        cow, block, _ = told["assets"]
        self.assertEqual(block["tolerance"], 0.05 * block["diagonal"])
        self.assertEqual(cow["tolerance"], block["tolerance"])
        self.assertEqual(cow["recommended_level"], 0)
        self.write_cows_and_cubes(3, cube_side=0.01, simulation_motion=np.array([0, 0, 1, 1, 1], "u4"))
        told = self.economy("--tolerance", "5%")
        self.assertEqual(told["assets"][0]["tolerance"], 0.05 * cow["diagonal"])

    def test_an_asset_without_instances_is_left_out(self):
        self.write_cows_and_cubes(1)
        with_it = self.economy("--tolerance", "1%")
        self.assertEqual((with_it["assets"][2]["instances"], len(with_it["assets"][2]["levels"])), (0, 1))
        names = datasets(self.scene)["assets"][:2]
        change(self.scene, assets=names)
        self.assertEqual(self.economy("--tolerance", "1%")["finest"]["bytes"], with_it["finest"]["bytes"])
        change(self.scene, assets=[b"../in/cow.bvh"] + list(names), instances_asset=np.array([1, 1, 2], "u4"))
        applied = self.outputs / "applied.h5"
        told = self.economy("--tolerance", "20%", "--apply", applied)
        self.assertEqual(told["finest"]["bytes"], with_it["finest"]["bytes"])
        self.assertEqual(datasets(applied)["instances/asset"].tolist(), [1, 1, 2])
        self.assertEqual(levels_in(applied), [told["assets"][1]["recommended_level"]] * 2 + [0])

    def test_apply_writes_the_scene_with_the_levels(self):
        velocity = np.arange(60.0).reshape(20, 3)
        self.write_cows(simulation_velocity=velocity, simulation_density=np.full(20, 500.0), excluded=np.array([[0, 1]], "u4"),
                        instances_level=np.full(20, 1, "u4"))
        folder = self.outputs / "elsewhere"
        folder.mkdir()
        told = self.economy("--tolerance", "20%", "--apply", folder / "applied.h5")
        level = told["assets"][0]["recommended_level"]
        self.assertEqual(level, 2)
        applied = datasets(folder / "applied.h5")
        self.assertEqual(applied["instances/level"].tolist(), [level] * 20)
        self.assertEqual(applied["assets"][0].decode(), "../../in/cow.bvh")
        self.assertTrue((applied["simulation/velocity"] == velocity).all())
        self.assertTrue((applied["simulation/density"] == 500).all())
        self.assertEqual(applied["excluded"].tolist(), [[0, 1]])
        found = json.loads(self.passes("query", folder / "applied.h5", "--json"))
        self.assertEqual(found["contacts"], told["recommended"]["contacts"])

    def test_apply_writes_the_scene_that_was_measured(self):
        self.write_cows(simulation_velocity=np.ones((20, 3)))
        applied = self.outputs / "applied.h5"
        command = [BVHBENCH, "economy", self.scene, "--tolerance", "20%", "--threads", "2", "--repeat", "1000", "--apply", applied]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as running:
            tasks = pathlib.Path(f"/proc/{running.pid}/task")
            while running.poll() is None and len(list(tasks.glob("*"))) == 1:
                time.sleep(0.001)
            self.scene.unlink()  # now that it measures
            errors = running.communicate()[1]
        self.assertEqual((running.returncode, errors), (DONE, b""))
        self.assertEqual(levels_in(applied), [2] * 20)
        self.assertTrue((datasets(applied)["simulation/velocity"] == 1).all())

    def test_simulated_bodies_are_compared_where_they_end(self):
        self.write_cows(4)
        told = self.economy("--tolerance", "5%", "--simulate", "0.2")
        levels = told["assets"][0]["levels"]
        self.assertEqual(levels[0]["end_distance"]["largest"], 0)
        self.assertGreater(levels[2]["end_distance"]["largest"], 0)
        self.assertGreater(told["end_distance_of_a_nudge"]["mean"], 0)
        self.assertTrue(all(row["step_seconds"] > 0 for row in levels))
        text = self.passes("economy", self.scene, "--tolerance", "5%", "--simulate", "0.2")
        self.assertIn("nudged by a millionth", text)

    def test_the_keys_of_json_are_those_of_its_documentation(self):
        self.write_cows(4)
        keys = documented_keys("economy", "\n\n[*][*]")
        told = self.economy("--tolerance", "5%", "--simulate", "0.1")
        level = told["assets"][0]["levels"][0]
        self.assertEqual([list(told), list(told["assets"][0]), list(level)], keys[:3])
        self.assertEqual(list(told["recommended"]), ["levels", "within_limit", *list(level)[4:]])

    def test_what_it_refuses(self):
        self.write_cows(2)
        for words in ((), ("--tolerance", "1%", "--time", "1")):
            self.assert_fails(self.bench("economy", self.scene, *words), USAGE, "[--tolerance,--time,--memory]")
        for tolerance in ("-1", "one", "%", "nan", "inf%"):
            self.assert_fails(self.bench("economy", self.scene, f"--tolerance={tolerance}"), USAGE, tolerance)
        self.assert_fails(self.bench("economy", self.scene, "--tolerance", "1", "--apply", self.cow), USAGE, "cow.bvh")
        self.write_scene(asset=(), rotation=np.zeros((0, 3, 3)), translation=np.zeros((0, 3)), assets=("../in/cow.bvh",))
        self.assert_fails(self.bench("economy", self.scene, "--tolerance", "1"), UNREADABLE_INPUT, "/instances", "there is none")


if __name__ == "__main__":
    unittest.main()
