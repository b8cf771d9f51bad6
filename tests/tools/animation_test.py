"""Tests of trees for animations and poses, with a glTF file that is made here and posed once more with NumPy."""
import json
import struct
import unittest

import bvh_file
import numpy as np

from tool_test import CUBE_OBJ, DONE, TRIANGLE_OBJ, UNREADABLE_INPUT, USAGE, ToolTest, obj, sheet

FLOAT, UINT8, UINT16 = (5126, "<f4"), (5121, "u1"), (5123, "<u2")


class Gltf:
    """A glTF file in the making."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "scenes": [{"nodes": []}], "nodes": [], "meshes": []}
        self.bytes = bytearray()

    def accessor(self, values, kind, number):
        values = np.asarray(values, number[1])
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": values.nbytes})
        self.bytes += values.tobytes() + bytes(-values.nbytes % 4)
        self.json["accessors"].append({"bufferView": len(self.json["bufferViews"]) - 1, "componentType": number[0], "count": len(values), "type": kind})
        return len(self.json["accessors"]) - 1

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(self.bytes), 0x004E4942) + self.bytes
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def matrix(node):
    """The 4 x 4 matrix of a node's translation, rotation and scale."""
    x, y, z, w = np.asarray(node["rotation"]) / np.linalg.norm(node["rotation"])
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    result = np.eye(4)
    result[:3, :3] = turn * node["scale"]
    result[:3, 3] = node["translation"]
    return result


class Worm:
    """A tube of rings on a chain of joints, with two morph targets; all numbers are random. `rest` has its vertices at rest."""

    def __init__(self, seed=1, joints=6, rings=40, around=12):
        random = np.random.default_rng(seed)
        angle = np.arange(around) * 2 * np.pi / around
        height = np.linspace(0, joints, rings)
        points = np.stack(np.broadcast_arrays(np.cos(angle)[None], height[:, None], np.sin(angle)[None]), 2).reshape(-1, 3).astype("<f4")
        targets = [random.normal(0, 0.05, points.shape).astype("<f4") for _ in range(2)]
        faces = [[r * around + a, (r + 1) * around + a, r * around + (a + 1) % around] for r in range(rings - 1) for a in range(around)]
        faces += [[(r + 1) * around + a, (r + 1) * around + (a + 1) % around, r * around + (a + 1) % around] for r in range(rings - 1) for a in range(around)]
        of = np.stack([random.permutation(joints)[:4] for _ in points])
        weight = random.random(of.shape) ** 3 + np.exp(-4 * (of + 0.5 - points[:, 1:2]) ** 2)
        weight = (weight / weight.sum(1, keepdims=True)).astype("<f4")
        chain = [{"translation": [0, 1, 0] if j else [1, 2, 3], "rotation": (random.normal(0, 0.1, 4) + [0, 0, 0, 1]).tolist(),
                  "scale": (1 + random.normal(0, 0.05, 3)).tolist()} for j in range(joints)]
        bind = [np.linalg.inv(np.array([[1, 0, 0, 0], [0, 1, 0, j], [0, 0, 1, 0], [0, 0, 0, 1]], float)) for j in range(joints)]
        morph = [0.5, -0.25]
        self.faces, self.vertices = faces, len(points)
        self.rest = self.posed(points + sum(w * t.astype(float) for w, t in zip(morph, targets)), chain, bind, of, weight.astype(float))
        self.file = self.make(points, targets, morph, chain, bind, of, weight, random)

    @staticmethod
    def posed(points, chain, bind, of, weight):
        world, skin = np.eye(4), []
        for node, inverse in zip(chain, bind):
            world = world @ matrix(node)
            skin.append(world @ inverse)
        blended = np.einsum("vi,vijk->vjk", weight / weight.sum(1, keepdims=True), np.array(skin)[of])
        return np.einsum("vjk,vk->vj", blended, np.column_stack([points, np.ones(len(points))]))[:, :3]

    def make(self, points, targets, morph, chain, bind, of, weight, random):
        gltf, joints = Gltf(), len(chain)
        attributes = {"POSITION": gltf.accessor(points, "VEC3", FLOAT), "JOINTS_0": gltf.accessor(of, "VEC4", UINT8), "WEIGHTS_0": gltf.accessor(weight, "VEC4", FLOAT)}
        gltf.json["meshes"] = [{"weights": morph, "primitives": [{
            "attributes": attributes, "targets": [{"POSITION": gltf.accessor(t, "VEC3", FLOAT)} for t in targets],
            "indices": gltf.accessor(np.ravel(self.faces), "SCALAR", UINT16)}]}]
        gltf.json["nodes"] = [{"mesh": 0, "skin": 0, "translation": [9, 9, 9]}] + [dict(node, children=[j + 2]) for j, node in enumerate(chain)]
        del gltf.json["nodes"][-1]["children"]
        gltf.json["scenes"][0]["nodes"] = [0, 1]
        inverse = gltf.accessor(np.array([m.T.ravel() for m in bind]), "MAT4", FLOAT)
        gltf.json["skins"] = [{"joints": list(range(1, joints + 1)), "inverseBindMatrices": inverse}]
        times = gltf.accessor([0, 0.5, 1, 2], "SCALAR", FLOAT)
        channels, samplers = [], []
        for j in range(joints):
            turns = random.normal(0, 0.5, (4, 4)) + [0, 0, 0, 1]
            samplers.append({"input": times, "output": gltf.accessor(turns / np.linalg.norm(turns, axis=1, keepdims=True), "VEC4", FLOAT)})
            channels.append({"sampler": j, "target": {"node": j + 1, "path": "rotation"}})
        gltf.json["animations"] = [{"name": "writhe", "channels": channels, "samplers": samplers}]
        return gltf.glb()


