#!/usr/bin/env python3
"""Writes seed files for the fuzzers of the readers: make_corpus.py FOLDER makes FOLDER/obj, /ply, /stl, /off and /gltf.

The seeds are small and together use every feature of their format, so that a fuzzer finds the far corners soon.
"""
import base64
import itertools
import json
import pathlib
import struct
import sys

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def obj_seeds():
    vertices = "".join("v %g %g %g\n" % point for point in POINTS)
    yield vertices + "".join("f %d %d %d\n" % tuple(i + 1 for i in face) for face in FACES)
    yield "\ufeffo a\r\n" + vertices.replace("\n", " 1 0 0\r\n") + "g b c\r\nf 1/1/1 2//2 3/3 # c\r\ng\r\nf -1 -2 -3 -4\r\n"
    yield "# c\rv 1e400 -nan 1.#INF\rv +.5 5. 1E-3 \\\r 1\rf 1 2 \\\r 0\rf 9 99 999\r"
    yield vertices + "p 1\nl 1 2 3\nf 1 2\nvt 0 0\nvn 0 0 1\nusemtl m\ncstype bspline\nsurf 0 1 0 1 1 2 \\\n3 4\nend\nf 4 3 2\n"


def ply_header(form, vertex, face):
    return "ply\nformat %s 1.0\ncomment seed\n%s%send_header\n" % (form, vertex, face)


def ply_binary_seeds():
    types = [("char", "b"), ("uint8", "B"), ("short", "h"), ("uint16", "H"), ("int", "i"), ("uint32", "I"), ("float", "f"), ("float64", "d")]
    for (name, code), (form, order) in itertools.product(types, [("binary_little_endian", "<"), ("binary_big_endian", ">")]):
        vertex = "element vertex 4\n" + "".join("property %s %s\n" % (name, axis) for axis in "xyz")
        face = "element face 4\nproperty uchar flag\nproperty list uchar %s vertex_indices\n" % name
        data = b"".join(struct.pack(order + "3" + code, *point) for point in POINTS)
        data += b"".join(struct.pack(order + "BB3" + code, 7, 3, *corners) for corners in FACES)
        yield ply_header(form, vertex, face).encode() + data


def ply_seeds():
    vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    points = "".join("%g %g %g\n" % point for point in POINTS)
    face = "element face 4\nproperty list uchar int vertex_index\n"
    yield ply_header("ascii", vertex, face) + points + "".join("3 %d %d %d\n" % corners for corners in FACES)
    yield (ply_header("ascii", vertex, "obj_info o\n" + face) + points + "4 0 1 2 3\n2 0 1\n3 0 1 99\n3 -1 0 1\n").replace("\n", "\r\n")
    strips = "element tristrips 2\nproperty list int int vertex_indices\n"
    yield ply_header("ascii", vertex, strips) + points + "8 0 1 2 3 -1 3 2 1\n5 0 1 1 2 3\n"
    yield ply_header("ascii", "element other 1\nproperty list uchar float l\nproperty double d\n" + vertex, "") + "2 1 nan 5\n" + points
    strips = "element tristrips 1\nproperty list uchar char vertex_indices\n"
    points = b"".join(struct.pack("<3f", *point) for point in POINTS)
    yield ply_header("binary_little_endian", vertex, strips).encode() + points + struct.pack("<B9b", 9, 0, 1, 2, 3, -1, 3, 2, 1, 0)
    yield from ply_binary_seeds()


def stl_text(name, loops):
    facets = ("facet normal 0 0 1\n outer loop\n%s endloop\nendfacet\n" % "".join("  vertex %g %g %g\n" % point for point in loop)
              for loop in loops)
    return "solid %s\n%sendsolid %s\n" % (name, "".join(facets), name)


def stl_seeds():
    triangles = [[POINTS[i] for i in face] for face in FACES]
    yield stl_text("a", triangles)
    yield stl_text("a b", triangles[:1]) + "# c\n; c\n// c\n" + stl_text("", [POINTS]).upper().replace("\n", "\r\n")
    data = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for point in triangle for x in point), 0) for triangle in triangles)
    for title, count in [(b"binary", 4), (b"solid binary", 4), (b"too many", 5), (b"too few", 3), (b"lies", 0xFFFFFFFF)]:
        yield title.ljust(80) + struct.pack("<I", count) + data
    yield bytes(84)


def off_binary():
    data = b"CNOFF BINARY\n" + struct.pack(">3i", 4, 4, 6)
    data += b"".join(struct.pack(">10f", *point, 0, 0, 1, 1, 0, 0, 1) for point in POINTS)
    return data + b"".join(struct.pack(">5if", 3, *corners, 1, 0.5) for corners in FACES)


def off_seeds():
    points = "".join("%g %g %g\n" % point for point in POINTS)
    faces = "".join("3 %d %d %d\n" % corners for corners in FACES)
    yield "OFF\n4 4 6\n" + points + faces
    yield "# c\n4 4\n" + points + faces.replace(" ", "\n")
    yield "STCNOFF 4 4 0\n" + points.replace("\n", " 0 0 1 255 0 0 1 .5 .5 # c\n") + faces.replace("\n", " 0.5 0 0\r\n")
    yield "OFF\n4\n4\n0\n" + points + "4 0 1 2 3\n2 0 1\n3 0 1 99\n3 -1 0 1\n"
    yield "4nOFF\n3\n"
    yield off_binary()


def gltf_document(buffer, **more):
    """A tetrahedron as triangles and a strip, at nodes with all kinds of transforms; a sparse accessor moves a corner."""
    accessors = [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                 {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
                 {"componentType": 5123, "count": 4, "type": "VEC3", "normalized": True,
                  "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}}}]
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 2}, "indices": 1, "mode": 5},
                  {"attributes": {"POSITION": 0}, "mode": 6}, {"attributes": {}, "mode": 0}]
    nodes = [{"children": [1, 2], "translation": [1, 2, 3], "rotation": [0, 0, 1, 0], "scale": [1, 1, -2.5e-1]},
             {"name": "n", "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
             {"mesh": 0, "skin": 0, "weights": [1], "extensions": {"EXT_mesh_gpu_instancing": {}}}]
    views = [{"buffer": 0, "byteLength": 48, "byteStride": 12}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}]
    return json.dumps({"asset": {"version": "2.0"}, "nodes": nodes, "meshes": [{"name": "m", "primitives": primitives}],
                       "accessors": accessors, "bufferViews": views, "buffers": [dict(buffer, byteLength=60)], **more})


def gltf_seeds():
    data = b"".join(struct.pack("<3f", *point) for point in POINTS) + bytes(itertools.chain(*FACES))
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    yield gltf_document({"uri": uri})
    yield gltf_document({"uri": uri, "name": "b"}, scene=0, scenes=[{"nodes": [1]}, {}], extensionsRequired=["KHR_mesh_quantization"])
    yield gltf_document({"uri": "a%20b.bin"})
    text = gltf_document({}).encode()
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    yield b"glTF" + struct.pack("<2I", 2, 12 + len(chunks)) + chunks


def main():
    folder = pathlib.Path(sys.argv[1])
    for kind, seeds in [("obj", obj_seeds()), ("ply", ply_seeds()), ("stl", stl_seeds()), ("off", off_seeds()), ("gltf", gltf_seeds())]:
        (folder / kind).mkdir(parents=True, exist_ok=True)
        for number, seed in enumerate(seeds):
            data = seed if isinstance(seed, bytes) else seed.encode()
            (folder / kind / ("%02d.%s" % (number, kind))).write_bytes(data)


if __name__ == "__main__":
    main()
