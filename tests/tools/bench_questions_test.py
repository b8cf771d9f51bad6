#!/usr/bin/python3
"""The questions that bvhbench asks of a scene, from the outside: query with --manifolds, --contained, --within and --tolerance, distance, and impact.

Tolerances are asked at levels that bvhbuild makes: of a mesh of this repository, and of ten meshes, scans, CAD, broken ones, of a folder: TANDEM_MESHES, else
../shared/meshes beside the sources. Where that is not there, its tests are skipped. With TANDEM_LONG=1, all ten in 1,000 poses near contact; else four of them
in 60.

Environment: that of bench_test.py.
"""
import json
import os
import pathlib
import re
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

from bench_test import BVHBENCH, IDENTITY, BenchTest, attributes, change, datasets, documented_keys, documented_types, table_of, types_of
from tool_test import BVHBUILD, CUBE_OBJ, SOURCE_DIR, UNREADABLE_INPUT, USAGE

MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
LONG = os.environ.get("TANDEM_LONG") == "1"
FEW = ("spot.obj", "featuretype.STL", "moebius.obj", "triple_vierbein.obj")
TEN = FEW + ("bun_zipper.ply", "armadillo.obj", "koala.obj", "cycloidal.ply", "teapot.obj", "self_intersectA.obj")
APART, TOUCHING, WITHIN = range(3)
NO_FACE = 2**32 - 1


def rows_of(path, group, *others):
    """The datasets of a group by their names in it, behind others by theirs."""
    table = datasets(path)
    return {name: table[name] for name in others} | {name.split("/")[1]: column for name, column in table.items() if name.startswith(group + "/")}


class Probes(BenchTest):
    def probe(self, path, *options):
        return json.loads(self.succeeds(BVHBENCH, "probe", path, "--points", "2000", "--rays", "3000", "--json", *options))

    def test_a_mesh_and_a_scene_of_it_are_asked_and_written_as_a_table(self):
        self.write_scene(translation=((0, 0, 0), (0.25, 0.125, 0.875)))
        out = self.outputs / "probe.csv"
        report = self.probe(self.scene, "--out", out, "--repeat", "2")
        (peer,) = report["peers"]
        self.assertEqual((peer["name"], peer["different_points"], peer["different_rays"]), ("Tandem", 0, 0))
        self.assertTrue(500 < peer["hits"] < 3000, peer["hits"])
        self.assertTrue(peer["point_nanoseconds"] > 0 < peer["ray_nanoseconds"])
        header, row = (line.split(",") for line in out.read_text().splitlines())
        self.assertEqual((header[0], row[0], row[1], row[6]), ("scene", self.scene.stem, "Tandem", str(peer["hits"])))
        # Rays into a cube's bounds hit it.
        self.assertEqual(self.probe(self.mesh)["peers"][0]["hits"], 3000)

    def test_keys_are_documented(self):
        report = self.probe(self.mesh)
        of_report, of_peer = documented_keys("probe SCENE.h5 --json", r"\*\*Keys of a peer\*\*")
        self.assertEqual((set(of_report), set(of_peer)), (set(report), set(report["peers"][0])))


