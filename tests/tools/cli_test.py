#!/usr/bin/python3
"""bvhbuild and bvhinfo from the outside: exit codes, messages, streams, odd paths, outputs that cannot be written.

Environment: TANDEM_BVHBUILD, TANDEM_BVHINFO (the binaries), TANDEM_SOURCE_DIR.
"""
import base64
import json
import os
import pty
import resource
import signal
import subprocess
import time
import unittest

import numpy as np

from tool_test import (BVHBUILD, BVHINFO, COLLADA_TRIANGLE, CUBE_OBJ, DONE, NO_TRIANGLE, TRIANGLE_OBJ, UNREADABLE_INPUT, UNWRITABLE_OUTPUT, USAGE, ToolTest,
                       grid_ply, limited_files, scattered_obj)

# assimp reads this for ever.
ENDLESS_PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x"
NOBODY = 65534


class Usage(ToolTest):
    def test_help_names_every_option_and_exit_code(self):
        for tool, words in ((BVHBUILD, ("MESH", "--output", "--imaginary", "minimal|free|SHARE", "--effort", "fast|default|best", "--strict", "--json",
                                        "--quiet", "--threads", "--reader", "--time-limit", "--memory-limit", "--expansion-limit",
                                        "--no-topology", "--no-refit", "--allow-outside-files", "--version", "Exit codes: 0 done")),
                            (BVHINFO, ("FILE", "--json", "--verify", "--version", "Exit codes: 0 all sound"))):
            help_text = self.succeeds(tool, "--help")
            for word in words:
                self.assertIn(word, help_text)

    def test_version_is_one_line_with_a_number(self):
        for tool, name in ((BVHBUILD, "bvhbuild"), (BVHINFO, "bvhinfo")):
            self.assertRegex(self.succeeds(tool, "--version"), rf"^{name} \d+\.\d+\.\d+\n$")

    def test_wrong_arguments_are_named_and_a_misspelt_option_before_what_is_missing(self):
        mesh = self.write("a.obj", TRIANGLE_OBJ)
        for tool, arguments, word in ((BVHBUILD, (), "MESH is required"), (BVHINFO, (), "FILE is required"), (BVHBUILD, (mesh,), "--output"),
                                      (BVHBUILD, (mesh, "-o", self.out, "--fast"), "--fast"), (BVHINFO, ("--fast", mesh), "--fast"),
                                      (BVHBUILD, (mesh, "second.obj", "-o", self.out), "second.obj"),
                                      (BVHBUILD, (mesh, "--outptu", self.out), "there is no option --outptu\n"),
                                      (BVHBUILD, (mesh, "-o", self.out, "--efort", "best", "--jsno"), "there is no option --efort\n"),
                                      (BVHBUILD, (mesh, "-o", self.out, "one", "two"), "not expected: one two\n"),
                                      (BVHBUILD, ("", "-o", self.out), "MESH"), (BVHBUILD, (mesh, "-o", ""), "--output")):
            with self.subTest(arguments=arguments):
                self.assert_fails(self.run_tool(tool, *arguments), USAGE, word)
        self.assert_nothing_written()

    def test_standard_input_and_output_are_refused_by_name(self):
        mesh = self.write("a.obj", TRIANGLE_OBJ)
        self.assert_fails(self.build(mesh, "-o", "-", cwd=self.outputs), USAGE, "--output", "not standard input or output")
        self.assert_fails(self.build("-", "-o", self.out), USAGE, "MESH", "not standard input or output")
        self.assert_nothing_written()
        self.assertEqual(self.build(mesh, "-o", "./-", cwd=self.outputs).returncode, DONE)

    def test_bad_values_are_refused_by_option(self):
        mesh = self.write("a.obj", TRIANGLE_OBJ)
        for option, values in {"--imaginary": ["some", "1.5", "-0.1", "nan", ""], "--effort": ["slow", "0", ""],
                               "--reader": ["cgal", "0"],
                               "--threads": ["0", "-1", "two", "1e9"], "--time-limit": ["0", "-5", "nan", "soon"],
                               "--memory-limit": ["0", "nan", "inf", "8GiB"], "--expansion-limit": ["-1", "nan", "many"]}.items():
            for value in values:
                with self.subTest(option=option, value=value):
                    self.assert_fails(self.build(mesh, "-o", self.out, f"{option}={value}"), USAGE, option)
        self.assert_nothing_written()

