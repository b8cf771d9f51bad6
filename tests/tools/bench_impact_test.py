#!/usr/bin/python3
"""bvhbench impact from the outside. Environment: that of bench_test.py."""
import json
import re
import unittest

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from bench_test import IDENTITY, BenchTest, drop_hint
from tool_test import CUBE_OBJ, SOURCE_DIR, UNREADABLE_INPUT, USAGE

NO_FACE = 2**32 - 1


def table_of(path):
    with h5py.File(path) as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        return {name: file[name][:] for name in names}


class Impact(BenchTest):
    def setUp(self):
        super().setUp()
        self.impacts = self.outputs / "impacts.h5"

    def move(self, **columns):
        with h5py.File(self.scene, "a") as file:
            for name, rows in columns.items():
                file[f"simulation/{name}"] = rows

    def impact(self, *arguments, dt="1"):
        return json.loads(self.passes("impact", self.scene, "--dt", dt, "--json", *arguments))

    def refuses(self, code, *words, arguments=("--dt", "1")):
        result = drop_hint(self.bench("impact", self.scene, *arguments, "--out", self.impacts))
        self.assert_fails(result, code, *words)
        self.assertFalse(self.impacts.exists())

    def test_a_cube_that_falls_on_another_meets_it_when_it_should(self):
        self.write_scene(translation=((0, 0, 0), (0.25, 0.125, 3)))
        self.move(velocity=np.array([[0, 0, 0], [0, 0, -4.0]]))
        report = self.impact("--out", self.impacts)
        table = table_of(self.impacts)
        self.assertEqual((report["object_pairs"], report["found"], report["at_start"]), (1, 1, 0))
        self.assertEqual(table["pairs"].tolist(), [[0, 1]])
        self.assertEqual(table["impact/status"].tolist(), [1])
        np.testing.assert_allclose(table["impact/t_safe"], 0.5, atol=1e-6)
        self.assertLess(table["impact/t_safe"][0], 0.5)
        np.testing.assert_allclose(table["impact/gap"], 4 * (0.5 - table["impact/t_safe"]), atol=1e-11)
        np.testing.assert_allclose(table["impact/point_b"][0, 2] - table["impact/point_a"][0, 2], table["impact/gap"][0], atol=1e-11)
        np.testing.assert_allclose(table["impact/point_a"][0, 2], 1, atol=1e-11)

    def test_what_does_not_meet_and_what_touches_already_is_told(self):
        self.write_scene(asset=(0, 0, 0), rotation=(IDENTITY,) * 3, translation=((0, 0, 0), (0.5, 0, 0), (0, 3, 0)),
                         pairs=np.array([[2, 0], [0, 1], [0, 1]], "u4"))
        self.move(velocity=np.array([[0, 0, 0], [1.0, 0, 0], [9, 0, 0]]))
        report = self.impact("--out", self.impacts, dt="0.25")
        table = table_of(self.impacts)
        self.assertEqual((report["given_pairs"], report["at_start"], report["found"]), (True, 1, 0))
        self.assertEqual(table["pairs"].tolist(), [[0, 1], [0, 2]])
        self.assertEqual(table["impact/status"].tolist(), [2, 0])
        self.assertEqual(table["impact/t_safe"].tolist(), [0, 0.25])
        self.assertEqual(table["impact/gap"].tolist(), [0, np.inf])
        self.assertEqual((table["impact/face_a"][1], table["impact/face_b"][1]), (NO_FACE, NO_FACE))

    def test_bodies_turn_about_their_centres_of_mass_unless_the_file_says_otherwise(self):
        # A rod along x above a cube, its end beyond the cube's side, turns downwards about y.
        rod = re.sub(r"^v (\S+)", lambda v: f"v {8 * float(v[1])}", CUBE_OBJ, flags=re.M)
        self.mesh_of("rod", rod)
        self.write_scene(asset=(0, 1), assets=("../in/cube.bvh", "../in/rod.bvh"), translation=((3, 0, 0), (0, 0, 2)))
        self.move(angular_velocity=np.array([[0, 0, 0], [0, 1.0, 0]]))
        self.impact("--out", self.impacts)
        mass, centre = table_of(self.impacts), np.array([4, 0.5, 2.5])
        np.testing.assert_allclose(mass["motion/centre"][1], centre, atol=1e-6)
        # Its lower edge at x = 8 is (4, -0.5) from the centre; it reaches no cube, and no cube reaches it.
        self.assertEqual(mass["impact/status"].tolist(), [0])
        self.move(centre=np.array([[0, 0, 0], [0, 0.5, 2.5]]))
        self.impact("--out", self.impacts)
        given = table_of(self.impacts)
        self.assertEqual(given["motion/centre"].tolist(), [[0, 0, 0], [0, 0.5, 2.5]])
        self.assertEqual(given["impact/status"].tolist(), [1])
        t, c = given["impact/t_safe"][0], np.array([0, 0.5, 2.5])
        # The rod's lower side meets the cube's upper edge at x = 4: in the rod's frame that edge is 0.5 below the axis.
        edge = Rotation.from_rotvec([0, -t, 0]).apply(np.array([4, 0.5, 1]) - c)
        np.testing.assert_allclose(edge[2], -0.5, atol=1e-5)
        self.assertLess(edge[2], -0.5)

    def test_fixed_instances_stay_and_filters_hold(self):
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)), simulation_motion=np.array([0, 1], "u4"))
        self.move(velocity=np.array([[0, 0, 0], [0, 0, -4.0]]))
        self.assertEqual(self.impact()["found"], 0)
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)), excluded=np.array([[1, 0]], "u4"))
        self.move(velocity=np.array([[0, 0, 0], [0, 0, -4.0]]))
        self.assertEqual(self.impact()["object_pairs"], 0)

    def test_datasets_are_of_the_documented_types(self):
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)))
        self.impact("--out", self.impacts)
        types = {name: (str(column.dtype), column.shape[1:]) for name, column in table_of(self.impacts).items()}
        page = (SOURCE_DIR / "docs" / "scenes.md").read_text().split("## Impacts file")[1].split("\n## ")[0]
        documented = {}
        for names, kind, width in re.findall(r"^\| (`/.*?) \| ([uf]\d+) \[\w(,\d)?\]", page, re.M):
            for name in re.findall(r"`/([\w/]+)`", names):
                documented[name] = ({"u8": "uint8", "u32": "uint32", "f64": "float64"}[kind], (int(width[1]),) if width else ())
        self.assertEqual(types, documented)

    def test_threads_and_repeats_change_nothing(self):
        self.make("pile", "--count", "80")
        random = np.random.default_rng(1)
        self.move(velocity=random.normal(size=(80, 3)), angular_velocity=3 * random.normal(size=(80, 3)))
        tables = []
        for threads in ("1", "2", "7"):
            report = self.impact("--threads", threads, "--repeat", "2", "--out", self.impacts)
            self.assertEqual(len(report["seconds"]["all"]), 2)
            self.assertGreater(report["found"], 0)
            with h5py.File(self.impacts) as file:
                self.assertEqual(file.attrs["hash"], report["hash"])
                self.assertEqual(file.attrs["found"], report["found"])
            tables.append({name: column.tolist() for name, column in table_of(self.impacts).items()})
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])

    def test_the_summary_is_text_without_json(self):
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)))
        self.assertIn("object pairs", self.passes("impact", self.scene, "--dt", "1"))

    def test_what_makes_no_sense_is_refused(self):
        self.write_scene()
        self.move(velocity=np.zeros((3, 3)))
        self.refuses(UNREADABLE_INPUT, "/simulation/velocity", "3 rows for 2 instances")
        self.write_scene()
        self.move(angular_velocity=np.array([[0, 0, 0], [0, 2000.0, 0]]))
        self.refuses(UNREADABLE_INPUT, "instance 1")
        self.write_scene()
        self.move(centre=np.array([[0, 0, 0], [0, np.nan, 0]]))
        self.refuses(UNREADABLE_INPUT, "/simulation/centre", "not finite")
        self.write_scene()
        for dt in ("-1", "nan", "soon"):
            self.refuses(USAGE, "--dt", arguments=("--dt", dt))
        self.refuses(USAGE, "--dt", arguments=())
        self.refuses(USAGE, "--tolerance", arguments=("--dt", "1", "--tolerance", "-1"))