class Manifolds(BenchTest):
    def test_manifolds_are_those_of_a_box_that_lies_on_another(self):
        self.write_scene(translation=((0, 0, 0), (0.25, 0.125, 0.875)))
        report = self.query("--manifolds", "--repeat", "3", "--out", self.contacts)
        table = table_of(self.contacts)
        self.assertEqual((report["manifolds"], report["points"], report["open_curves"]), (1, 4, 0))
        self.assertEqual(len(report["manifold_seconds"]["all"]), 3)
        self.assertEqual(table["manifolds/pair"].tolist(), [0])
        self.assertEqual(table["manifolds/first"].tolist(), [0, 4])
        np.testing.assert_allclose(table["manifolds/normal"], [[0, 0, 1]], atol=1e-12)
        np.testing.assert_allclose(table["manifolds/area"], [0.75 * 0.875], atol=1e-12)
        np.testing.assert_allclose(table["manifolds/depth"], [0.125], atol=1e-12)
        np.testing.assert_allclose(table["manifolds/centre"], [[0.625, 0.5625, 0.9375]], atol=1e-12)
        np.testing.assert_allclose(table["points/depth"], [0.125] * 4, atol=1e-12)
        corners = sorted((x, y, 0.9375) for x in (0.25, 1) for y in (0.125, 1))
        np.testing.assert_allclose(sorted(table["points/position"].tolist()), corners, atol=1e-12)
        # The upper cube's bottom and four sides, against the lower one's top and sides.
        self.assertLessEqual(set(table["points/face_a"].tolist()), set(range(1, 6)))
        self.assertLessEqual(set(table["points/face_b"].tolist()), {0, 2, 3, 4, 5})

    def test_bodies_that_stand_still_keep_their_manifolds(self):
        self.make("pile", "--count", "50")
        report = self.query("--manifolds", "--keep", "1e-3", "--repeat", "3")
        self.assertEqual(report["kept_pairs"], report["object_pairs"])
        self.assertEqual(len(report["kept_seconds"]["all"]), 3)
        self.assertEqual(self.query("--manifolds", "--keep", "0")["kept_pairs"], 0)

    def test_manifolds_are_of_the_documented_types_and_belong_together(self):
        self.make("pile", "--count", "50")
        self.query("--manifolds", "--out", self.contacts)
        table = table_of(self.contacts)
        found = {name: column for name, column in table.items() if name.startswith(("manifolds", "points"))}
        self.assertEqual(types_of(found), documented_types("(?:manifolds|points)/"))
        first, points = table["manifolds/first"].astype(int), table["points/depth"]
        self.assertEqual((first[0], first[-1], len(first)), (0, len(points), len(table["manifolds/pair"]) + 1))
        self.assertGreater(len(points), 50)
        for row, depth in enumerate(table["manifolds/depth"]):
            deepest = points[first[row]:first[row + 1]].max()
            self.assertTrue(0.8 * depth <= deepest <= depth, (deepest, depth))
        self.assertTrue((np.diff(table["manifolds/pair"].astype(int)) >= 0).all())
        self.assertTrue((table["points/id"] != 0).all())

class Contained(BenchTest):
    def contained(self):
        """Reports of a query with --contained, and the rows of its contacts file by name."""
        report = self.query("--contained", "--repeat", "2", "--out", self.contacts)
        rows = rows_of(self.contacts, "contained")
        self.assertEqual({name: str(column.dtype) for name, column in rows.items()},
                         {"pair": "uint32", "inner": "uint8", "component": "uint32", "inside": "uint8", "open": "uint8"})
        self.assertEqual((report["contained_rows"], report["contained"]), (len(rows["pair"]), rows["inside"].sum()))
        self.assertEqual(len(report["contained_seconds"]["all"]), 2)
        return report, {name: column.tolist() for name, column in rows.items()}

    def test_what_touches_is_not_contained(self):
        self.make("pile", "--count", "50")
        self.assertEqual(self.contained()[1]["pair"], [])

    def test_manifolds_and_contained_of_less_than_all_contacts_or_without_topology_are_refused(self):
        self.write_scene()
        for question, others in (("--manifolds", []), ("--contained", [["--mode", "fast"]])):
            for arguments in (["--mode", "boxes"], ["--first-contact"], *others):
                self.assert_refused(USAGE, question, arguments=[question, *arguments])
        self.succeeds(BVHBUILD, self.write("cube.obj", CUBE_OBJ), "--no-topology", "-o", self.mesh)
        for question in ("--manifolds", "--contained"):
            self.assert_refused(UNREADABLE_INPUT, "cube.bvh", "--no-topology", arguments=[question])


