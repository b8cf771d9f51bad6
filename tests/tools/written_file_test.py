#!/usr/bin/python3
"""What bvhbuild writes, held against an independent reader of the format: trees, faces, coordinates, provenance.

Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO (the binaries), TANDEM_SOURCE_DIR.
"""
import base64
import json
import unittest

import bvh_file
import numpy as np

from tool_test import (COLLADA_TRIANGLE, CUBE_OBJ, DONE, SOURCE_DIR, TRIANGLE_OBJ, ToolTest, grid_ply,
                       scattered_obj, soup_obj)


def corner_sets(file):
    """For each triangle the set of its corners, in the file's coordinates."""
    return [frozenset(map(tuple, corners)) for corners in file.world.tolist()]


class Oracle(ToolTest):
    """The independent reader finds nothing wrong, and the counts are those of the formulas."""

    def assert_sound(self, path, triangles, minimal=True):
        file = bvh_file.read(path)
        self.assertEqual(len(file.triangles), triangles)
        self.assertEqual(bvh_file.defects_of_tree(file), [])
        imaginary = int((file.blocks["kind"] == bvh_file.IMAGINARY).sum())
        least = bvh_file.imaginary_minimum(triangles)
        if minimal:
            self.assertEqual(imaginary, least)
        else:
            self.assertGreaterEqual(imaginary, least)
        self.assertEqual(bvh_file.defects_of_topology(file), [])
        if triangles <= 2000:
            self.assertEqual(bvh_file.defects_of_boxes(file), [])
            self.assertEqual(bvh_file.defects_of_oriented_blocks(file), [])
            self.assertEqual(bvh_file.xxh64(file.raw[16:]), file.hash)
        corners = file.corners.reshape(-1, 3)
        np.testing.assert_array_equal(corners.min(0), file.lower)
        np.testing.assert_array_equal(corners.max(0), file.upper)
        return file

    def test_the_hash_of_the_reader_is_the_published_one(self):
        self.assertEqual(bvh_file.xxh64(b""), 0xEF46DB3751D8E999)
        self.assertEqual(bvh_file.xxh64(b"Nobody inspects the spammish repetition"), 0xFBCEA83C8A378BF1)

    def test_meshes_of_every_remainder_are_sound(self):
        for triangles in [*range(1, 30), 60, 61, 62, 63, 64, 65]:
            for imaginary in ("minimal", "free"):
                with self.subTest(triangles=triangles, imaginary=imaginary):
                    out = self.built("a.obj", scattered_obj(triangles, seed=triangles), "--imaginary", imaginary)
                    self.assert_sound(out, triangles, minimal=imaginary == "minimal")

    def test_the_projects_own_meshes_are_sound(self):
        for name, triangles in (("box_12.obj", 12), ("box_192.obj", 192), ("cow_1500.obj", 1500), ("cow.obj", 6000)):
            self.assertEqual(self.build(SOURCE_DIR / "assets" / name, "-o", self.out).returncode, DONE)
            self.assert_sound(self.out, triangles)

    def test_oriented_blocks_are_fitted_by_every_effort_and_left_out_where_asked(self):
        blocks = {}
        for effort in ("fast", "default", "best"):
            out = self.built("a.obj", scattered_obj(300), "--effort", effort)
            blocks[effort] = self.assert_sound(out, 300).oriented_blocks
            self.assertGreater((blocks[effort]["quaternion"] != (2048 + 2047, 2048, 2048, 2048)).any(1).mean(), 0.5)
        with_them = self.built("a.obj", scattered_obj(300)).stat().st_size
        out = self.built("a.obj", scattered_obj(300), "--no-gpu-blocks")
        self.assertIsNone(bvh_file.read(out).oriented_blocks)
        self.assertEqual(bvh_file.read(out).provenance["options"]["gpu_blocks"], False)
        self.assertAlmostEqual((with_them - out.stat().st_size) / 112, len(blocks["fast"]), delta=512 / 112)

    def test_topology_is_left_out_where_asked(self):
        with_it = self.built("a.obj", scattered_obj(300)).stat().st_size
        out = self.built("a.obj", scattered_obj(300), "--no-topology")
        file = bvh_file.read(out)
        self.assertIsNone(file.topology)
        self.assertIsNone(file.components)
        self.assertEqual(file.provenance["options"]["topology"], False)
        self.assertEqual((file.levels[0]["vertices"], file.levels[0]["flags"]), (0, 0))
        self.assertAlmostEqual(with_it - out.stat().st_size, 16 * 300 + 16 * 300, delta=512 + 4 * (900 + 160))

    def test_source_vertices_are_rows_of_the_file_and_left_out_where_asked(self):
        # Vertex 0 belongs to no face, 2 and 5 lie at one place, and so do 3 and 6 but for the sign of a zero.
        rows = [(9, 9, 9), (0, 0, 0), (1, 0, 0), (0, 1, 0), (5, 5, 5), (1, 0, 0), (-0.0, 1, 0), (1, 1, 1)]
        obj = "".join(f"v {x} {y} {z}\n" for x, y, z in rows) + "f 2 3 4\nf 6 8 7\n"
        with_it = bvh_file.read(self.built("a.obj", obj))
        self.assertEqual(with_it.source_vertex_count, 8)
        self.assertEqual(sorted(with_it.source_vertices), [1, 2, 3, 7])
        for triangle, corners in zip(with_it.topology, with_it.world):
            for vertex, place in zip(triangle["vertex"], corners):
                self.assertEqual(tuple(place), tuple(map(float, rows[with_it.source_vertices[vertex]])))
        self.assertEqual(bvh_file.defects_of_topology(with_it) + bvh_file.defects_of_oriented_blocks(with_it), [])
        for option in ("--no-refit", "--no-topology"):
            out = bvh_file.read(self.built("a.obj", obj, option))
            self.assertEqual(out.source_vertex_count, 0)
            self.assertIsNone(out.source_vertices)
        without = bvh_file.read(self.built("a.obj", obj, "--no-refit"))
        self.assertEqual(without.provenance["options"]["refit"], False)
        for section in ("blocks", "triangles", "oriented_blocks", "topology", "components"):
            self.assertEqual(getattr(without, section).tobytes(), getattr(with_it, section).tobytes())
        plain = bvh_file.read(self.built("a.obj", obj, "--no-gpu-blocks"))
        self.assertIsNotNone(plain.source_vertices)

    def test_corners_of_stl_facets_and_the_vertices_of_each_part_are_source_vertices(self):
        facet = "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 %d\nendloop\nendfacet\n"
        stl = bvh_file.read(self.built("a.stl", "solid a\n" + facet % 0 + facet % 1 + "endsolid a\n"))
        self.assertEqual(stl.source_vertex_count, 6)
        self.assertEqual(sorted(stl.source_vertices), [0, 1, 2, 5])

    def test_coincident_triangles_are_all_kept(self):
        out = self.built("a.obj", TRIANGLE_OBJ + "f 1 2 3\n" * 52)
        file = self.assert_sound(out, 53)
        self.assertEqual(sorted(file.source_face), list(range(53)))

    def test_coordinates_of_all_magnitudes_are_contained(self):
        points, value = [], 1e-45
        while value < 3e38:
            points += [(value, 0, -value), (0, value, 1), (-value, 3, value)]
            value *= 37
        self.assert_sound(self.built("a.obj", soup_obj(points)), len(points) // 3)

    def test_flat_tiny_huge_and_far_meshes_are_sound(self):
        points = np.random.default_rng(1).uniform(-1, 1, (90, 3))
        flat = points * (1, 0, 1) + (0, 0.3, 0)
        for cloud in (flat, points * 1e-44, points * 1e-38, points * 3e38, points + 1e6, points * 1e-3 + (5e5, -7e6, 0),
                      points[:, :1] * (1, 2, -3)):
            for effort in ("fast", "default"):
                self.built("a.obj", soup_obj(cloud), "--effort", effort)
                file = bvh_file.read(self.out)
                self.assert_sound(self.out, len(file.triangles))

    def test_the_stored_triangles_are_those_of_the_input(self):
        text = scattered_obj(500)
        points = np.array([line.split()[1:] for line in text.splitlines() if line[0] == "v"], np.float64)
        file = self.assert_sound(self.built("a.obj", text), 500)
        wanted = points.reshape(-1, 3, 3)[file.source_face]
        self.assertLessEqual(np.abs(file.world - wanted).max(), file.rounding_error)


class Determinism(ToolTest):
    def bytes_of(self, *arguments):
        self.assertEqual(self.build(*arguments, "-o", self.out).returncode, DONE)
        return self.out.read_bytes()

    def test_the_same_input_gives_the_same_bytes_for_any_number_of_threads(self):
        for name, content in (("grid.ply", grid_ply(100)), ("scattered.obj", scattered_obj(5000))):
            mesh = self.write(name, content)
            for imaginary in ("minimal", "free"):
                first = self.bytes_of(mesh, "--imaginary", imaginary, "--threads", "1")
                for threads in ("1", "2", "4"):
                    self.assertEqual(self.bytes_of(mesh, "--imaginary", imaginary, "--threads", threads), first)
                self.assertEqual(self.bytes_of(mesh, "--imaginary", imaginary), first)

    def test_folders_names_of_outputs_and_limits_leave_no_trace(self):
        first = self.bytes_of(self.write("a.obj", CUBE_OBJ))
        folder = self.inputs / "other folder"
        folder.mkdir()
        again = self.build(self.write("other folder/a.obj", CUBE_OBJ), "-o", self.outputs / "b", "--time-limit", "7",
                           "--memory-limit", "1", "--json")
        self.assertEqual(again.returncode, DONE)
        self.assertEqual((self.outputs / "b").read_bytes(), first)


class Provenance(ToolTest):
    def test_it_names_the_input_without_its_folder_and_no_time(self):
        mesh = self.write("cube.obj", CUBE_OBJ)
        self.assertEqual(self.build(mesh, "-o", self.out).returncode, DONE)
        provenance = bvh_file.read(self.out).provenance
        self.assertEqual(set(provenance), {"tool", "version", "input", "options", "findings"})
        self.assertEqual(provenance["input"]["file"], "cube.obj")
        self.assertEqual(provenance["input"]["bytes"], len(CUBE_OBJ))
        self.assertEqual(int(provenance["input"]["xxh64"], 16), bvh_file.xxh64(CUBE_OBJ.encode()))
        self.assertEqual(provenance["options"], {"imaginary": "minimal", "effort": "default"})
        self.assertNotIn(str(self.root).encode(), self.out.read_bytes())
        self.assertNotIn(b"mesh.bvh", self.out.read_bytes())


class SourceFaces(ToolTest):
    def test_interleaved_groups_and_materials_keep_the_order_of_the_file(self):
        lines = ["mtllib none.mtl"]
        for face in range(24):  # face i lies at x = i
            lines += [f"v {face} 0 0", f"v {face} 1 0", f"v {face} 0 1"]
        for face in range(24):
            if face % 3 == 0:
                lines.append(f"g group{face // 3 % 2}")
            if face % 2 == 0:
                lines.append(f"usemtl material{face // 2 % 3}")
            lines.append(f"f {3 * face + 1} {3 * face + 2} {3 * face + 3}")
        file = bvh_file.read(self.built("a.obj", "\n".join(lines) + "\n"))
        self.assertEqual(file.source_faces, 24)
        np.testing.assert_array_equal(file.corners[:, :, 0], np.repeat(file.source_face[:, None], 3, axis=1))
        self.assertEqual(sorted(file.source_face), list(range(24)))
        self.assertEqual([part[0] for part in file.parts], ["group0", "group1"] * 4)
        for triangle, part in enumerate(file.part):
            _, _, first, count = file.parts[part]
            self.assertTrue(first <= file.source_face[triangle] < first + count)

    def test_both_triangles_of_a_quad_name_its_face(self):
        file = bvh_file.read(self.built("cube.obj", CUBE_OBJ))
        points = [tuple(map(float, line.split()[1:])) for line in CUBE_OBJ.splitlines() if line[0] == "v"]
        quads = [[int(word) - 1 for word in line.split()[1:]] for line in CUBE_OBJ.splitlines() if line[0] == "f"]
        self.assertEqual(sorted(file.source_face), sorted(list(range(6)) * 2))
        for face, corners in zip(file.source_face, corner_sets(file)):
            self.assertTrue(corners < {points[v] for v in quads[face]})

    def test_a_concave_polygon_is_covered_once_and_is_one_face(self):
        points = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
        lines = [f"v {x} {y} 0" for x, y in points] + ["f 1 2 3 4 5 6"]
        file = bvh_file.read(self.built("l.obj", "\n".join(lines) + "\n"))
        self.assertEqual(list(file.source_face), [0] * 4)
        a, b, c = (file.world[:, k, :2] for k in range(3))
        areas = np.cross(b - a, c - a) / 2
        self.assertTrue((areas > 0).all(), "the polygon's orientation is kept")
        self.assertEqual(areas.sum(), 5)

    def test_faces_that_are_dropped_keep_their_numbers(self):
        file = bvh_file.read(self.built("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\nf 1 2 3\nf 1 2 9\nf 3 2 1\n"))
        self.assertEqual(file.source_faces, 4)
        self.assertEqual(sorted(file.source_face), [1, 3])


class Coordinates(ToolTest):
    def test_map_coordinates_keep_their_detail(self):
        random = np.random.default_rng(7)
        points = np.round([651234.567, 5403210.123, 412.345] + 80 * random.random((300, 3)), 3)
        file = bvh_file.read(self.built("town.obj", soup_obj(points, "{:.3f}")))
        wanted = np.array([["%.3f" % x for x in point] for point in points], np.float64).reshape(-1, 3, 3)
        error = np.abs(file.world - wanted[file.source_face]).max()
        self.assertTrue(file.origin.any())
        # Half an ulp of float32 at the 40 m that a vertex is away from the middle, with a margin of two.
        self.assertLessEqual(error, 4e-6)
        self.assertLessEqual(error, file.rounding_error)

    def test_float32_coordinates_are_stored_as_they_are_around_a_zero_origin(self):
        points = np.random.default_rng(8).normal(size=(30, 3)).astype(np.float32)
        file = bvh_file.read(self.built("a.obj", soup_obj(points.astype(np.float64).tolist(), "{!r}")))
        self.assertEqual((list(file.origin), file.rounding_error), ([0, 0, 0], 0))
        np.testing.assert_array_equal(file.corners, points.reshape(-1, 3, 3)[file.source_face])


class Scenes(ToolTest):
    def gltf(self, nodes, roots):
        """A glTF scene of one triangle (1,0,0) (0,1,0) (0,0,1), its buffer inside."""
        points = np.eye(3, dtype="<f4").tobytes()
        uri = "data:application/octet-stream;base64," + base64.b64encode(points).decode()
        return json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes,
            "meshes": [{"name": "tip", "primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [{"uri": uri, "byteLength": 36}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                           "max": [1, 1, 1]}]})

    def test_transforms_of_nested_nodes_are_applied(self):
        # Outer: a quarter turn about z, then +10 in x. Inner: twice as large, then +1 in y.
        half = 0.5 ** 0.5
        nodes = [{"name": "outer", "children": [1], "rotation": [0, 0, half, half], "translation": [10, 0, 0]},
                 {"name": "inner", "mesh": 0, "scale": [2, 2, 2], "translation": [0, 1, 0]}]
        file = bvh_file.read(self.built("a.gltf", self.gltf(nodes, [0])))
        np.testing.assert_allclose(sorted(file.world[0].tolist()), sorted([[9, 2, 0], [7, 0, 0], [9, 0, 2]]), atol=1e-5)
        self.assertIn("outer/inner", file.parts[0][1])

    def test_units_axes_and_nodes_of_a_collada_file_are_applied(self):
        file = bvh_file.read(self.built("a.dae", COLLADA_TRIANGLE))
        y_up = [[1, 0, 0], [1.1, 0, 0], [1, 0, -0.1]]  # assimp turns z up into y up
        np.testing.assert_allclose(sorted(file.world[0].tolist()), sorted(y_up), atol=1e-6)
        self.assertIn("n", file.parts[0][1])  # assimp names the node by its id

    def test_an_instanced_mesh_is_one_part_for_each_node(self):
        nodes = [{"name": "left", "mesh": 0, "translation": [-5, 0, 0]},
                 {"name": "right", "mesh": 0, "translation": [5, 0, 0]}]
        file = bvh_file.read(self.built("a.gltf", self.gltf(nodes, [0, 1])))
        self.assertEqual(sorted(file.corners[:, :, 0].min(1)), [-5, 5])
        self.assertEqual([(first, count) for _, _, first, count in file.parts], [(0, 1), (1, 1)])
        for triangle, part in enumerate(file.part):
            side = "left" if file.corners[triangle, :, 0].min() < 0 else "right"
            self.assertIn(side, file.parts[part][1])


if __name__ == "__main__":
    unittest.main()
