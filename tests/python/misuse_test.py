"""Every misuse is an exception that names the argument and the row, and nothing else happens."""
import re

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES

BOX = tandem.build(BOX_VERTICES, BOX_FACES)
ROWS = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
STILL = np.zeros(2, tandem.MOTION)


def poses(**fields):
    """ROWS with something else in row 1."""
    rows = ROWS.copy()
    for name, value in fields.items():
        rows[name][1] = value
    return rows


CASES = [
    # Poses.
    (lambda s: s.place(), TypeError, "instances is missing"),
    (lambda s: s.place(None, filter=None), TypeError, "instances is missing"),
    (lambda s: s.place(ROWS, asset=0), TypeError, "not beside them"),
    (lambda s: s.place([1, 2]), TypeError, "instances is list"),
    (lambda s: s.place(np.zeros((2, 12))), TypeError, "instances is an array of float64 .*INSTANCE"),
    (lambda s: s.place(ROWS.reshape(1, 2)), ValueError, r"instances has shape \(1, 2\)"),
    (lambda s: s.place(ROWS["rotation"]), TypeError, "instances is an array of float64"),
    (lambda s: s.place(rotation=np.eye(4)), ValueError, r"rotation has shape \(4, 4\) where \(3, 3\) or \(n, 3, 3\)"),
    (lambda s: s.place(rotation=np.zeros((2, 9))), ValueError, "rotation has shape"),
    (lambda s: s.place(translation=[1, 2]), ValueError, r"translation has shape \(2,\)"),
    (lambda s: s.place(translation=[[1, 2, 3], [4, 5]]), ValueError, "translation is no array"),
    (lambda s: s.place(translation="here"), TypeError, "translation has <U4"),
    (lambda s: s.place(translation=[None, None, None]), TypeError, "translation has object"),
    (lambda s: s.place(translation=np.zeros(3, complex)), TypeError, "translation has complex128"),
    (lambda s: s.place(transform=np.zeros((3, 3))), ValueError, "transform has shape"),
    (lambda s: s.place(transform=[np.eye(4), np.ones((4, 4))]), ValueError, "transform: the last row of matrix 1"),
    (lambda s: s.place(transform=np.full((4, 4), np.nan)), ValueError, "transform: the last row of matrix 0"),
    (lambda s: s.place(transform=np.eye(4), rotation=np.eye(3)), TypeError, "transform stands instead"),
    (lambda s: s.place(asset=[0, 0, 0], translation=np.zeros((2, 3))), ValueError, "different numbers of rows: asset 3, translation 2"),
    (lambda s: s.place(asset=[0, -1]), ValueError, "asset: row 1 is not from 0"),
    (lambda s: s.place(asset=[0, 2**40]), ValueError, "asset: row 1"),
    (lambda s: s.place(asset=[0, 2**70]), TypeError, "asset has object"),
    (lambda s: s.place(asset=[0.0, 1.0]), TypeError, "asset has float64"),
    (lambda s: s.place(asset=[[0, 0]]), ValueError, "asset has shape"),
    # Assets lend their bytes as a buffer, which is no array of numbers.
    (lambda s: tandem.Scene([BOX], asset=BOX), TypeError, "asset: Asset is given where places in the scene's list of assets, whole numbers, are wanted"),
    (lambda s: s.place(asset=[BOX, BOX]), TypeError, "asset: Asset is given where places"),
    (lambda s: s.add(BOX), TypeError, "asset: Asset is given where places"),
    (lambda s: s.place(translation=BOX), TypeError, "translation: Asset is given where numbers are wanted"),
    (lambda s: s.move(BOX, translation=np.zeros(3)), TypeError, "bodies: Asset is given where whole numbers"),
    (lambda s: s.contacts(pairs=BOX), TypeError, "pairs: Asset is given where whole numbers"),
    (lambda s: s.bodies_at(BOX), TypeError, "points: Asset is given where numbers"),
    (lambda s: tandem.Filter(motion=BOX), TypeError, "motion: Asset is given where whole numbers"),
    (lambda s: tandem.build(BOX, BOX_FACES), TypeError, "vertices: Asset is given where numbers"),
    (lambda s: tandem.build(BOX_VERTICES, BOX), TypeError, "faces: Asset is given where whole numbers"),
    (lambda s: s.place(poses(asset=1)), tandem.Error, "instance 1: .*asset"),
    (lambda s: s.place(poses(rotation=np.diag([1, 1, -1]))), tandem.Error, "instance 1: .*rotation"),
    (lambda s: s.place(poses(translation=np.nan)), tandem.Error, "instance 1"),
    (lambda s: s.add(translation=np.full(3, np.nan)), tandem.Error, "instance 0"),
    (lambda s: s.add(1), tandem.Error, "instance 0: .*asset"),
    (lambda s: s.add([0, 0]), ValueError, "2 bodies where one is wanted"),
    (lambda s: s.add(motion=9), tandem.Error, "instance 0"),
    (lambda s: s.move([0, 1], translation=np.zeros((3, 3))), ValueError, "different numbers of rows: bodies 2, poses 3"),
    (lambda s: s.move(0), TypeError, "instances is missing"),
    (lambda s: s.move("0", translation=np.zeros(3)), TypeError, "bodies has"),
    (lambda s: s.remove(-1), ValueError, "body is -1"),
    (lambda s: s.set_motion(0, 4), ValueError, "motion is 4"),
    # Pairs.
    (lambda s: s.contacts(pairs=[[0, 2]]), tandem.Error, "pair 0"),
    (lambda s: s.contacts(pairs=[[0, 1], [-1, 0]]), ValueError, "pairs: row 1"),
    (lambda s: s.contacts(pairs=[0, 1]), ValueError, r"pairs has shape \(2,\)"),
    (lambda s: s.contacts(pairs=[[0, 1, 2]]), ValueError, r"pairs has shape \(1, 3\)"),
    (lambda s: s.contacts(pairs=[[0.5, 1.0]]), TypeError, "pairs has float64"),
    (lambda s: s.contacts(pairs=np.zeros((1, 1), tandem.PAIR)), ValueError, "pairs has shape"),
    (lambda s: s.contacts(pairs="01"), TypeError, "pairs has"),
    # Options.
    (lambda s: s.contacts(mode="exactly"), ValueError, "mode is 'exactly' where one of 'exact', 'fast', 'boxes'"),
    (lambda s: s.contacts(mode=0), ValueError, "mode is 0"),
    (lambda s: s.contacts(within="far"), TypeError, "within is str"),
    (lambda s: s.contacts(within=10**400), ValueError, "within is 1000"),
    (lambda s: setattr(s, "threads", 0), ValueError, "threads is 0 where 1 to 1024"),
    (lambda s: setattr(s, "threads", 2000), ValueError, "threads is 2000"),
    (lambda s: setattr(s, "threads", 1.5), TypeError, "threads is float"),
    (lambda s: s.place(ROWS, filter=[1, 1]), TypeError, "filter is list"),
    (lambda s: s.place(ROWS, filter=tandem.Filter(group=[])), tandem.Error, "filter"),
    (lambda s: s.place(ROWS, filter=tandem.Filter(excluded=[[0, 7]])), tandem.Error, "instance"),
    (lambda s: tandem.Filter(motion=[0, 256]), ValueError, "motion: row 1"),
    (lambda s: tandem.Filter(motion=[[0, 1]]), ValueError, "motion has shape"),
    (lambda s: tandem.Filter(motion=[0], group=[1, 2]), ValueError, "group has shape"),
    (lambda s: tandem.Filter(excluded=[[0, -7]]), ValueError, "excluded: row 0"),
    (lambda s: s.contacts(within=0.1) and s.contained(), tandem.Error, "were not found"),
    (lambda s: s.contacts(leave_out_rings=-1), ValueError, "leave_out_rings is -1 where 0 to 8"),
    (lambda s: s.contacts(leave_out_rings=9), ValueError, "leave_out_rings is 9 where 0 to 8"),
    (lambda s: s.contacts(leave_out_rings=1.0), TypeError, "leave_out_rings is float"),
    (lambda s: s.manifolds(most_points=0), ValueError, "most_points is 0"),
    (lambda s: s.manifolds(most_points=8), ValueError, "most_points is 8"),
    (lambda s: s.distances(reach=[1]), TypeError, "reach is list"),
    (lambda s: s.distances(former=np.zeros(1)), TypeError, "former is an array of float64 .*FORMER"),
    (lambda s: s.impacts(STILL[:1], 1.0), ValueError, r"motion has shape \(1,\) where \(2,\)"),
    (lambda s: s.impacts(np.zeros((2, 9)), 1.0), TypeError, "motion is an array of float64 .*MOTION"),
    (lambda s: s.impacts(STILL, None), TypeError, "duration is NoneType"),
    # Scenes and assets.
    (lambda s: tandem.Scene(BOX), TypeError, "assets is one asset"),
    (lambda s: tandem.Scene([BOX, None]), TypeError, "assets: entry 1 is NoneType"),
    (lambda s: tandem.Scene(3), TypeError, ""),
    (lambda s: tandem.Scene([], ROWS), tandem.Error, "instance 0"),
    (lambda s: BOX.levels_from(-1), ValueError, "first is -1"),
    (lambda s: BOX.levels_from(2**40), ValueError, "first is"),
    (lambda s: BOX.triangles(1), tandem.Error, "no such level"),
    (lambda s: BOX.triangles("0"), TypeError, "level is str"),
    (lambda s: BOX.faces(-1), ValueError, "level is -1"),
    (lambda s: BOX.coarsest_level("x"), TypeError, "tolerance is str"),
    (lambda s: memoryview(tandem._tandem.Asset.__new__(tandem._tandem.Asset)), BufferError, "the asset was never made"),
    (lambda s: tandem.Asset.load(5), TypeError, "5|int"),
    (lambda s: tandem.Asset.load("x", access="mmap"), ValueError, "access is 'mmap'"),
    (lambda s: tandem.Asset.from_bytes("text"), TypeError, "bytes-like"),
    (lambda s: tandem.Asset.from_bytes(b"", check="none"), ValueError, "check is 'none'"),
    (lambda s: tandem.Asset.from_bytes(b""), tandem.Error, ""),
    (lambda s: tandem.Asset.from_bytes(b"\0" * 4096), tandem.Error, ""),
    (lambda s: tandem.Asset.from_bytes(memoryview(bytes(8192))[::2]), BufferError, ""),
    # Meshes.
    (lambda s: tandem.build(BOX_VERTICES.ravel(), BOX_FACES), ValueError, r"vertices has shape \(24,\)"),
    (lambda s: tandem.build(BOX_VERTICES[:, :2], BOX_FACES), ValueError, "vertices has shape"),
    (lambda s: tandem.build([["a", "b", "c"]], BOX_FACES), TypeError, "vertices has <U1"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES.astype(float)), TypeError, "faces has float64"),
    (lambda s: tandem.build(BOX_VERTICES, -BOX_FACES), ValueError, "faces: row 0"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES.ravel()), ValueError, r"faces has shape \(36,\)"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES + 1), ValueError, "^faces: row 2 has vertex 8 where 0 to 7 is wanted"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES[::-1] - 1, return_report=True), ValueError, "^faces: row 2 has vertex -1 where 0 to 7 is wanted"),
    (lambda s: tandem.build(BOX_VERTICES, np.array([[0, 1, 2**32 - 1]], np.uint32)), ValueError, "^faces: row 0 has vertex 4294967295 where 0 to 7"),
    (lambda s: tandem.build(BOX_VERTICES, np.array([[0, 1, 2**64 - 1]], np.uint64)), ValueError, "^faces: row 0 has vertex 18446744073709551615 where 0 to 7"),
    (lambda s: tandem.build(BOX_VERTICES, [[0, 1, 2], [0, 1, 2, 8]]), ValueError, "^faces: row 1 has vertex 8 where 0 to 7 is wanted"),
    (lambda s: tandem.build([], BOX_FACES), ValueError, "^faces: row 0: there are no vertices"),
    (lambda s: tandem.build(BOX_VERTICES * np.nan, BOX_FACES), tandem.Error, "none of the triangles"),
    (lambda s: tandem.build([], []), tandem.Error, "none of the triangles"),
    (lambda s: tandem.build(BOX_VERTICES), TypeError, "^faces is missing, or ndarray has no vertices and faces of its own"),
    (lambda s: tandem.build("cow.obj"), TypeError, "^faces is missing, or str has no"),
    (lambda s: tandem.build(BOX_VERTICES, effort="fast"), TypeError, "^faces is missing"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, effort="max"), ValueError, "effort is 'max'"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, threads=-1), ValueError, "threads is -1"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, imaginary_share=np.nan), ValueError, "imaginary_share is nan"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, imaginary_share="x"), TypeError, "imaginary_share is str"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[1]), ValueError, r"face_ids has shape \(1,\) where \(12,\)"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[2**32 - 1] * 12), ValueError, "face_ids: row 0"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[0] * 11 + [2**32 - 2]), ValueError, "face_ids: row 11"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", 12), ("b", "", 2**32 - 13)]), ValueError, "parts have 2.32 - 1 faces"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=["ab"]), TypeError, "parts: row 0"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", 12), ("b", 5, 1)]), TypeError, "parts: row 1: path is int"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a\0", "", 12)]), ValueError, "parts: row 0: name has a zero"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("\ud800", "", 12)]), ValueError, "parts: row 0: name is no UTF-8"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", -1)]), ValueError, "parts: row 0: number of faces is -1"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, provenance=5), TypeError, "provenance is int"),
    (lambda s: tandem.build(BOX_VERTICES, BOX_FACES, progress=5), TypeError, "progress is int"),
]
# Flags, each with a call that takes it.
FLAGS = [
    ("first_contact_only", lambda s, value: s.contacts(first_contact_only=value)),
    ("self_pairs", lambda s, value: s.contacts(self_pairs=value)),
    ("add_error_bounds", lambda s, value: s.contacts(add_error_bounds=value)),
    ("self_pairs", lambda s, value: s.pairs(self_pairs=value)),
    ("match_previous", lambda s, value: s.manifolds(match_previous=value)),
    ("quick_depths", lambda s, value: s.manifolds(quick_depths=value)),
    ("gpu_blocks", lambda s, value: tandem.build(BOX_VERTICES, BOX_FACES, gpu_blocks=value)),
    ("topology", lambda s, value: tandem.build(BOX_VERTICES, BOX_FACES, topology=value)),
    ("refit", lambda s, value: tandem.build(BOX_VERTICES, BOX_FACES, refit=value)),
    ("return_report", lambda s, value: tandem.build(BOX_VERTICES, BOX_FACES, return_report=value)),
]
for name, ask in FLAGS:
    CASES += [(lambda s, ask=ask, value=value: ask(s, value), TypeError, f"^{name} is {type(value).__name__} where True or False is wanted")
              for value in ("no", 1, None, np.ones(1, bool))]