class Distance(BenchTest):
    def setUp(self):
        super().setUp()
        self.distances = self.outputs / "distances.h5"

    def row_of_cubes(self, *places, **more):
        self.write_scene(asset=(0,) * len(places), rotation=(IDENTITY,) * len(places), translation=[(x, 0, 0) for x in places], **more)

    def distance(self, *arguments):
        """The report, the datasets and the attributes."""
        report = json.loads(self.passes("distance", self.scene, "--json", "--out", self.distances, *arguments))
        return report, rows_of(self.distances, "distance", "pairs"), attributes(self.distances)

    def test_files_hold_certified_intervals_and_witnesses(self):
        self.row_of_cubes(0, 1.25, 3)
        report, rows, told = self.distance()
        self.assertEqual({name: str(column.dtype) for name, column in rows.items()},
                         {"pairs": "uint32", "lower": "float64", "upper": "float64", "point_a": "float64", "point_b": "float64",
                          "face_a": "uint32", "face_b": "uint32"})
        self.assertEqual(rows["pairs"].tolist(), [[0, 1], [0, 2], [1, 2]])
        for row, truth in enumerate((0.25, 2, 0.75)):
            self.assertLessEqual(rows["lower"][row], truth)
            self.assertGreaterEqual(rows["upper"][row], truth)
            self.assertLessEqual(rows["upper"][row] - rows["lower"][row], 1e-6 * truth)
            self.assertAlmostEqual(np.linalg.norm(rows["point_a"][row] - rows["point_b"][row]), truth, delta=1e-12)
        faces = CUBE_OBJ.count("\nf ")
        self.assertTrue((rows["face_a"] < faces).all() and (rows["face_b"] < faces).all())
        for key in ("object_pairs", "touching", "block_pairs", "by_float32", "by_float64", "hash", "threads", "backend", "relative_tolerance"):
            self.assertEqual(report[key], told[key], key)
        self.assertEqual((report["object_pairs"], report["touching"], report["reach"]), (3, 0, None))
        self.assertAlmostEqual(report["least"], 0.25)

    def test_given_pairs_beyond_reach_are_told_to_be(self):
        self.row_of_cubes(0, 1.25, 3, pairs=np.array([[2, 0], [1, 0]], "u4"))
        report, rows, _ = self.distance("--reach", "1")
        self.assertTrue(report["given_pairs"])
        self.assertEqual(rows["pairs"].tolist(), [[0, 1], [0, 2]])
        self.assertEqual(rows["upper"][1], np.inf)
        self.assertGreaterEqual(rows["lower"][1], 1)
        self.assertEqual(rows["face_a"][1], 2**32 - 1)

    def test_people_are_told_too(self):
        self.row_of_cubes(0, 1.25)
        self.assertRegex(self.passes("distance", self.scene), r"object pairs +1  found\n(.*\n)*  least +0\.25\n")

    def test_what_is_wrong_is_refused(self):
        self.row_of_cubes(0, 1.25)
        for arguments in (["--reach", "-1"], ["--reach", "nan"], ["--tolerance", "2"], ["--absolute", "-1"], ["--threads", "0"]):
            self.assertEqual(self.bench("distance", self.scene, *arguments).returncode, USAGE, arguments)
        self.assertEqual(self.bench("distance", self.outputs / "none.h5").returncode, UNREADABLE_INPUT)

    def test_the_page_lists_the_keys(self):
        self.row_of_cubes(0, 1.25)
        self.assertEqual(sorted(documented_keys("distance SCENE.h5 --json`")[0]), sorted(self.distance()[0]))


class Within(BenchTest):
    def test_manifolds_and_distances_that_are_none_are_refused(self):
        self.write_scene()
        for arguments in (["--manifolds"], ["--contained"]):
            self.assertEqual(self.bench("query", self.scene, "--within", "1", *arguments).returncode, USAGE)
        for distance in ("-1", "nan", "inf"):
            self.assertEqual(self.bench("query", self.scene, "--within", distance).returncode, USAGE)