class Animated(ToolTest):
    def test_the_rest_pose_is_skinned_and_morphed_as_numpy_does_it(self):
        for seed in range(3):
            worm = Worm(seed)
            file = bvh_file.read(self.built("worm.glb", worm.file, "--animation", "--samples", "3"))
            self.assertEqual(bvh_file.defects_of_topology(file), [])
            self.assertEqual(file.source_vertex_count, worm.vertices)
            self.assertEqual(sorted(file.source_vertices), list(range(worm.vertices)))
            moved = worm.rest[file.source_vertices[file.topology["vertex"]]]
            self.assertLess(abs(file.world - moved).max(), 1e-5)
            self.assertEqual(len(file.triangles), len(worm.faces))

    def test_provenance_and_reports_tell_of_the_samples(self):
        report = self.built_json("worm.glb", Worm().file, "--animation", "--samples", "6")
        provenance = bvh_file.read(self.out).provenance
        self.assertEqual(provenance["options"]["animation"], True)
        self.assertEqual(set(provenance["samples"]), {"count", "mean_ratio", "worst_ratio", "worst"})
        self.assertEqual(provenance["samples"]["count"], 6)
        self.assertGreaterEqual(provenance["samples"]["worst_ratio"], provenance["samples"]["mean_ratio"])
        self.assertRegex(provenance["samples"]["worst"], r"^rest$|^writhe at [0-9.]+ s$")
        self.assertEqual(report["samples"], provenance["samples"])
        self.assertEqual(self.info_json(self.out)["source"]["samples"], provenance["samples"])
        page = self.info(self.out).stdout.decode()
        self.assertIn("made for 6 samples", page)
        self.assertIn(provenance["samples"]["worst"], page)

    def test_the_tree_is_near_to_those_of_its_samples(self):
        worm = self.write("worm.glb", Worm(rings=120, around=24).file)
        self.assertEqual(self.build(worm, "--animation", "-o", self.out).returncode, DONE)
        self.assertLess(bvh_file.read(self.out).provenance["samples"]["mean_ratio"], 1.3)

    def test_the_same_file_gives_the_same_bytes_whatever_the_number_of_threads(self):
        worm = self.write("worm.glb", Worm().file)
        written = []
        for threads in ("1", "3"):
            self.assertEqual(self.build(worm, "--animation", "--threads", threads, "-o", self.out).returncode, DONE)
            written.append(self.out.read_bytes())
        self.assertEqual(*written)

    def test_files_without_an_animation_are_refused(self):
        for name, content, words in (("a.obj", TRIANGLE_OBJ, "is no glTF file, and Tandem reads animations of no other"),
                                     ("a.glb", self.still(), "it has no animation")):
            result = self.build(self.write(name, content), "--animation", "-o", self.out)
            self.assert_fails(result, UNREADABLE_INPUT, words)
        self.assert_nothing_written()

    def still(self):
        gltf = Gltf()
        gltf.json["meshes"] = [{"primitives": [{"attributes": {"POSITION": gltf.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "VEC3", FLOAT)}}]}]
        gltf.json["nodes"] = [{"mesh": 0}]
        gltf.json["scenes"][0]["nodes"] = [0]
        return gltf.glb()

    def test_options_that_contradict_each_other_are_refused(self):
        worm = self.write("worm.glb", Worm().file)
        for options in (["--samples", "4"], ["--animation", "--levels", "auto"], ["--animation", "--poses", str(worm)],
                        ["--animation", "--samples", "1"], ["--animation", "--samples", "65"], ["--poses", str(worm), "--levels", "1%"]):
            with self.subTest(options):
                self.assertEqual(self.build(worm, "-o", self.out, *options).returncode, USAGE)


