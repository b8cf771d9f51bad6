#!/usr/bin/python3
"""bvhbench query --manifolds and --contained from the outside. Environment: that of bench_test.py."""
import re
import unittest

import h5py
import numpy as np

from bench_test import BenchTest, table_of
from tool_test import CUBE_OBJ, DONE, SOURCE_DIR, UNREADABLE_INPUT, USAGE


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

    def test_manifolds_are_of_the_documented_types_and_belong_together(self):
        self.make("pile", "--count", "50")
        self.query("--manifolds", "--out", self.contacts)
        table = table_of(self.contacts)
        types = {name: (str(column.dtype), column.shape[1:]) for name, column in table.items() if name[0] in "mp"}
        page = (SOURCE_DIR / "docs" / "scenes.md").read_text()
        documented = {}
        for names, kind, width in re.findall(r"^\| (`/(?:manifolds|points)/.*?) \| ([uf]\d\d) \[\w\+?1?(,3)?\]", page, re.M):
            for name in re.findall(r"`/([\w/]+)`", names):
                documented[name] = ({"u32": "uint32", "u64": "uint64", "f64": "float64"}[kind], (3,) if width else ())
        types.pop("pairs")
        self.assertEqual(types, documented)
        first, points = table["manifolds/first"].astype(int), table["points/depth"]
        self.assertEqual((first[0], first[-1], len(first)), (0, len(points), len(table["manifolds/pair"]) + 1))
        self.assertGreater(len(points), 50)
        for row, depth in enumerate(table["manifolds/depth"]):
            deepest = points[first[row]:first[row + 1]].max()
            self.assertTrue(0.8 * depth <= deepest <= depth, (deepest, depth))
        self.assertTrue((np.diff(table["manifolds/pair"].astype(int)) >= 0).all())
        self.assertTrue((table["points/id"] != 0).all())

    def test_manifolds_do_not_change_with_threads_and_leave_the_contacts_as_they_are(self):
        self.make("pile", "--count", "60")
        self.query("--out", self.contacts)
        plain, tables = table_of(self.contacts), []
        for threads in ("1", "2", "7"):
            self.query("--manifolds", "--threads", threads, "--out", self.contacts)
            tables.append({name: column.tolist() for name, column in table_of(self.contacts).items()})
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])
        for name, column in plain.items():
            self.assertEqual(tables[0][name], column.tolist())
            self.assertNotIn("manifolds", name)

    def test_manifolds_of_a_mesh_without_topology_are_refused_with_its_name(self):
        self.write_scene()
        result = self.build(self.write("cube.obj", CUBE_OBJ), "--no-topology", "-o", self.mesh)
        self.assertEqual(result.returncode, DONE, result.stderr)
        self.assert_refused(UNREADABLE_INPUT, "cube.bvh", "--no-topology", arguments=["--manifolds"])

    def test_manifolds_of_less_than_all_contacts_are_refused(self):
        self.write_scene()
        for arguments in (["--mode", "boxes"], ["--first-contact"]):
            self.assert_refused(USAGE, "--manifolds", arguments=["--manifolds", *arguments])


class Contained(BenchTest):
    def contained(self):
        """Reports of a query with --contained, and the rows of its contacts file by name."""
        report = self.query("--contained", "--repeat", "2", "--out", self.contacts)
        with h5py.File(self.contacts) as file:
            rows = {name: column[:] for name, column in file["contained"].items()}
        self.assertEqual({name: str(column.dtype) for name, column in rows.items()},
                         {"pair": "uint32", "inner": "uint8", "component": "uint32", "inside": "uint8", "open": "uint8"})
        self.assertEqual((report["contained_rows"], report["contained"]), (len(rows["pair"]), rows["inside"].sum()))
        self.assertEqual(len(report["contained_seconds"]["all"]), 2)
        return report, {name: column.tolist() for name, column in rows.items()}

    def write_nest(self, inner, outer):
        """A cube of inner's mesh, within one of outer's that is ten times as large."""
        asset = [self.mesh_of("small", inner), self.mesh_of("large", re.sub(r"(?m)^(v .*)$", self.enlarged, outer))]
        self.write_scene(asset=(0, 1), translation=((0, 0, 0), (-4, -4, -4)), assets=[f"../in/{mesh.name}" for mesh in asset])

    @staticmethod
    def enlarged(line):
        return "v " + " ".join(str(10 * float(word)) for word in line.group(1).split()[1:])

    def test_a_cube_within_a_cube_is_contained(self):
        self.write_nest(CUBE_OBJ, CUBE_OBJ)
        report, rows = self.contained()
        self.assertEqual(report["contacts"], 0)
        self.assertEqual(rows, {"pair": [0], "inner": [0], "component": [0], "inside": [1], "open": [0]})
        self.assertRegex(self.passes("query", self.scene, "--contained"), r"contained +1\n")

    def test_a_cube_within_an_open_one_is_said_to_be(self):
        self.write_nest(CUBE_OBJ, CUBE_OBJ.rsplit("f ", 1)[0])
        self.assertEqual(self.contained()[1], {"pair": [0], "inner": [0], "component": [0], "inside": [0], "open": [1]})

    def test_what_touches_is_not_contained(self):
        self.make("pile", "--count", "50")
        self.assertEqual(self.contained()[1]["pair"], [])

    def test_contained_of_less_than_all_contacts_or_without_topology_is_refused(self):
        self.write_scene()
        for arguments in (["--mode", "boxes"], ["--mode", "fast"], ["--first-contact"]):
            self.assert_refused(USAGE, "--contained", arguments=["--contained", *arguments])
        result = self.build(self.write("cube.obj", CUBE_OBJ), "--no-topology", "-o", self.mesh)
        self.assertEqual(result.returncode, DONE, result.stderr)
        self.assert_refused(UNREADABLE_INPUT, "cube.bvh", "--no-topology", arguments=["--contained"])


if __name__ == "__main__":
    unittest.main()
