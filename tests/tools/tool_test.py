"""What the tests of the command-line tools share: running them in a folder of their own, and tiny meshes."""
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

BVHBUILD = os.environ["TANDEM_BVHBUILD"]
BVHINFO = os.environ["TANDEM_BVHINFO"]
SOURCE_DIR = pathlib.Path(os.environ["TANDEM_SOURCE_DIR"])
DONE, USAGE, UNREADABLE_INPUT, NO_TRIANGLE, UNWRITABLE_OUTPUT, INTERNAL, UNUSABLE_GPU = range(7)

TRIANGLE_OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
CUBE_OBJ = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"""

# In decimetres, z up, moved by a node: the triangle lies at (1, 0, 0), (1.1, 0, 0), (1, 0.1, 0) metres.
COLLADA_TRIANGLE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="decimeter" meter="0.1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="tri"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n" name="moved"><translate>10 0 0</translate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


class ToolTest(unittest.TestCase):
    """Each test has an empty folder for its inputs and one for its outputs, which both go with it."""

    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="tandem test "))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        self.inputs, self.outputs = self.root / "in", self.root / "out"
        self.inputs.mkdir()
        self.outputs.mkdir()
        self.out = self.outputs / "mesh.bvh"

    def run_tool(self, tool, *arguments, **options):
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL, "timeout": 60,
                   **options}
        return subprocess.run([tool, *arguments], **options)

    def succeeds(self, tool, *arguments, **options):
        """The standard output of a tool that ends well and says nothing on standard error."""
        result = self.run_tool(tool, *map(str, arguments), **options)
        self.assertEqual((result.returncode, result.stderr), (DONE, b""))
        return result.stdout.decode()

    def build(self, *arguments, **options):
        return self.run_tool(BVHBUILD, *arguments, **options)

    def info(self, *arguments, **options):
        return self.run_tool(BVHINFO, *arguments, **options)

    def write(self, name, content):
        path = self.inputs / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def built(self, name, content, *arguments):
        """The .bvh file made of a mesh with this content."""
        self.succeeds(BVHBUILD, self.write(name, content), "-o", self.out, *arguments)
        return self.out

    def built_json(self, name, content, *arguments):
        return json.loads(self.succeeds(BVHBUILD, self.write(name, content), "-o", self.out, "--json", *arguments))

    def info_json(self, *arguments):
        """What bvhinfo tells of files, sound or not."""
        return json.loads(self.info("--json", *arguments).stdout)

    def assert_fails(self, result, code, *words):
        """The exit code is `code`, standard output empty, and standard error one line that holds all words."""
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, b"")
        message = os.fsdecode(result.stderr)
        self.assertTrue(message.startswith(f"{pathlib.Path(result.args[0]).name}: "), message)
        for word in words:
            self.assertIn(os.fspath(word), message)
        self.assertEqual(len(re.sub(r"\nTry '\w+ --help'\.$", "", message.removesuffix("\n")).split("\n")), 1, message)

    def assert_nothing_written(self):
        self.assertEqual(os.listdir(self.outputs), [])

    def assert_full_disk_is_told(self, *command):
        """The command, which `-o` is added to, finds its disk full: it says so, and leaves nothing there."""
        script = 'mount -t tmpfs -o size=64k tandem "$0" || exit 77; "$@" -o "$0/out"; code=$?; ls -A "$0"; exit $code'
        result = self.run_tool("unshare", "-m", "sh", "-c", script, self.outputs, *command)
        if result.returncode in (1, 77):
            self.skipTest("no file system may be mounted here")
        self.assertEqual((result.returncode, result.stdout), (UNWRITABLE_OUTPUT, b""))
        self.assertIn(b"No space left on device", result.stderr)


def limited_files(size):
    """Options of a process whose files may have so many bytes."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return {"preexec_fn": limit}


def grid_ply(cells):
    """A binary PLY of 2 * cells^2 triangles: a wavy sheet."""
    x, y = np.meshgrid(np.arange(cells + 1, dtype=np.float32), np.arange(cells + 1, dtype=np.float32))
    points = np.stack([x, y, np.sin(x / 7) * np.cos(y / 5)], axis=-1).reshape(-1, 3).astype("<f4")
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1)
    right, above = corner + 1, corner + cells + 1
    triangles = np.stack([np.stack([corner, right, above], 1), np.stack([right, above + 1, above], 1)], 1)
    faces = np.zeros(2 * cells * cells, dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, triangles.reshape(-1, 3)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    return header.encode() + points.tobytes() + faces.tobytes()


def obj(points, faces, first=1):
    """An OBJ of triangles, which name its points from `first` on."""
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*point) for point in points]
    return "\n".join(lines + ["f {} {} {}".format(*(np.asarray(face) + first)) for face in faces]) + "\n"


def sheet(rows, height):
    """A square of 2 rows^2 triangles over [0, 1]^2, its heights given: points and faces."""
    at = np.arange(rows + 1) / rows
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    corner = lambda i, j: i * (rows + 1) + j
    faces = []
    for i in range(rows):
        for j in range(rows):
            faces += [(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)),
                      (corner(i, j), corner(i + 1, j + 1), corner(i, j + 1))]
    return np.stack([x, y, height(x, y)], 1), faces


def soup_obj(points, number="{:.9g}"):
    """An OBJ of triangles that have three points each of their own."""
    points = list(points)
    lines = ["v " + " ".join(number.format(x) for x in point) for point in points]
    return "\n".join(lines + [f"f {i + 1} {i + 2} {i + 3}" for i in range(0, len(points), 3)]) + "\n"


def scattered_obj(triangles, seed=1):
    """Small triangles at random places, each with vertices of its own."""
    random = np.random.default_rng(seed)
    return soup_obj((random.random((triangles, 1, 3)) + 0.1 * random.random((triangles, 3, 3))).reshape(-1, 3))