class UnreadableInput(ToolTest):
    def assert_refused(self, path, *words, code=UNREADABLE_INPUT, **options):
        self.assert_fails(self.build(path, "-o", self.out, **options), code, path, *words)
        self.assert_nothing_written()

    def test_what_is_no_mesh_is_named(self):
        os.mkfifo(self.inputs / "pipe.obj")
        empty = [(self.write(f"empty.{ending}", b""), "empty") for ending in ("obj", "ply", "stl", "off", "gltf", "glb", "dae")]
        for path, word in ((self.inputs / "none.obj", "no such file"), (self.inputs, "is a folder"), (self.inputs / "pipe.obj", "not a regular file"),
                           *empty, (self.write("notes.xyz", "hello\n"), ""), (self.write("noending", "hello\n"), "")):
            with self.subTest(path.name):
                self.assert_refused(path, word)

    def test_a_file_without_permission_is_named(self):
        path = self.write("secret.obj", TRIANGLE_OBJ)
        path.chmod(0)
        self.outputs.chmod(0o777)
        self.assert_refused(path, "permission denied", **unprivileged(self))

    def test_garbage_with_the_ending_of_a_mesh_is_refused(self):
        garbage = bytes((i * 197 + i * i * 31) % 256 for i in range(3000))
        for ending in ("ply", "stl", "off", "gltf", "glb", "dae", "fbx", "3ds", "blend"):
            with self.subTest(ending=ending):
                self.assert_refused(self.write(f"garbage.{ending}", garbage))
        result = self.build(self.write("garbage.obj", garbage), "-o", self.out)
        self.assertIn(result.returncode, (UNREADABLE_INPUT, NO_TRIANGLE))
        self.assert_nothing_written()

    def test_motion_capture_is_refused_by_name(self):
        path = self.write("walk.bvh", "HIERARCHY\nROOT Hips\n{\n}\n")
        self.assert_refused(path, "Biovision motion capture")
        self.assert_fails(self.info(path), UNREADABLE_INPUT, path, "Biovision motion capture")

    def test_a_tree_of_ours_is_no_mesh(self):
        tree = self.built("a.obj", TRIANGLE_OBJ).rename(self.inputs / "a.bvh")
        self.assert_refused(tree, "already a Tandem tree")
        self.assert_refused(tree.rename(self.inputs / "a.obj"), "already a Tandem tree")

    def test_a_mesh_without_a_usable_triangle_says_all_causes(self):
        vertices = "v 0 0 0\nv 1 1 1\nv 2 2 2\nv 0 1 0\n"
        points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        strip = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n4 0 0 0 0\n"
        for name, content, causes in (
                ("l.obj", vertices + "l 1 2 3\n", "it has lines but no faces"),
                ("lp.obj", vertices + "l 1 2 3\np 1\n", "it has points and lines but no faces"),
                ("v.obj", vertices, "it has points but no faces"),
                ("surf.obj", vertices + "surf 0 1 0 1 1 2\n", "it has points but no faces; free-form surfaces are not read"),
                ("p.ply", points + "end_header\n0 0 0\n", "it has points but no faces"),
                ("e.ply", points + "element edge 1\nproperty int a\nend_header\n0 0 0\n0\n", "it has lines but no faces"),
                ("s.ply", points + strip, "the triangles of its strips all name a vertex twice"),
                ("p.off", "OFF\n2 0 0\n0 0 0\n1 1 1\n", "it has points but no faces"),
                ("e.off", "OFF\n0 0 0\n", "it has no faces and no vertices"),
                ("e.stl", "solid a\nendsolid a\n", "it has no faces and no vertices"),
                ("e.gltf", '{"asset": {"version": "2.0"}}', "it has no faces and no vertices"),
                ("flat.obj", vertices + "f 1 2 3\n", "1 triangle has all corners on one line"),
                ("nan.obj", vertices + "v nan 0 0\nf 1 2 5\n", "1 face has a coordinate that is NaN or infinite"),
                ("all.obj", vertices + "f 1 2 3\nf 1 2\nf 1 2 9\n",
                 "1 face names a vertex that the file does not have; 1 face has fewer than three corners; "
                 "1 triangle has all corners on one line; line 7: face index 9 of 4 vertices")):
            for option in ([], ["--strict"]):
                with self.subTest(name=name, option=option):
                    path = self.write(name, content)
                    result = self.build(path, "-o", self.out, *option)
                    self.assertEqual(result.stderr.decode(), f"bvhbuild: {path}: holds no usable triangle: {causes}\n")
                    self.assertEqual(result.returncode, NO_TRIANGLE)
        self.assert_nothing_written()

    def test_the_time_limit_ends_an_endless_import(self):
        path = self.write("endless.ply", ENDLESS_PLY)
        result = self.build(path, "-o", self.out, "--reader", "assimp", "--time-limit", "0.3")
        self.assert_fails(result, UNREADABLE_INPUT, path, "0.3 s (--time-limit)")
        self.assert_nothing_written()

    def test_named_files_are_regular_and_beside_the_mesh(self):
        os.mkfifo(self.inputs / "pipe.mtl")
        (self.root / "outside.mtl").write_text("newmtl red\n")
        (self.inputs / "link.mtl").symlink_to(self.root / "outside.mtl")
        for name in ("pipe.mtl", "../outside.mtl", "link.mtl"):
            with self.subTest(name=name):
                path = self.write("a.obj", f"mtllib {name}\nusemtl red\n" + TRIANGLE_OBJ)
                result = self.build(path, "-o", self.out, "--reader", "assimp", timeout=20)
                self.assertEqual((result.returncode, result.stderr), (DONE, b""))
                self.assertEqual(b"--allow-outside-files" in result.stdout, name != "pipe.mtl")
                self.assertNotIn(b"--allow-outside-files", self.build(path, "-o", self.out, "--reader", "assimp", "--allow-outside-files").stdout)

    def test_buffers_elsewhere_are_refused_without_a_word_of_them(self):
        secret = self.root / "secret.bin"
        secret.write_bytes(b"SECRET, SECRET, SECRET, " * 20)
        (self.inputs / "link.bin").symlink_to(secret)
        for uri in ("../secret.bin", "%2e%2e/secret.bin", str(secret), "/etc/passwd", "link.bin", "../none"):
            for reader in ("auto", "tandem", "assimp"):
                with self.subTest(uri=uri, reader=reader):
                    path = self.write("a.gltf", json.dumps({
                        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                                      {"bufferView": 0, "componentType": 5125, "count": 3, "type": "SCALAR"}],
                        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": uri}]}))
                    result = self.build(path, "-o", self.out, "--reader", reader)
                    self.assert_fails(result, UNREADABLE_INPUT, path, *(["--allow-outside-files"] if reader != "assimp" else []))
                    for word in (b"SECRET", b"1380", b"root:"):
                        self.assertNotIn(word, result.stderr)
        self.assert_nothing_written()

    def assert_cheaply_refused(self, name, content, *arguments):
        """Exit code 2 with a reason, below 1 GiB and 10 s of processor time."""
        def limit():
            resource.setrlimit(resource.RLIMIT_CPU, (10, 10))
        path = self.write(name, content)
        with open(self.root / "stderr", "w+b") as stderr:
            process = subprocess.Popen([BVHBUILD, path, "-o", self.out, *arguments], stderr=stderr, preexec_fn=limit)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            stderr.seek(0)
            message = stderr.read().decode()
        self.assertEqual(process.returncode, UNREADABLE_INPUT, message)
        self.assertTrue(message.startswith(f"bvhbuild: {path}: "), message)
        self.assertLess(usage.ru_maxrss << 10, 1 << 30)
        return message

    def test_instances_and_counts_without_data_are_refused_before_they_take_memory(self):
        scene = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
                 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                 "accessors": [{"componentType": 5126, "count": 10 ** 8, "type": "VEC3"},
                               {"componentType": 5125, "count": 3 * 10 ** 8, "type": "SCALAR"}]}
        self.assertIn("--expansion-limit", self.assert_cheaply_refused("promises.gltf", json.dumps(scene)))
        data = bytes(np.arange(3 * 20000, dtype="<u2"))  # positions and indices alike
        scene["nodes"] *= 20000
        scene["accessors"] = [{"bufferView": 0, "componentType": 5122, "count": 20000, "type": "VEC3"},
                              {"bufferView": 0, "componentType": 5123, "count": 60000, "type": "SCALAR"}]
        scene["bufferViews"] = [{"buffer": 0, "byteLength": len(data)}]
        scene["buffers"] = [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}]
        self.assertIn("--expansion-limit", self.assert_cheaply_refused("instances.gltf", json.dumps(scene)))
        nodes = "".join(f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
                        for i in range(30))
        nested = COLLADA_TRIANGLE.replace("<library_visual_scenes>",
                                          f'<library_nodes>{nodes}<node id="n30"/></library_nodes><library_visual_scenes>')
        nested = nested.replace("<translate>", '<instance_node url="#n0"/><translate>')
        self.assertIn("--expansion-limit", self.assert_cheaply_refused("nested.dae", nested))

    def test_a_higher_expansion_limit_allows_instances(self):
        scene = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}] * 500,
                 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}],
                 "accessors": [{"bufferView": 0, "componentType": 5121, "count": 100, "type": "VEC3"}],
                 "bufferViews": [{"buffer": 0, "byteLength": 300}],
                 "buffers": [{"byteLength": 300, "uri": "data:;base64," + base64.b64encode(bytes(range(250)) + bytes(50)).decode()}]}
        path = self.write("a.gltf", json.dumps(scene))
        self.assert_fails(self.build(path, "-o", self.out, "--expansion-limit", "0"), UNREADABLE_INPUT, "--expansion-limit")
        self.assertEqual(self.build(path, "-o", self.out, "--expansion-limit", "1e5").returncode, DONE)

    def test_counts_beyond_the_file_are_refused_before_they_take_memory(self):
        vertex = "property float x\nproperty float y\nproperty float z\n"
        face = "property list uchar int vertex_indices\n"
        huge = 4 * 10 ** 9
        for form in ("ascii", "binary_little_endian", "binary_big_endian"):
            head = f"ply\nformat {form} 1.0\n"
            lists = f"{huge} 0 0\n" if form == "ascii" else b"\0" * 12 + b"\x7f" * 4 + b"\0" * 8
            for name, text in (("vertices", f"element vertex {huge}\n{vertex}end_header\n"),
                               ("faces", f"element vertex 1\n{vertex}element face {huge}\n{face}end_header\n"),
                               ("strip", f"element vertex 1\n{vertex}element tristrips 1\n"
                                "property list int int vertex_indices\nend_header\n"),
                               ("other", f"element vertex 1\n{vertex}element odd {huge}\nproperty list uint double q\nend_header\n")):
                data = lists if isinstance(lists, bytes) else f"0 0 0\n{lists}".encode()
                self.assert_cheaply_refused(f"{name}_{form}.ply", (head + text).encode() + data)
        for name, content in (("vertices.off", f"OFF\n{huge} 1 0\n0 0 0\n"), ("faces.off", f"OFF\n1 {huge} 0\n0 0 0\n3 0 0 0\n"),
                              ("corners.off", f"OFF\n1 1 0\n0 0 0\n{huge} 0 0\n"),
                              ("binary.off", b"OFF BINARY\n" + b"\x7f\xff\xff\xff" * 2 + bytes(4)),
                              ("facets.stl", bytes(80) + b"\xff" * 4 + bytes(50))):
            self.assert_cheaply_refused(name, content)
        for name in ("vertices_ascii.ply", "faces_binary_little_endian.ply", "faces.off"):
            self.assert_cheaply_refused(name, (self.inputs / name).read_bytes(), "--reader", "assimp")

    def test_a_file_beyond_the_memory_limit_is_refused(self):
        path = self.write("sparse.obj", b"")
        os.truncate(path, 1 << 28)
        result = self.build(path, "-o", self.out, "--memory-limit", "0.2")
        self.assert_fails(result, UNREADABLE_INPUT, path, "--memory-limit")


