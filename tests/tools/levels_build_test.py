#!/usr/bin/python3
"""bvhbuild --levels: counts, bounds, what is kept and what is told. Environment: that of cli_test.py."""
import json
import re
import unittest

import bvh_file
import numpy as np

from tool_test import BVHBUILD, CUBE_OBJ, DONE, SOURCE_DIR, USAGE, ToolTest, obj, sheet


def ball(rows, bumps=0.05, centre=(0, 0, 0)):
    """A bumpy ball of 4 rows (rows - 1) triangles, closed."""
    columns = 2 * rows
    points = [(0, 0, 1)]
    for i in range(1, rows):
        for j in range(columns):
            t, p = np.pi * i / rows, 2 * np.pi * j / columns
            points.append((np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)))
    points = np.array(points + [(0, 0, -1)])
    ring = lambda i, j: 1 + (i - 1) * columns + j % columns
    faces = []
    for j in range(columns):
        faces += [(0, ring(1, j), ring(1, j + 1)), (ring(rows - 1, j + 1), ring(rows - 1, j), len(points) - 1)]
        for i in range(1, rows - 1):
            faces += [(ring(i, j), ring(i + 1, j), ring(i + 1, j + 1)), (ring(i, j), ring(i + 1, j + 1), ring(i, j + 1))]
    radius = 1 + bumps * np.sin(7 * points[:, 0]) * np.cos(5 * points[:, 1])
    return points * radius[:, None] + centre, faces


def moebius(columns=60, rows=6):
    points, faces = [], []
    for j in range(columns):
        angle = 2 * np.pi * j / columns
        for i in range(rows + 1):
            across = (i / rows - 0.5) * 0.6
            radius = 1 + across * np.cos(angle / 2)
            points.append((radius * np.cos(angle), radius * np.sin(angle), across * np.sin(angle / 2)))
    corner = lambda i, j: j * (rows + 1) + i if j < columns else rows - i
    for j in range(columns):
        for i in range(rows):
            faces += [(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)),
                      (corner(i, j), corner(i + 1, j + 1), corner(i, j + 1))]
    return points, faces


def three_sheets(rows=12):
    """Three squares that meet at an edge of the z axis."""
    points, faces = [], []
    for angle in (0, 2, 4):
        flat, sides = sheet(rows, lambda x, y: 0.05 * np.sin(9 * x) * x)
        x, z, off = flat.T
        faces += [tuple(np.asarray(side) + len(points)) for side in sides]
        points += list(np.stack([x * np.cos(angle) - off * np.sin(angle), x * np.sin(angle) + off * np.cos(angle), z], 1))
    return points, faces