# Numbers of calls, each with what is too large for it.
AMOUNTS = [
    ("within", np.inf, lambda s, value: s.contacts(within=value)),
    ("reach", None, lambda s, value: s.pairs(reach=value)),
    ("reach", None, lambda s, value: s.distances(reach=value)),
    ("absolute_tolerance", None, lambda s, value: s.distances(absolute_tolerance=value)),
    ("relative_tolerance", None, lambda s, value: s.distances(relative_tolerance=value)),
    ("duration", np.inf, lambda s, value: s.impacts(STILL, value)),
    ("tolerance", np.inf, lambda s, value: s.impacts(STILL, 1.0, tolerance=value)),
    ("tolerance", 1e301, lambda s, value: s.verdicts(tolerance=value)),
]
for name, too_large, ask in AMOUNTS:
    CASES += [(lambda s, ask=ask, value=value: ask(s, value), ValueError, f"^{name} is {re.escape(str(value))} where 0 to")
              for value in (np.nan, -1.0, -np.inf, too_large) if value is not None]


TURNED = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
DEFECTS = [
    ({"translation": [0, np.nan, 0]}, "its translation is not finite (it has nan)"),
    ({"translation": [0, 0, -np.inf]}, "its translation is not finite (it has -inf)"),
    ({"rotation": np.full((3, 3), np.nan)}, "its rotation is not finite (it has nan)"),
    ({"rotation": 2 * TURNED}, "its rotation is not orthonormal: it scales by 2"),
    ({"rotation": 1.001 * TURNED}, "its rotation is not orthonormal: it scales by 1.001"),
    ({"rotation": 1e300 * TURNED}, "its rotation is not orthonormal: it scales by 1e+300"),
    ({"rotation": np.zeros((3, 3))}, "its rotation is not orthonormal: it scales by 0"),
    ({"rotation": TURNED * [1, 1, 3]}, "its rotation is not orthonormal: it scales by 1 to 3, depending on the direction"),
    ({"rotation": -TURNED}, "its rotation is a reflection, with a determinant below 0"),
    ({"rotation": TURNED * [1, 1, -1]}, "its rotation is a reflection, with a determinant below 0"),
    ({"rotation": -2 * TURNED}, "its rotation is a reflection, with a determinant below 0, which also scales by 2"),
    ({"rotation": np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]], np.float16)}, "its rotation is too coarse: it is 0.0002 from orthonormal, where 1e-06 is allowed (float16 is not enough, float32 is)"),
]