class UnwritableOutput(ToolTest):
    def setUp(self):
        super().setUp()
        self.mesh = self.write("mesh.obj", scattered_obj(2000))

    def assert_refused(self, out, *words, code=UNWRITABLE_OUTPUT, **options):
        self.assert_fails(self.build(self.mesh, "-o", out, **options), code, out, *words)
        self.assert_nothing_written()

    def test_what_is_no_output_is_named(self):
        for out, word, options in ((self.outputs / "none" / "a.bvh", "there is no folder", {}), (self.outputs, "is a folder", {}),
                                   ("/dev/full", "No space left on device", {}), (self.out, "File too large", limited_files(16384))):
            with self.subTest(word):
                self.assert_refused(out, word, **options)
        self.assert_full_disk_is_told(BVHBUILD, self.mesh)

    def test_a_file_is_no_folder(self):
        self.assert_fails(self.build(self.mesh, "-o", self.mesh / "a.bvh"), UNWRITABLE_OUTPUT, self.mesh / "a.bvh")

    def test_the_input_is_never_overwritten(self):
        before = self.mesh.read_bytes()
        os.symlink(self.mesh, self.inputs / "link.bvh")
        os.link(self.mesh, self.inputs / "hard.bvh")
        for out in (self.mesh, self.inputs / "link.bvh", self.inputs / "hard.bvh", self.inputs / ".." / "in" / "mesh.obj"):
            self.assert_refused(out, "is the input", code=USAGE)
        self.assertEqual(self.mesh.read_bytes(), before)

    def test_no_file_that_was_read_is_overwritten(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
        buffer = self.write("C2.bin", points)
        gltf = self.write("c2.gltf", json.dumps({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "C2.bin"}]}))
        materials = self.write("a.mtl", "newmtl red\nKd 1 0 0\n")
        obj = self.write("a.obj", "mtllib a.mtl\nusemtl red\n" + TRIANGLE_OBJ)
        for mesh, other, reader in ((gltf, buffer, "auto"), (gltf, buffer, "assimp"), (obj, materials, "assimp")):
            with self.subTest(mesh=mesh.name, reader=reader):
                before = other.read_bytes()
                self.assert_fails(self.build(mesh, "-o", other, "--reader", reader), USAGE, other, "is read too; it would be overwritten")
                self.assertEqual(other.read_bytes(), before)
                self.succeeds(BVHBUILD, mesh, "-o", self.out, "--reader", reader)

    def test_a_folder_without_permission_is_told(self):
        options = unprivileged(self)
        self.outputs.chmod(0o555)
        self.assert_refused(self.out, "ermission denied", **options)

    def test_a_failed_build_leaves_an_older_file_as_it_was(self):
        self.out.write_bytes(b"older")
        self.assertEqual(self.build(self.write("bad.ply", "ply\n"), "-o", self.out).returncode, UNREADABLE_INPUT)
        self.assertEqual(self.out.read_bytes(), b"older")
        self.assertEqual(os.listdir(self.outputs), [self.out.name])

    def test_a_successful_build_replaces_an_older_file_and_leaves_nothing_else(self):
        self.out.write_bytes(b"older")
        self.assertEqual(self.build(self.mesh, "-o", self.out).returncode, DONE)
        self.assertGreater(self.out.stat().st_size, 5)
        self.assertEqual(os.listdir(self.outputs), [self.out.name])


