"""Mesh files, polygons and levels of detail: what bvhbuild makes of them."""
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES, check_errors_of_files

pytest.importorskip("tandem._bvhbuild")
ASSETS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "assets"


def written_by_command(mesh, path, *words):
    subprocess.run([os.environ["TANDEM_BVHBUILD"], mesh, "-o", path, "--quiet", *words], check=True)
    return tandem.Asset.load(path)


@pytest.mark.parametrize("options, words", [
    ({}, []), ({"levels": "auto", "effort": "fast"}, ["--levels", "auto", "--effort", "fast"]),
    ({"levels": ["1%", "4%"], "effort": "fast", "topology": False}, ["--levels", "1%,4%", "--effort", "fast", "--no-topology"]),
    ({"levels": [0.05, 0.25], "effort": "fast", "threads": 3}, ["--levels", "0.05,0.25", "--effort", "fast"])])
def test_read_and_built_are_the_bytes_of_bvhbuild(tmp_path, options, words):
    expected = written_by_command(ASSETS / "cow_1500.obj", tmp_path / "cow.bvh", *words)
    mesh = tandem.read_mesh(ASSETS / "cow_1500.obj")
    made = tandem.build(mesh.vertices, mesh.triangles, face_ids=mesh.face_ids, parts=mesh.parts, provenance=expected._core.provenance().decode(), **options)
    assert bytes(made) == bytes(expected)
    assert len(made.levels) > ("levels" in options)


def test_polygons_are_split_as_bvhbuild_splits_them(tmp_path):
    outline = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0.5, 0.5, 1]]
    faces = [[5, 4, 3, 2, 1, 0]] + [[i, (i + 1) % 6, 6] for i in range(6)]
    path = tmp_path / "hat.obj"
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in outline) + "".join("f " + " ".join(str(v + 1) for v in face) + "\n" for face in faces))
    expected = written_by_command(path, tmp_path / "hat.bvh")
    provenance = expected._core.provenance().decode()
    assert bytes(tandem.build(outline, faces, provenance=provenance)) == bytes(expected)
    mesh = tandem.read_mesh(path)
    assert mesh.vertices.tolist() == np.array(outline, float).tolist() and len(mesh.triangles) == 10
    assert np.bincount(mesh.face_ids).tolist() == [4, 1, 1, 1, 1, 1, 1]


def test_quads_by_array():
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    box = tandem.build(BOX_VERTICES, quads)
    assert box.levels[0].closed and sorted(box.faces()) == sorted([0, 1, 2, 3, 4, 5] * 2)
    named = tandem.build(BOX_VERTICES, quads, face_ids=[7, 8, 9, 9, 9, 9])
    assert sorted(set(named.faces().tolist())) == [7, 8, 9]
    named = tandem.build(BOX_VERTICES, quads, face_ids=[2**32 - 3] * 6)
    assert set(named.faces().tolist()) == {2**32 - 3}