@pytest.mark.parametrize("fields, words", DEFECTS)
def test_a_pose_is_refused_with_the_reason(fields, words):
    scene = tandem.Scene([BOX], ROWS)
    row = {name: np.array(value) for name, value in fields.items()}
    for place, call in ((0, lambda: scene.add(**row)), (1, lambda: scene.move([0, 1], poses(**fields))), (1, lambda: scene.place(poses(**fields)))):
        with pytest.raises(tandem.Error) as caught:
            call()
        assert str(caught.value) == f"instance {place}: a pose is not a rotation and a translation: {words}"
        assert (caught.value.name, caught.value.subject, caught.value.where) == ("PoseNotRigid", "instance", place)
    scene.place(rotation=TURNED.astype(np.float32))


@pytest.mark.parametrize("number", range(len(CASES)))
def test_misuse(number):
    call, kind, words = CASES[number]
    scene = tandem.Scene([BOX], ROWS)
    with pytest.raises(kind) as caught:
        call(scene)
    assert type(caught.value) is kind and re.search(words, str(caught.value)), str(caught.value)
    # The scene works as ever.
    assert len(scene.place(ROWS).contacts().contacts) == 18


def test_flags_of_numpy_are_taken():
    for _, ask in FLAGS:
        for value in (np.True_, np.False_):
            ask(tandem.Scene([BOX], ROWS), value)


def test_the_largest_amounts_are_taken():
    scene = tandem.Scene([BOX], ROWS)
    count = len(ROWS) * (len(ROWS) - 1) // 2
    assert len(scene.pairs(reach=np.inf)) == len(scene.verdicts(tolerance=1e300).verdicts) == count
    assert len(scene.contacts(within=1e300).pairs) == count
    assert len(scene.distances(reach=np.inf, absolute_tolerance=np.inf).distances) == count
    scene.impacts(STILL, np.finfo(float).max, tolerance=np.finfo(float).max)


def test_an_error_leaves_no_contacts_to_make_manifolds_of():
    scene = tandem.Scene([BOX], ROWS)
    scene.contacts()
    with pytest.raises(tandem.Error):
        scene.contacts(pairs=[[0, 2]])
    for question in (scene.manifolds, scene.contained):
        with pytest.raises(tandem.Error, match="were not found") as caught:
            question()
        assert caught.value.name == "ContactsMissing"
    with pytest.raises(tandem.Error):
        scene.place(poses(translation=np.nan))
    assert len(scene.instances) == len(scene.manifolds().pairs) == 0