class Paths(ToolTest):
    NAMES = ["with space", "ümlaut-é-日本", "qu'ot\"es", "new\nline", "tab\there", "$HOME;`ls`", "[a,b]", "%s%n", "-dash",
             "--json", os.fsdecode(b"not-utf8-\xff")]

    def test_odd_names_are_read_and_written(self):
        for name in self.NAMES:
            with self.subTest(name=name):
                mesh, out = self.write(name + ".obj", TRIANGLE_OBJ), self.outputs / (name + ".bvh")
                self.assertEqual(self.build(mesh, "-o", out).returncode, DONE)
                self.assertEqual(self.info(out).returncode, DONE)
                report = self.build(mesh, "-o", out, "--json")
                self.assertEqual(json.loads(report.stdout)["exit_code"], DONE)
                self.assertIn("triangles", self.info_json(out))
        self.assertEqual(sorted(os.listdir(self.outputs)), sorted(name + ".bvh" for name in self.NAMES))

    def test_messages_hold_no_control_characters_of_names(self):
        mesh, out = self.write("red\x1b[31m\n.obj", TRIANGLE_OBJ), self.outputs / os.fsdecode(b"\x1b[2J\xff\xc2.bvh")
        shown = "\ufffd[2J\ufffd\ufffd.bvh"
        report = self.build(mesh, "-o", out)
        self.assertIn("red\ufffd[31m\ufffd.obj", report.stdout.decode())
        self.assertIn(shown, report.stdout.decode())
        texts = [report.stdout, self.info(out).stdout, self.info("--verify", out).stdout, self.info(out, out).stdout]
        for text in texts:
            self.assertIn(shown, text.decode())
        failures = [self.build(self.inputs / "no\x1bne\n.obj", "-o", self.out), self.build(mesh, "-o", self.outputs / "a\x1b" / "b"),
                    self.build(mesh, "-o", self.out, "--od\x1bd"), self.info(self.inputs / "no\x1bne.bvh")]
        for failure in failures:
            self.assertIn("\ufffd", failure.stderr.decode())
            texts.append(failure.stderr)
        for text in texts:
            self.assertNotIn(b"\x1b", text)

    def test_a_leading_dash_may_follow_a_double_dash(self):
        self.write("-o.obj", TRIANGLE_OBJ)
        result = self.build("--output=-out.bvh", "--", "-o.obj", cwd=self.inputs)
        self.assertEqual(result.returncode, DONE, result.stderr)
        result = self.info("--json", "--", "-out.bvh", cwd=self.inputs)
        self.assertEqual(json.loads(result.stdout)["triangles"], 1)

    def test_a_relative_name_without_folder_is_written_to_the_working_folder(self):
        mesh = self.write("a.obj", TRIANGLE_OBJ)
        self.assertEqual(self.build(mesh, "-o", "a.bvh", cwd=self.outputs).returncode, DONE)
        self.assertEqual(os.listdir(self.outputs), ["a.bvh"])

    def test_the_longest_name_of_a_file_system_is_written(self):
        name = "n" * 251 + ".bvh"
        self.assertEqual(self.build(self.write("a.obj", TRIANGLE_OBJ), "-o", self.outputs / name).returncode, DONE)
        self.assertEqual(os.listdir(self.outputs), [name])