def test_simple_files_are_read_alike_without_the_mesh_tools(tmp_path, monkeypatch):
    quads = tmp_path / "quads.obj"
    quads.write_text("o box\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in BOX_VERTICES) + "f 1 2 4 3\nf 5 7 8 6\nf 1 2 99\n")
    off = tmp_path / "box.off"
    off.write_text(f"OFF {len(BOX_VERTICES)} {len(BOX_FACES)} 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in BOX_VERTICES) +
                   "".join(f"3 {a} {b} {c}\n" for a, b, c in BOX_FACES))
    stl = tmp_path / "box.stl"
    corners = np.zeros(len(BOX_FACES), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
    corners["corners"] = np.asarray(BOX_VERTICES)[np.asarray(BOX_FACES)]
    stl.write_bytes(bytes(80) + np.uint32(len(BOX_FACES)).tobytes() + corners.tobytes())
    ply = tmp_path / "box.ply"
    ply.write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                   "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    polygon = tmp_path / "polygon.obj"
    polygon.write_text("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5\n")
    scene = tmp_path / "scene.gltf"
    scene.write_text('{"asset": {"version": "2.0"}}')
    broken = tmp_path / "broken.obj"
    broken.write_text("v 0 0 x\n")
    files = [ASSETS / "cow_1500.obj", quads, off, stl, ply]
    expected = [tandem.read_mesh(path) for path in files]
    with pytest.raises(tandem.FileError, match="broken.obj: line 1") as refused:
        tandem.read_mesh(broken)
    monkeypatch.setitem(sys.modules, "tandem._bvhbuild", None)
    monkeypatch.delattr(tandem, "_bvhbuild", raising=False)
    for path, mesh in zip(files, expected):
        alike = tandem.read_mesh(path)
        for name in ("vertices", "triangles", "face_ids"):
            assert getattr(alike, name).tobytes() == getattr(mesh, name).tobytes(), path
        assert (alike.parts, alike.remarks) == (mesh.parts, mesh.remarks)
    for path, reason in ((polygon, "face 0 has more than four corners"), (scene, "it is no OBJ, PLY, STL or OFF file")):
        with pytest.raises(ImportError, match=f"{path.name}: {reason}, and .* without its mesh tools"):
            tandem.read_mesh(path)
    with pytest.raises(tandem.FileError) as refused_too:
        tandem.read_mesh(broken)
    assert str(refused_too.value) == str(refused.value)
    with pytest.raises(FileNotFoundError):
        tandem.read_mesh(tmp_path / "gone.obj")


def test_a_gltf_file_names_others_outside_its_folder_where_it_is_told_to(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "corners.bin").write_bytes(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32).tobytes())
    path = inner / "one.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": "../corners.bin", "byteLength": 36}],
                                "bufferViews": [{"buffer": 0, "byteLength": 36}],
                                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
                                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]}))
    with pytest.raises(tandem.FileError, match="corners.bin"):
        tandem.read_mesh(path)
    assert len(tandem.read_mesh(path, outside_files=True).triangles) == 1
    with pytest.raises(TypeError, match="outside_files is str"):
        tandem.read_mesh(path, outside_files="no")


def test_formats_of_others_are_read_by_assimp_in_a_child(tmp_path):
    path = tmp_path / "one.off3"
    path.write_text("nonsense")
    with pytest.raises(tandem.FileError, match="one.off3: "):
        tandem.read_mesh(path)
    path = tmp_path / "triangle.dxf"
    path.write_text("0\nSECTION\n2\nENTITIES\n0\n3DFACE\n8\n0\n10\n0\n20\n0\n30\n0\n11\n1\n21\n0\n31\n0\n12\n0\n22\n1\n32\n0\n13\n0\n23\n1\n33\n0\n0\nENDSEC\n0\nEOF\n")
    mesh = tandem.read_mesh(path)
    assert len(mesh.triangles) >= 1


@pytest.mark.parametrize("name", ["a.obj", "a.dae"])
def test_a_file_that_cannot_be_read_raises_what_open_raises(tmp_path, name):
    check_errors_of_files(tandem.read_mesh, tmp_path, name)


def test_says_what_is_wrong(tmp_path):
    bad = tmp_path / "bad.obj"
    bad.write_text("v 0 0 0\nv 1 0 x\n")
    with pytest.raises(tandem.FileError, match="bad.obj: line 2"):
        tandem.read_mesh(bad)
    with pytest.raises(tandem.FileError, match="nowhere.obj"):
        tandem.read_mesh(tmp_path / "nowhere.obj")
    for levels in ("1%,0.5%", [0.2, 0.1], ["x"], [-1.0]):
        with pytest.raises(ValueError, match="levels"):
            tandem.build(BOX_VERTICES, BOX_FACES, levels=levels)
    with pytest.raises(tandem.Error) as caught:
        tandem.build(BOX_VERTICES, [[0, 0, 0, 0]])
    assert caught.value.name == "NoTriangle"
    with pytest.raises(ValueError, match="faces: row 1 has vertex -1 where 0 to 7 is wanted"):
        tandem.build(BOX_VERTICES, [[0, 1, 2], [-1, 1, 2, 3]])
    with pytest.raises(ValueError, match="parts"):
        tandem.build(BOX_VERTICES, [[0, 1, 3, 2]], parts=[("a", "", 3)])