class Poses(ToolTest):
    def rolled(self, turns, n=30):
        points, faces = [], []
        for i in range(n + 1):
            for j in range(n + 1):
                angle, x = turns * 2 * np.pi * j / n, 4 * j / n
                rolled = (x, 0) if turns == 0 else (np.sin(angle) * 2 / np.pi / turns * 1.5, (1 - np.cos(angle)) * 2 / np.pi / turns * 1.5)
                points.append((rolled[0], i / n, rolled[1] + (0.01 * j / n if turns else 0)))
        for i in range(n):
            for j in range(n):
                a = i * (n + 1) + j
                faces += [(a, a + 1, a + n + 1), (a + 1, a + n + 2, a + n + 1)]
        return obj(points, faces)

    def test_a_tree_over_poses_is_told_of_with_their_digests(self):
        rest = self.write("rest.obj", self.rolled(0))
        poses = [self.write(f"pose{i}.obj", self.rolled(turns)) for i, turns in enumerate((0.5, 1, 2))]
        self.assertEqual(self.build(rest, "--poses", *poses, "-o", self.out).returncode, DONE)
        file = bvh_file.read(self.out)
        self.assertEqual([pose["file"] for pose in file.provenance["input"]["poses"]], ["pose0.obj", "pose1.obj", "pose2.obj"])
        self.assertEqual([int(pose["xxh64"], 16) for pose in file.provenance["input"]["poses"]], [bvh_file.xxh64(pose.read_bytes()) for pose in poses])
        self.assertEqual(file.provenance["samples"]["count"], 4)
        self.assertEqual(bvh_file.defects_of_topology(file) + bvh_file.defects_of_tree(file), [])
        plain = bvh_file.read(self.built("rest.obj", self.rolled(0)))
        self.assertEqual(sorted(map(tuple, file.world.reshape(-1, 9).tolist())), sorted(map(tuple, plain.world.reshape(-1, 9).tolist())))

    def test_a_quad_that_is_closed_at_rest_and_opens_keeps_its_corners(self):
        rest = self.write("rest.obj", "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n")
        pose = self.write("pose.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
        self.assertEqual(self.build(rest, "--poses", pose, "-o", self.out).returncode, DONE)
        file = bvh_file.read(self.out)
        self.assertEqual(sorted(file.source_vertices), [0, 1, 2, 3])
        self.assertEqual(len(file.triangles), 2)

    def test_poses_of_another_mesh_are_refused_by_name(self):
        rest = self.write("rest.obj", CUBE_OBJ)
        lines = CUBE_OBJ.splitlines(keepends=True)
        cases = (("more.obj", CUBE_OBJ + "v 5 5 5\n", "more.obj: has 9 vertices, and rest.obj has 8"),
                 ("faces.obj", "".join(lines[:-1]), "faces.obj: has 5 faces, and rest.obj has 6"),
                 ("other.obj", "".join(lines[:-1]) + "f 1 2 3\n", "other.obj: face 5 has other vertices than in rest.obj"),
                 ("nan.obj", CUBE_OBJ.replace("v 1 1 1", "v 1 nan 1"), "nan.obj: vertex 6 has a coordinate that is NaN or infinite"),
                 ("far.obj", CUBE_OBJ.replace("v 1 1 1", "v 1 1e39 1"), "far.obj: vertex 6 has a coordinate too large for float32"))
        for name, content, words in cases:
            with self.subTest(name):
                self.assert_fails(self.build(rest, "--poses", self.write(name, content), "-o", self.out), UNREADABLE_INPUT, words)
        self.assert_fails(self.build(rest, "--poses", self.inputs / "none.obj", "-o", self.out), UNREADABLE_INPUT, "none.obj: no such file")
        self.assert_nothing_written()

    def test_a_pose_is_not_overwritten(self):
        rest, pose = self.write("rest.obj", CUBE_OBJ), self.write("pose.obj", CUBE_OBJ)
        before = pose.read_bytes()
        self.assertEqual(self.build(rest, "--poses", pose, "-o", pose).returncode, USAGE)
        self.assertEqual(pose.read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