class Signals(ToolTest):
    def start(self, *arguments, **options):
        return subprocess.Popen([BVHBUILD, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options)

    def test_a_signal_during_import_ends_all_processes_and_leaves_nothing(self):
        path = self.write("endless.ply", ENDLESS_PLY)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(signal=number):
                # The reading end sees the end of the pipe once every process that inherited it is gone.
                reading, writing = os.pipe()
                process = self.start(path, "-o", self.out, "--reader", "assimp", "--time-limit", "50",
                                     pass_fds=[writing])
                os.close(writing)
                while not children_of(process.pid):
                    time.sleep(0.001)
                process.send_signal(number)
                self.assertEqual(process.wait(20), -number)
                self.assertEqual(os.read(reading, 1), b"")
                os.close(reading)
                self.assert_nothing_written()

    def test_a_file_that_is_cut_short_while_it_is_read_is_told(self):
        self.assertEqual(self.build(self.write("large.ply", grid_ply(300)), "-o", self.out, "--effort", "fast", "--quiet").returncode, DONE)
        whole, gone, told = self.out.read_bytes(), "a file was cut short, or its disk failed, while it was read\n", set()
        for delay in (k % 60 for k in range(600)):  # where the file is cut before it is mapped it is only too short
            self.out.write_bytes(whole)
            process = subprocess.Popen([BVHINFO, "--verify", self.out], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            time.sleep(0.001 * delay)
            os.truncate(self.out, 4096)
            message = process.communicate(timeout=20)[1].decode()
            self.assertIn(process.returncode, (DONE, UNREADABLE_INPUT), message)
            told.add(message.partition(": ")[2])
            if gone in told:
                break
        self.assertIn(gone, told)

    def test_a_signal_during_writing_leaves_no_part_of_a_file(self):
        mesh = self.write("large.ply", grid_ply(400))
        killed = 0
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            process = self.start(mesh, "-o", self.out)
            while not os.listdir(self.outputs) and process.poll() is None:
                pass
            process.send_signal(number)
            code = process.wait(60)
            self.assertIn(code, (-number, DONE))
            killed += code != DONE
            if self.out.exists():  # the signal came after the rename
                self.assertEqual(self.info("--verify", self.out).returncode, DONE)
                self.out.unlink()
            self.assert_nothing_written()
        self.assertGreater(killed, 0, "no signal came in time: the test shows nothing")

    def interrupted_build(self, *arguments):
        """What a build of best effort reports that Ctrl-C ended while it optimised."""
        mesh = self.write("large.ply", grid_ply(100))
        ours, theirs = terminal(self)
        process = subprocess.Popen([BVHBUILD, mesh, "-o", self.out, "--effort", "best", *arguments], stdout=subprocess.PIPE, stderr=theirs)
        os.close(theirs)
        text = b""
        while b" %" not in text:  # optimisation is under way, and says how far it is
            text += os.read(ours, 4096)
        process.send_signal(signal.SIGINT)
        report, _ = process.communicate(timeout=60)
        os.close(ours)
        self.assertEqual(process.returncode, DONE)
        return report

    def test_ctrl_c_during_best_effort_keeps_the_best_tree_so_far(self):
        self.assertTrue(json.loads(self.interrupted_build("--json"))["interrupted"])
        self.assertIn(b"effort best, interrupted: the best tree until then\n", self.info(self.out).stdout)
        self.assertEqual(self.info("--verify", self.out).returncode, DONE)
        info = self.info_json(self.out)
        self.assertEqual(info["imaginary_nodes"], info["imaginary_minimum"])

    def test_ctrl_c_leaves_out_the_levels_that_are_not_made_yet(self):
        report = self.interrupted_build("--levels", "0.1%,1%")
        for error in (b"0.1%", b"1%"):
            self.assertIn(b"no level for " + error + b": its making was interrupted\n", report)
        self.assertEqual(len(self.info_json(self.out)["levels"]), 1)
        self.assertEqual(self.info("--verify", "--levels", self.out).returncode, DONE)


class Streams(ToolTest):
    def test_quiet_prints_nothing(self):
        result = self.build(self.write("a.obj", CUBE_OBJ), "-o", self.out, "--quiet")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (DONE, b"", b""))

    def test_quiet_still_tells_errors(self):
        self.assert_fails(self.build(self.inputs / "none.obj", "-o", self.out, "-q"), UNREADABLE_INPUT, "no such file")

    def test_a_pipe_gets_the_report_on_standard_output_and_no_progress(self):
        result = self.build(self.write("a.obj", CUBE_OBJ), "-o", self.out)
        self.assertEqual(result.stderr, b"")
        for word in (b"mesh.bvh: 12 triangles", b"6 faces, 8 vertices", b"imaginary", b"import"):
            self.assertIn(word, result.stdout)
        self.assertNotIn(b"\x1b", result.stdout)
        self.assertNotIn(b"\r", result.stdout)

    def on_terminal(self, *arguments):
        """Runs bvhbuild with a terminal as standard error; the exit code and what the terminal got."""
        ours, theirs = terminal(self)
        result = self.build(*arguments, stderr=theirs)
        os.close(theirs)
        text = b""
        try:
            while chunk := os.read(ours, 4096):
                text += chunk
        except OSError:  # the end, on a terminal
            pass
        os.close(ours)
        return result, text

    def test_a_terminal_sees_the_four_steps_and_a_clean_line_at_the_end(self):
        result, text = self.on_terminal(self.write("a.obj", CUBE_OBJ), "-o", self.out)
        self.assertEqual(result.returncode, DONE)
        for step in (b"import a.obj", b"clean", b"build", b"write"):
            self.assertIn(step, text)
        self.assertTrue(text.endswith(b"\r\x1b[K"), text)
        self.assertNotIn(b"\x1b", result.stdout)

    def test_a_terminal_sees_nothing_of_a_quiet_build(self):
        _, text = self.on_terminal(self.write("a.obj", CUBE_OBJ), "-o", self.out, "--quiet")
        self.assertEqual(text, b"")

    def test_an_error_on_a_terminal_stands_on_a_line_of_its_own(self):
        result, text = self.on_terminal(self.write("bad.ply", "ply\n"), "-o", self.out)
        self.assertEqual(result.returncode, UNREADABLE_INPUT)
        self.assertIn(b"\r\x1b[Kbvhbuild: ", text)

    def test_a_report_that_cannot_be_printed_is_an_error(self):
        out = self.built("a.obj", CUBE_OBJ)
        with open("/dev/full", "wb") as full:
            for arguments in ([out], [out, "--json"], [out, "--verify"]):
                self.assertEqual(self.info(*arguments, stdout=full).returncode, UNWRITABLE_OUTPUT)
            for arguments in ([], ["--json"]):
                result = self.build(self.inputs / "a.obj", "-o", out, *arguments, stdout=full)
                self.assertEqual(result.returncode, UNWRITABLE_OUTPUT)
                self.assertEqual(result.stderr.decode(), f"bvhbuild: {out} is complete, but the report could not be printed: "
                                                         "No space left on device\n")
            result = self.build(self.inputs / "none.obj", "-o", out, "--json", stdout=full)
            self.assertEqual(result.returncode, UNREADABLE_INPUT)
            self.assertIn(b"no such file\nbvhbuild: the report could not be printed", result.stderr)
            self.assertEqual(self.build(self.inputs / "a.obj", "-o", out, "--quiet", stdout=full).returncode, DONE)

    def test_closed_standard_streams_do_no_harm(self):
        mesh = self.write("a.dae", COLLADA_TRIANGLE)  # read by assimp, through a pipe
        closed = 'exec "$@" <&- >&- 2>&-'
        result = self.run_tool("sh", "-c", closed, "sh", BVHBUILD, mesh, "-o", self.out)
        self.assertEqual(result.returncode, DONE)
        self.assertEqual(self.info(self.out, "--verify").returncode, DONE)


class BuildJson(ToolTest):
    ALWAYS = {"tool", "version", "exit_code", "error", "input", "output", "reader", "single_precision_reader", "faces",
              "vertices", "remarks", "findings", "seconds", "peak_memory_bytes"}
    AFTER_SUCCESS = {"interrupted", "parts", "origin", "rounding_error", "tree", "gpu_blocks", "topology", "refit", "bytes",
                     "hash"}
    FINDINGS = {"faces_index_out_of_range", "faces_too_few_corners", "faces_not_finite", "faces_too_large",
                "faces_repeated_corner", "faces_not_simple",
                "vertices_unreferenced", "vertices_welded", "triangles_degenerate", "triangles_duplicate",
                "triangles_duplicate_reversed", "triangles_flattened"}

    def test_a_success_has_all_keys(self):
        report = self.built_json("a.obj", CUBE_OBJ)
        self.assertEqual(set(report), self.ALWAYS | self.AFTER_SUCCESS)
        self.assertEqual(set(report["findings"]), self.FINDINGS)
        self.assertEqual(set(report["seconds"]), {"import", "clean", "build", "write"})
        self.assertEqual((report["exit_code"], report["error"]), (DONE, None))
        self.assertEqual((report["faces"], report["vertices"], report["tree"]["triangles"]), (6, 8, 12))
        self.assertEqual(report["bytes"], self.out.stat().st_size)
        self.assertEqual(report["hash"], self.info_json(self.out)["hash"])

    def test_what_a_file_lacks_is_told(self):
        for key, option, word in (("gpu_blocks", "--no-gpu-blocks", b"oriented blocks"), ("topology", "--no-topology", b"topology"),
                                  ("refit", "--no-refit", b"source vertices")):
            with self.subTest(option):
                self.assertTrue(self.built_json("a.obj", CUBE_OBJ)[key])
                self.assertFalse(self.built_json("a.obj", CUBE_OBJ, option)[key])
                self.assertIn(b"no " + word, self.build(self.inputs / "a.obj", "-o", self.out, option).stdout)
                self.assertNotIn(word.split()[0], self.build(self.inputs / "a.obj", "-o", self.out).stdout)

    def test_a_failure_has_its_reason_on_both_streams(self):
        for path, out, code in ((self.inputs / "none.obj", self.out, UNREADABLE_INPUT),
                                (self.write("l.obj", "v 0 0 0\n"), self.out, NO_TRIANGLE),
                                (self.write("a.obj", CUBE_OBJ), "/dev/full", UNWRITABLE_OUTPUT)):
            result = self.build(path, "-o", out, "--json")
            report = json.loads(result.stdout)
            self.assertEqual((result.returncode, report["exit_code"]), (code, code))
            self.assertEqual(set(report), self.ALWAYS)
            self.assertEqual(result.stderr.decode(), f"bvhbuild: {report['error']}\n")

    def test_a_mesh_with_defects_counts_them(self):
        unclean = CUBE_OBJ + "v 0 0 0\nv 5 5 5\nf 1 2 2\nf 1 2 99\nf 4 3 2 9\n"
        found = self.built_json("a.obj", unclean)["findings"]
        for key, count in (("faces_index_out_of_range", 1), ("vertices_unreferenced", 1), ("vertices_welded", 1), ("triangles_degenerate", 1),
                           ("triangles_duplicate", 2)):
            self.assertEqual(found[key], count, key)


class Overlap(ToolTest):
    def test_a_mesh_of_coincident_triangles_is_shown_without_figures_of_work(self):
        out = self.built("a.obj", TRIANGLE_OBJ + "f 1 2 3\n" * 20000)
        for arguments in ([out], [out, out]):
            self.assertEqual(self.info(*arguments).returncode, DONE)
        self.assertIsNone(self.info_json(out)["expected_block_pairs"])


class Strict(ToolTest):
    def test_a_clean_mesh_passes(self):
        self.built("a.obj", CUBE_OBJ, "--strict")

    def test_every_defect_is_an_error_that_says_what_was_found(self):
        for name, content, words in (
                ("flat.obj", CUBE_OBJ + "f 1 2 2\n", "on one line"),
                ("repeated.obj", CUBE_OBJ.replace("f 4 3 2 1", "f 4 3 3 2 1"), "two corners in a row in the same place"),
                ("closed.obj", CUBE_OBJ.replace("f 4 3 2 1", "f 4 3 2 1 4"), "two corners in a row in the same place"),
                ("both.obj", CUBE_OBJ + "v 9 9 9\nf 1 2 2\n", "1 vertex belongs to no face; 1 triangle has all corners"),
                ("loose.obj", CUBE_OBJ + "v 9 9 9\n", "to no face"),
                ("range.obj", CUBE_OBJ + "f 1 2 99\n", "99"),
                ("twice.obj", CUBE_OBJ + "f 4 3 2 1\n", "earlier one"),
                ("nan.obj", CUBE_OBJ + "v nan 0 0\nf 1 2 9\n", "NaN")):
            with self.subTest(name=name):
                path = self.write(name, content)
                self.assertEqual(self.build(path, "-o", self.outputs / "x.bvh").returncode, DONE)
                (self.outputs / "x.bvh").unlink()
                self.assert_fails(self.build(path, "-o", self.out, "--strict"), UNREADABLE_INPUT, path, words, "--strict")
                self.assert_nothing_written()

    def test_welding_is_no_defect(self):
        soup = "".join(f"v {x} {y} 0\n" for x, y in ((0, 0), (1, 0), (0, 1), (1, 0), (1, 1), (0, 1)))
        self.built("soup.obj", soup + "f 1 2 3\nf 4 5 6\n", "--strict")


def unprivileged(test):
    """Options of subprocess that take the rights of root away, which no permission binds."""
    if os.geteuid() != 0:
        return {}
    for folder in (test.root, test.inputs):
        folder.chmod(0o755)
    options = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
    try:
        subprocess.run([BVHBUILD, "--version"], stdout=subprocess.DEVNULL, check=True, **options)
    except (OSError, subprocess.SubprocessError):
        test.skipTest("runs as root, and nobody else may run the tool")
    return options


def terminal(test):
    """Both ends of a terminal: ours, and that of the tool."""
    try:
        return pty.openpty()
    except OSError as error:
        test.skipTest(f"no terminal to be had: {error}")


def children_of(process):
    try:
        with open(f"/proc/{process}/task/{process}/children", encoding="ascii") as file:
            return file.read().split()
    except FileNotFoundError:
        return []


if __name__ == "__main__":
    unittest.main()