class CompareDistances(BenchTest):
    def test_all_agree(self):
        self.make("pile", "--count", "60")
        report = json.loads(self.passes("compare", self.scene, "--distance", "1", "--repeat", "2", "--json"))
        scene = report["scenes"][0]
        self.assertGreater(scene["object_pairs"], 50)
        self.assertEqual(scene["peers"][0]["name"], "Tandem")
        self.assertLess(scene["peers"][0]["worst_error"], 1e-6)
        for peer in scene["peers"]:
            self.assertLess(peer["worst_error"], 1e-5, peer["name"])
        self.assertEqual((scene["peers"][-1]["name"], scene["peers"][-1]["outside"]), ("CGAL", 0))

    def test_what_is_of_contacts_is_refused(self):
        self.write_scene()
        self.assertEqual(self.bench("compare", self.scene, "--distance", "1", "--peers", "fcl").returncode, USAGE)


class Impact(BenchTest):
    def setUp(self):
        super().setUp()
        self.impacts = self.outputs / "impacts.h5"

    def move(self, **columns):
        change(self.scene, **{f"simulation_{name}": rows for name, rows in columns.items()})

    def impact(self, *arguments, dt="1"):
        return json.loads(self.passes("impact", self.scene, "--dt", dt, "--json", *arguments))

    def refuses(self, code, *words, arguments=("--dt", "1")):
        result = self.bench("impact", self.scene, *arguments, "--out", self.impacts)
        self.assert_fails(result, code, *words)
        self.assertFalse(self.impacts.exists())

    def test_bodies_turn_about_their_centres_of_mass_unless_the_file_says_otherwise(self):
        # A rod along x above a cube, its end beyond the cube's side, turns downwards about y.
        rod = re.sub(r"^v (\S+)", lambda v: f"v {8 * float(v[1])}", CUBE_OBJ, flags=re.M)
        self.mesh_of("rod", rod)
        self.write_scene(asset=(0, 1), assets=("../in/cube.bvh", "../in/rod.bvh"), translation=((3, 0, 0), (0, 0, 2)))
        self.move(angular_velocity=np.array([[0, 0, 0], [0, 1.0, 0]]))
        self.impact("--out", self.impacts)
        mass, centre = datasets(self.impacts), np.array([4, 0.5, 2.5])
        np.testing.assert_allclose(mass["motion/centre"][1], centre, atol=1e-6)
        # Its lower edge at x = 8 is (4, -0.5) from the centre; it reaches no cube, and no cube reaches it.
        self.assertEqual(mass["impact/status"].tolist(), [0])
        self.move(centre=np.array([[0, 0, 0], [0, 0.5, 2.5]]))
        self.impact("--out", self.impacts)
        given = datasets(self.impacts)
        self.assertEqual(given["motion/centre"].tolist(), [[0, 0, 0], [0, 0.5, 2.5]])
        self.assertEqual(given["impact/status"].tolist(), [1])
        t, c = given["impact/t_safe"][0], np.array([0, 0.5, 2.5])
        # The rod's lower side meets the cube's upper edge at x = 4: in the rod's frame that edge is 0.5 below the axis.
        edge = Rotation.from_rotvec([0, -t, 0]).apply(np.array([4, 0.5, 1]) - c)
        np.testing.assert_allclose(edge[2], -0.5, atol=1e-5)
        self.assertLess(edge[2], -0.5)

    def test_datasets_are_of_the_documented_types(self):
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)))
        self.impact("--out", self.impacts)
        self.assertEqual(types_of(datasets(self.impacts)), documented_types("(?:pairs|impact|motion)"))

    def test_threads_and_repeats_change_nothing(self):
        self.make("pile", "--count", "80")
        random = np.random.default_rng(1)
        self.move(velocity=random.normal(size=(80, 3)), angular_velocity=3 * random.normal(size=(80, 3)))
        tables = []
        for threads in ("1", "2", "7"):
            report = self.impact("--threads", threads, "--repeat", "2", "--out", self.impacts)
            self.assertEqual(len(report["seconds"]["all"]), 2)
            self.assertGreater(report["found"], 0)
            for key in ("hash", "found"):
                self.assertEqual(attributes(self.impacts)[key], report[key])
            tables.append({name: column.tolist() for name, column in datasets(self.impacts).items()})
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])

    def test_the_summary_is_text_without_json(self):
        self.write_scene(translation=((0, 0, 0), (0, 0, 3)))
        self.assertIn("object pairs", self.passes("impact", self.scene, "--dt", "1"))

    def test_what_makes_no_sense_is_refused(self):
        for wrong, words in (({"velocity": np.zeros((3, 3))}, ("/simulation/velocity", "3 rows for 2 instances")),
                             ({"angular_velocity": np.array([[0, 0, 0], [0, 2000.0, 0]])}, ("instance 1",)),
                             ({"centre": np.array([[0, 0, 0], [0, np.nan, 0]])}, ("/simulation/centre", "not finite"))):
            self.write_scene()
            self.move(**wrong)
            self.refuses(UNREADABLE_INPUT, *words)
        self.write_scene()
        for dt in ("-1", "nan", "soon"):
            self.refuses(USAGE, "--dt", arguments=("--dt", dt))
        self.refuses(USAGE, "--dt", arguments=())
        self.refuses(USAGE, "--tolerance", arguments=("--dt", "1", "--tolerance", "-1"))