def distance_squares(points, triangles):
    """Of each point from the nearest of the triangles; projections on planes, edges and corners."""
    least = np.full(len(points), np.inf)
    for a, b, c in triangles:
        for p, q in ((a, b), (b, c), (c, a)):
            along = q - p
            length = along @ along
            t = np.clip((points - p) @ along / length, 0, 1) if length > 0 else np.zeros(len(points))
            off = points - (p + t[:, None] * along)
            least = np.minimum(least, np.einsum("ij,ij->i", off, off))
        normal = np.cross(b - a, c - a)
        if not normal.any():
            continue
        normal = normal / np.linalg.norm(normal)
        height = (points - a) @ normal
        foot = points - height[:, None] * normal
        inside = np.ones(len(points), bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= np.cross(q - p, foot - p) @ normal >= 0
        least[inside] = np.minimum(least[inside], height[inside] ** 2)
    return least


def samples(triangles, rng, count=4):
    weights = rng.dirichlet((1, 1, 1), (count, len(triangles)))
    inner = np.einsum("ktc,tcx->ktx", weights, triangles).reshape(-1, 3)
    return np.concatenate([triangles.reshape(-1, 3), inner])


class Levels(ToolTest):
    def levels_of(self, path):
        count = len(bvh_file.read(path).levels)
        return [bvh_file.read(path, level) for level in range(count)]

    def assert_levels(self, report, path, farthest=()):
        """The report says what the file holds, errors ascend within what was asked for, counts descend, each level
        is sound, and samples find no point beyond its bound."""
        files = self.levels_of(path)
        rows = report["levels"]
        self.assertEqual([row["triangles"] for row in rows], [len(file.triangles) for file in files])
        self.assertEqual([row["error_bound"] for row in rows], list(files[0].levels["error_bound"]))
        finest = files[0].corners.astype(float)
        diagonal = np.linalg.norm(files[0].upper.astype(float) - files[0].lower)
        rng = np.random.default_rng(1)
        before = rows[0]
        self.assertEqual((before["wanted"], before["error_bound"]), (None, 0))
        for row, file in list(zip(rows, files))[1:]:
            wanted = float(row["wanted"].rstrip("%")) * (diagonal / 100 if row["wanted"].endswith("%") else 1)
            self.assertLess(row["triangles"], before["triangles"])
            self.assertLessEqual(before["error_bound"], row["error_bound"])
            self.assertLessEqual(row["error_bound"], wanted * (1 + 1e-6))
            self.assertAlmostEqual(row["error_bound_relative"], row["error_bound"] / diagonal, delta=1e-9)
            self.assertEqual(bvh_file.defects_of_tree(file), [])
            self.assertEqual(bvh_file.defects_of_topology(file), [])
            self.assertEqual((file.blocks["kind"] == bvh_file.IMAGINARY).sum(),
                             bvh_file.imaginary_minimum(len(file.triangles)))
            coarse = file.corners.astype(float)
            self.assertTrue((coarse >= file.lower).all() and (coarse <= file.upper).all())
            there = distance_squares(samples(coarse, rng), finest).max() ** 0.5
            back = distance_squares(samples(finest, rng, 1), coarse).max() ** 0.5
            self.assertLessEqual(max(there, back), row["error_bound"] * (1 + 1e-9))
            before = row
        result = self.info(path, "--verify", "--levels")
        self.assertEqual(result.returncode, DONE, result.stdout + result.stderr)
        return files

    def test_a_closed_surface_stays_closed_and_near(self):
        report = self.built_json("ball.obj", obj(*ball(24)), "--levels", "0.2%,1%,0.1")
        self.assertEqual(len(report["levels"]), 4)
        self.assertEqual(report["levels_left_out"], [])
        self.assertEqual(report["fixed_vertices"], 0)
        self.assert_levels(report, self.out)
        for row in report["levels"]:
            self.assertTrue(row["closed"])
            self.assertEqual(row["self_contacts"], 0)
        self.assertLess(report["levels"][2]["triangles"], report["levels"][0]["triangles"] / 4)
        self.assertLess(report["levels"][3]["triangles"], 100)

    def test_the_finest_level_is_what_it_is_without_levels(self):
        mesh = obj(*ball(10))
        alone = bvh_file.read(self.built("ball.obj", mesh))
        finest = bvh_file.read(self.built("ball.obj", mesh, "--levels", "auto"))
        self.assertGreater(len(finest.levels), 2)
        for name in ("blocks", "triangles", "oriented_blocks", "topology", "components"):
            self.assertEqual(getattr(alone, name).tobytes(), getattr(finest, name).tobytes(), name)
        self.assertEqual(finest.provenance["options"]["levels"], ["0.1%", "0.3%", "1%", "3%"])
        self.assertNotIn("levels", alone.provenance["options"])
        self.assertEqual(len(alone.levels), 1)

    def test_what_files_leave_out_levels_leave_out(self):
        out = self.built("ball.obj", obj(*ball(10)), "--levels", "3%", "--no-topology", "--no-gpu-blocks")
        for file in self.levels_of(out):
            self.assertIsNone(file.topology)
            self.assertIsNone(file.oriented_blocks)

    def test_the_result_does_not_depend_on_threads(self):
        mesh = obj(*ball(16))
        files = [self.built("ball.obj", mesh, "--levels", "auto", "--threads", str(n)).read_bytes() for n in (1, 2, 5)]
        self.assertEqual(files[0], files[1])
        self.assertEqual(files[0], files[2])

    def test_a_level_far_from_the_origin_of_the_file(self):
        report = self.built_json("ball.obj", obj(*ball(16, centre=(500000.3, 0, -7000000.7))), "--levels", "1%")
        self.assertNotEqual(report["origin"], [0, 0, 0])
        self.assert_levels(report, self.out)
        self.assertIsNotNone(report["levels"][1]["self_contacts"])

    def test_triangles_have_the_source_face_nearest_to_their_middles(self):
        points, faces = ball(12)
        other, more = ball(12, centre=(5, 0, 0))
        text = "o left\n" + obj(points, faces) + "o right\n" + obj(other, more, 1 + len(points))
        self.assert_levels(self.built_json("two.obj", text, "--levels", "1%,4%"), self.out)
        for file in self.levels_of(self.out)[1:]:
            middles = file.corners.astype(float).mean(1)
            self.assertEqual(list(file.part), [int(x > 2.5) for x in middles[:, 0]])
            finest = bvh_file.read(self.out).corners.astype(float)
            faces_of_finest = bvh_file.read(self.out).source_face
            for middle, face in zip(middles, file.source_face):
                own = finest[faces_of_finest == face]
                self.assertLess(abs(distance_squares(middle[None], own)[0] ** 0.5 -
                                    distance_squares(middle[None], finest)[0] ** 0.5), 1e-6)

    def test_a_flat_subdivision_needs_no_more_than_what_was_subdivided(self):
        made = self.succeeds(BVHBUILD, SOURCE_DIR / "assets" / "cow_24000.obj", "-o", self.out, "--levels", "0.001%", "--json", timeout=300)
        level = json.loads(made)["levels"][1]
        self.assertLessEqual(level["triangles"], 1500)
        self.assertLess(level["error_bound_relative"], 2e-7)
        self.assertTrue(level["closed"])

    def test_an_open_surface_keeps_its_boundary_near(self):
        report = self.built_json("sheet.obj", obj(*sheet(20, lambda x, y: 0.1 * np.sin(5 * x) * y)), "--levels", "0.3%,2%")
        files = self.assert_levels(report, self.out)
        self.assertEqual(len(files), 3)
        for file in files:
            flat = [(0, 0), (1, 0), (0, 1)]
            corners = file.corners.reshape(-1, 3)[:, :2].astype(float)
            for corner in flat:
                self.assertLess(np.linalg.norm(corners - corner, axis=1).min(), 0.04)
        self.assertFalse(report["levels"][2]["closed"])

    def test_a_flat_sheet_becomes_two_triangles(self):
        report = self.built_json("flat.obj", obj(*sheet(16, lambda x, y: 0 * x)), "--levels", "0.01%,1%")
        self.assertLessEqual(report["levels"][1]["triangles"], 4)
        self.assert_levels(report, self.out)

    def test_surfaces_that_no_manifold_is_stay_joined(self):
        for name, mesh, fixed in (("sheets", three_sheets(), 13), ("moebius", moebius(), None)):
            with self.subTest(name):
                report = self.built_json(name + ".obj", obj(*mesh), "--levels", "0.5%,3%")
                files = self.assert_levels(report, self.out)
                self.assertEqual(len(files), 3)
                if fixed:
                    self.assertEqual(report["fixed_vertices"], fixed)
                for file in files:
                    self.assertEqual(len(file.components), 1)
                    if fixed:
                        on_axis = [c for c in map(tuple, file.corners.reshape(-1, 3)) if c[:2] == (0, 0)]
                        self.assertEqual(sorted({c[2] for c in on_axis}), [np.float32(i / 12) for i in range(13)])
                        self.assertEqual((file.topology["flags"] & 112 > 0).sum(), 36)
                self.assertIn(b"in place at every level",
                              self.build(self.inputs / (name + ".obj"), "-o", self.out, "--levels", "3%").stdout)

    def test_closed_surfaces_along_an_edge_stay_closed(self):
        """Four blocks around an axis, with two coincident walls between neighbours."""
        points, faces = [], []
        for block in range(4):
            x, y = ((1, 0), (0, 1), (-1, 0), (0, -1))[block]
            for axis in range(3):
                for end in (0, 1):
                    flat, sides = sheet(6, lambda a, b: np.full(len(a), float(end)))
                    cube = np.roll(flat, axis - 2, axis=1)
                    turned = np.stack([cube[:, 0] * x - cube[:, 1] * y, cube[:, 0] * y + cube[:, 1] * x, cube[:, 2]], 1)
                    wobble = 1 + 0.03 * np.sin(3 * turned[:, 2:]) * np.array([1, 1, 0])
                    faces += [tuple(np.asarray(side)[::1 if end else -1] + len(points)) for side in sides]
                    points += list(np.round(turned * wobble, 6))
        report = self.built_json("blocks.obj", obj(points, faces), "--levels", "0.5%,2%")
        self.assertGreater(report["fixed_vertices"], 20)
        files = self.assert_levels(report, self.out)
        self.assertGreater(len(files), 1)
        for row in report["levels"]:
            self.assertTrue(row["closed"])

    def test_balls_that_touch_in_a_vertex_still_do(self):
        points, faces = ball(12, bumps=0)
        text = obj(points, faces) + obj(points + np.array([0, 0, 2]), faces, 1 + len(points))
        report = self.built_json("two.obj", text, "--levels", "2%")
        self.assertEqual(report["fixed_vertices"], 1)
        self.assert_levels(report, self.out)
        corners = bvh_file.read(self.out, 1).corners.reshape(-1, 3)
        self.assertTrue((corners == np.float32((0, 0, 1))).all(1).any())

    def test_meshes_of_few_bad_or_repeated_triangles_do_not_fail(self):
        needle = "v 0 0 0\nv 1 0 0\nv 0.5 1e-30 0\nv 0 1 0\nf 1 2 4\nf 1 2 3\n"
        repeated = CUBE_OBJ + "f 1 2 3 4\nf 4 3 2 1\nf 5 6 7 8\n"
        rng = np.random.default_rng(2)
        soup = obj(rng.uniform(-1, 1, (90, 3)), np.arange(90).reshape(-1, 3))
        point = "v 1 1 1\nv 1 1 1.00000001\nv 1.00000001 1 1\nf 1 2 3\n"
        huge = obj(np.array(ball(8)[0]) * 3e38, ball(8)[1])
        tiny = obj(np.array(ball(8)[0]) * 1e-40, ball(8)[1])
        for name, mesh in (("triangle", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ("cube", CUBE_OBJ), ("needle", needle),
                           ("repeated", repeated), ("soup", soup), ("point", point), ("huge", huge), ("tiny", tiny)):
            with self.subTest(name):
                report = self.built_json(name + ".obj", mesh, "--levels", "auto")
                self.assertEqual(len(report["levels"]) + len(report["levels_left_out"]), 5)
                self.assertEqual(self.info(self.out, "--verify", "--levels").returncode, DONE)

    def test_levels_that_would_be_no_coarser_are_told(self):
        report = self.built_json("cube.obj", CUBE_OBJ, "--levels", "1%,2%")
        self.assertEqual((len(report["levels"]), report["levels_left_out"]), (1, ["1%", "2%"]))
        self.assertIn(b"no level for 2%", self.build(self.inputs / "cube.obj", "-o", self.out, "--levels", "2%").stdout)
        self.assertEqual(len(bvh_file.read(self.out).levels), 1)

    def test_levels_that_a_coarser_and_nearer_one_spares_are_told(self):
        errors = ",".join(f"{error:.4g}%" for error in np.linspace(0.2, 1, 25))
        mesh = self.write("ball.obj", obj(*ball(11)))
        page = self.build(mesh, "-o", self.out, "--levels", errors, "--effort", "fast").stdout.decode()
        spared = re.findall("no level for (.*)%: a later one is coarser and nearer\n", page)
        self.assertGreater(len(spared), 0)
        report = self.built_json("ball.obj", obj(*ball(11)), "--levels", errors, "--effort", "fast")
        self.assert_levels(report, self.out)
        for error in spared:
            self.assertIn(error + "%", report["levels_left_out"])
            # Of levels with more triangles and larger errors there would be no use.
            later = next(row for row in report["levels"][1:] if float(row["wanted"][:-1]) > float(error))
            self.assertLess(100 * later["error_bound_relative"], float(error))

    def test_a_surface_that_meets_itself_is_told(self):
        points, faces = ball(12)
        text = obj(points, faces) + obj(points + np.array([1, 0, 0]), faces, 1 + len(points))
        report = self.built_json("two.obj", text, "--levels", "1%")
        for row in report["levels"]:
            self.assertGreater(row["self_contacts"], 10)
        self.assertIn(b"meets itself at", self.build(self.inputs / "two.obj", "-o", self.out, "--levels", "1%").stdout)

    def test_self_contacts_are_counted_up_to_a_million(self):
        rng = np.random.default_rng(4)
        soup = obj(rng.uniform(-1, 1, (9000, 3)), np.arange(9000).reshape(-1, 3))
        report = self.built_json("soup.obj", soup, "--levels", "0.1%", "--effort", "fast")
        self.assertIsNone(report["levels"][0]["self_contacts"])
        self.assertLess(report["peak_memory_bytes"], 100 << 20)
        self.assertIn(b", meets itself too often to be counted\n",
                      self.build(self.inputs / "soup.obj", "-o", self.out, "--levels", "0.1%", "--effort", "fast").stdout)

    def test_wrong_errors_are_usage_errors(self):
        mesh = self.write("cube.obj", CUBE_OBJ)
        for text, word in (("", "--levels"), ("0", "'0'"), ("-1%", "'-1%'"), ("nan", "'nan'"), ("inf", "'inf'"), ("1%%", "'1%%'"),
                           ("1%,", "''"), ("2,1", "ascend"), ("1%,1%", "ascend"), ("1e999", "'1e999'"), ("automatic", "'automatic'"),
                           (",".join(str(i) for i in range(1, 33)), "room for 31")):
            with self.subTest(text):
                self.assert_fails(self.build(mesh, "-o", self.out, "--levels", text), USAGE, word)
                self.assertFalse(self.out.exists())
        # Only the mesh says which is larger.
        self.assert_fails(self.build(mesh, "-o", self.out, "--levels", "1%,0.001"), USAGE, "cube.obj", "not larger than 1%",
                          f"for a diagonal of {3 ** 0.5:.6g}")
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    unittest.main()
