"""Assets: made, kept, shown, and refused."""
import copy
import json
import os
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES, check_errors_of_files, read_obj

ASSETS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "assets"


@pytest.fixture(scope="module")
def box():
    return tandem.build(BOX_VERTICES + 10, BOX_FACES)


def test_shows_its_mesh_in_the_files_coordinates(box):
    assert box.bounds.tolist() == [[10, 10, 10], [11, 11, 11]]
    level, = box.levels
    assert (level.triangle_count, level.vertex_count, level.component_count, level.closed, level.error_bound) == (12, 8, 1, True, 0)
    assert box.triangles().shape == (12, 3, 3)
    expected = (BOX_VERTICES + 10)[BOX_FACES]
    for triangle, face in zip(box.triangles(), box.faces()):
        assert sorted(map(tuple, triangle)) == sorted(map(tuple, expected[face]))


@pytest.mark.parametrize("name, options, words", [
    ("box_48", {}, []),
    ("cow_1500", {"effort": "fast"}, ["--effort", "fast"]),
    ("box_192", {"topology": False, "gpu_blocks": False}, ["--no-topology", "--no-gpu-blocks"]),
    ("box_48", {"refit": False}, ["--no-refit"]),
    ("cow_1500", {"effort": "fast", "imaginary_share": 1.0}, ["--effort", "fast", "--imaginary", "free"])])
def test_build_makes_the_bytes_of_bvhbuild(tmp_path, name, options, words):
    written = tmp_path / "written.bvh"
    subprocess.run([os.environ["TANDEM_BVHBUILD"], ASSETS / f"{name}.obj", "-o", written, "--quiet", *words], check=True)
    by_command = tandem.Asset.load(written)
    vertices, faces = read_obj(ASSETS / f"{name}.obj")
    part, = by_command.parts
    built = tandem.build(vertices, faces, provenance=by_command._core.provenance().decode(), parts=[(part.name, part.path, part.face_count)], **options)
    assert bytes(built) == written.read_bytes()


def test_builds_meshes_of_trimesh(box):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(BOX_VERTICES + 10, BOX_FACES, process=False)
    assert bytes(tandem.build(mesh)) == bytes(tandem.build(mesh, topology=True)) == bytes(box)


def test_the_bytes_do_not_depend_on_threads():
    vertices, faces = read_obj(ASSETS / "cow_1500.obj")
    assert bytes(tandem.build(vertices, faces, threads=1)) == bytes(tandem.build(vertices, faces, threads=4))