class CompareImpacts(BenchTest):
    def moving(self, places, velocity, angular_velocity):
        self.write_scene(asset=(0,) * len(places), rotation=(IDENTITY,) * len(places), translation=places)
        with h5py.File(self.scene, "a") as file:
            file["simulation/velocity"] = np.asarray(velocity, "f8")
            file["simulation/angular_velocity"] = np.asarray(angular_velocity, "f8")

    def test_times_are_judged_by_contacts_that_are_found(self):
        # A cube falls on another one, which a third one, that spins, touches from the start.
        still = (0, 0, 0)
        self.moving([still, (0.25, 0.125, 3), (4, 0, 0), (-0.9, -0.9, 0.5)], [still, (0, 0, -4), still, still], [still, still, still, (0, 0, 1)])
        scene, = json.loads(self.passes("compare", self.scene, "--impact", "1", "--repeat", "2", "--json"))["scenes"]
        self.assertEqual([scene[key] for key in ("at_start", "stopped", "in_contact")], [1, 1, 1])
        peers = {peer["name"]: peer for peer in scene["peers"]}
        self.assertEqual([peers["Tandem"][key] for key in ("found", "missed", "late", "invented")], [2, 0, 0, 0])
        for name, peer in peers.items():
            with self.subTest(name):
                self.assertEqual(peer["found"] + peer["missed"] - peer["invented"], 2)
        if "FCL oriented" in peers:
            oriented, sampled = peers["FCL oriented"], peers["FCL 10 poses"]
            self.assertEqual([oriented[key] for key in ("missed", "late", "invented")], [0, 0, 0])
            self.assertEqual((sampled["missed"], sampled["late"]), (0, 1))  # they meet at 1/2 and are seen to at 5/9
            self.assertAlmostEqual(sampled["most_late"], 5 / 9 - 1 / 2, delta=1e-3)

    def test_what_is_of_contacts_or_of_distances_is_refused(self):
        self.moving([(0, 0, 0)], [(0, 0, 0)], [(0, 0, 0)])
        for other in (("--peers", "fcl"), ("--distance", "1")):
            self.assertEqual(self.bench("compare", self.scene, "--impact", "1", *other).returncode, USAGE, other)

    def test_half_a_turn_is_refused(self):
        self.moving([(0, 0, 0), (3, 0, 0)], np.zeros((2, 3)), [(0, 0, 0), (0, 0, 3.2)])
        self.assert_fails(drop_hint(self.bench("compare", self.scene, "--impact", "1")), UNREADABLE_INPUT, "instance 1", "half a turn")


if __name__ == "__main__":
    unittest.main()