class CompareImpacts(BenchTest):
    def moving(self, places, velocity, angular_velocity):
        self.write_scene(asset=(0,) * len(places), rotation=(IDENTITY,) * len(places), translation=places)
        change(self.scene, simulation_velocity=np.asarray(velocity, "f8"), simulation_angular_velocity=np.asarray(angular_velocity, "f8"))

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
        self.assert_fails(self.bench("compare", self.scene, "--impact", "1"), UNREADABLE_INPUT, "instance 1", "half a turn")


class ToleranceTest(BenchTest):
    def with_levels(self, mesh, levels="0.1%,0.3%,1%,3%"):
        """The file of a mesh with levels, and their errors."""
        path = self.inputs / f"{pathlib.Path(mesh).stem}.bvh"
        self.succeeds(BVHBUILD, mesh, "-o", path, "--levels", levels, "--effort", "fast", "--json", timeout=300)
        return path, [level["error_bound"] for level in self.info_json(path)["levels"]]

    def decide(self, tolerance, *arguments):
        verdicts = self.outputs / "verdicts.h5"
        report = json.loads(self.passes("query", self.scene, "--tolerance", repr(tolerance), "--json", "--out", verdicts, *arguments,
                                        timeout=300))
        return report, rows_of(verdicts, "verdict", "pairs"), attributes(verdicts)

    def truth(self):
        """Of each pair whether its finest levels meet, and its distance, from above."""
        contacts, distances = self.outputs / "contacts.h5", self.outputs / "distances.h5"
        self.passes("query", self.scene, "--first-contact", "--out", contacts, timeout=300)
        self.passes("distance", self.scene, "--out", distances, timeout=300)
        first, apart = datasets(contacts), datasets(distances)
        self.assertTrue((first["pairs"] == apart["pairs"]).all())
        meets = np.zeros(len(first["pairs"]), bool)
        meets[first["contacts/pair"]] = True
        return first["pairs"], meets, apart["distance/upper"]

    def assert_right(self, tolerances):
        """Verdicts at all tolerances are those of the finest levels. Result: how many pairs each verdict had."""
        pairs, meets, upper = self.truth()
        counted = []
        for tolerance in tolerances:
            report, rows, told = self.decide(tolerance)
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
                self.assertEqual(report[name], told[name], name)
            self.assertEqual(sum(row["pairs"] for row in report["decided_at"]), len(pairs))
        self.assertEqual(counted[0][WITHIN], 0)
        self.assertEqual(counted[0][TOUCHING], meets.sum())
        return counted

    def write_near_poses(self, path, count, share):
        """Pairs near contact: bodies of near_contact, moved by up to a share of their size in any direction."""
        poses = self.outputs / "poses.h5"
        self.passes("poses", path, "--count", str(count), "-o", poses, timeout=300)
        random = np.random.default_rng(1)
        pairs, rotation, translation = datasets(poses, "pairs", "instances/rotation", "instances/translation").values()
        size = self.info_json(path)["bounds"]
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
            self.assert_fails(self.bench("query", self.scene, "--tolerance", bad), USAGE, "--tolerance")


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