def test_saves_whole_and_loads(box, tmp_path):
    path = tmp_path / "box.bvh"
    box.save(path)
    for access in ("map", "read"):
        assert bytes(tandem.Asset.load(path, access=access)) == bytes(box)
    assert tandem.Asset.load(str(path), check="quick").hash == box.hash
    assert [entry.name for entry in tmp_path.iterdir()] == ["box.bvh"]
    mask = os.umask(0)
    os.umask(mask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask
    with pytest.raises(OSError):
        box.save(tmp_path / "no" / "box.bvh")
    with pytest.raises(OSError):
        box.save(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["box.bvh"]


def test_copies_and_pickles(box):
    for other in (pickle.loads(pickle.dumps(box)), copy.copy(box), copy.deepcopy(box), tandem.Asset.from_bytes(bytearray(bytes(box)))):
        assert bytes(other) == bytes(box) and other is not box


def test_its_bytes_outlive_it():
    asset = tandem.build(BOX_VERTICES, BOX_FACES)
    expected, view = bytes(asset), asset.data
    del asset
    assert view.readonly and bytes(view) == expected
    with pytest.raises(TypeError):
        view[0] = 0


def test_names_parts_and_faces():
    asset = tandem.build(BOX_VERTICES, BOX_FACES, face_ids=np.arange(12) // 2, parts=[("lid", "box/lid", 2), ("rest", "box/rest", 4)])
    assert asset.parts == [tandem.Part("lid", "box/lid", 0, 2), tandem.Part("rest", "box/rest", 2, 4)]
    assert sorted(asset.faces().tolist()) == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    with pytest.raises(tandem.Error) as caught:
        tandem.build(BOX_VERTICES, BOX_FACES, parts=[("lid", "", 2)])
    with pytest.raises(ValueError, match="row 1 begins at face 3 where 2 is wanted"):
        tandem.build(BOX_VERTICES, BOX_FACES, parts=[tandem.Part("lid", "", 0, 2), tandem.Part("rest", "", 3, 10)])
    assert caught.value.name == "BadPart"


def test_reports_what_was_left_out():
    faces = np.concatenate([BOX_FACES, [[0, 0, 1], [0, 1, 8], [0, 1, 3]]])
    _, report = tandem.build([*BOX_VERTICES, [0, 0, np.inf]], faces, return_report=True)
    assert (report.degenerate, report.not_finite, report.duplicate) == (1, 1, 1) and sum(report) == 3
    with pytest.raises(tandem.Error) as caught:
        tandem.build(BOX_VERTICES, [])
    assert caught.value.name == "NoTriangle"


def test_names_the_defect_of_a_file(tmp_path, box):
    with pytest.raises(tandem.FileError, match="nowhere.bvh: no such file") as caught:
        tandem.Asset.load(tmp_path / "nowhere.bvh")
    assert isinstance(caught.value, FileNotFoundError) and caught.value.name == "FileNotFound"
    assert caught.value.filename == str(tmp_path / "nowhere.bvh") and str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    with pytest.raises(tandem.Error) as caught:
        tandem.Asset.from_bytes(bytes(box)[:-1])
    assert caught.value.name == "Truncated"
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.name, again.status) == (str(caught.value), "Truncated", caught.value.status)
    with pytest.raises(ValueError, match="zero byte"):
        tandem.Asset.load("a\0b")
    with pytest.raises(TypeError):
        tandem.Asset()


def test_a_file_that_cannot_be_read_raises_what_open_raises(tmp_path):
    check_errors_of_files(tandem.Asset.load, tmp_path, "a.bvh")
    check_errors_of_files(lambda path: tandem.Asset.load(path, access="read"), tmp_path, "a.bvh")


def test_shows_levels_from_one_on(tmp_path):
    path = tmp_path / "levels.bvh"
    subprocess.run([os.environ["TANDEM_BVHBUILD"], ASSETS / "cow_1500.obj", "-o", path, "--levels", "1%,4%", "--effort", "fast", "--quiet"], check=True)
    asset = tandem.Asset.load(path)
    counts = [level.triangle_count for level in asset.levels]
    assert counts == sorted(counts, reverse=True) and len(counts) == 3
    coarse = asset.levels_from(1, 1)
    assert [level.triangle_count for level in coarse.levels] == counts[1:2]
    assert [level.triangle_count for level in pickle.loads(pickle.dumps(coarse)).levels] == counts[1:2]
    assert asset.coarsest_level(asset.levels[2].error_bound) == 2
    assert coarse.triangles().shape == (counts[1], 3, 3)
    for call in (lambda: asset.levels_from(3), lambda: asset.triangles(3)):
        with pytest.raises(tandem.Error) as caught:
            call()
        assert caught.value.name == "UnknownLevel"


@pytest.mark.parametrize("name, words", [("cow_1500", ["--levels", "1%", "--effort", "fast"]), ("box_12", []), ("ground", ["--no-topology", "--no-gpu-blocks"])])
def test_statistics_are_those_of_bvhinfo(tmp_path, name, words):
    path = tmp_path / "a.bvh"
    subprocess.run([os.environ["TANDEM_BVHBUILD"], ASSETS / f"{name}.obj", "-o", path, "--quiet", *words], check=True)
    told = json.loads(subprocess.run([os.environ["TANDEM_BVHINFO"], path, "--json"], check=True, capture_output=True).stdout)
    del told["file"]
    assert tandem.Asset.load(path).statistics() == told
