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
    (lambda q: q.contacts(), TypeError, "instances is missing"),
    (lambda q: q.contacts(None, mode="exact"), TypeError, "instances is missing"),
    (lambda q: q.contacts(ROWS, asset=0), TypeError, "not beside them"),
    (lambda q: q.contacts([1, 2]), TypeError, "instances is list"),
    (lambda q: q.contacts(np.zeros((2, 12))), TypeError, "instances is an array of float64 .*INSTANCE"),
    (lambda q: q.contacts(ROWS.reshape(1, 2)), ValueError, r"instances has shape \(1, 2\)"),
    (lambda q: q.contacts(ROWS["rotation"]), TypeError, "instances is an array of float64"),
    (lambda q: q.contacts(rotation=np.eye(4)), ValueError, r"rotation has shape \(4, 4\) where \(3, 3\) or \(n, 3, 3\)"),
    (lambda q: q.contacts(rotation=np.zeros((2, 9))), ValueError, "rotation has shape"),
    (lambda q: q.contacts(translation=[1, 2]), ValueError, r"translation has shape \(2,\)"),
    (lambda q: q.contacts(translation=[[1, 2, 3], [4, 5]]), ValueError, "translation is no array"),
    (lambda q: q.contacts(translation="here"), TypeError, "translation has <U4"),
    (lambda q: q.contacts(translation=[None, None, None]), TypeError, "translation has object"),
    (lambda q: q.contacts(translation=np.zeros(3, complex)), TypeError, "translation has complex128"),
    (lambda q: q.contacts(transform=np.zeros((3, 3))), ValueError, "transform has shape"),
    (lambda q: q.contacts(transform=[np.eye(4), np.ones((4, 4))]), ValueError, "transform: the last row of matrix 1"),
    (lambda q: q.contacts(transform=np.full((4, 4), np.nan)), ValueError, "transform: the last row of matrix 0"),
    (lambda q: q.contacts(transform=np.eye(4), rotation=np.eye(3)), TypeError, "transform stands instead"),
    (lambda q: q.contacts(asset=[0, 0, 0], translation=np.zeros((2, 3))), ValueError, "different numbers of rows: asset 3, translation 2"),
    (lambda q: q.contacts(asset=[0, -1]), ValueError, "asset: row 1 is not from 0"),
    (lambda q: q.contacts(asset=[0, 2**40]), ValueError, "asset: row 1"),
    (lambda q: q.contacts(asset=[0, 2**70]), TypeError, "asset has object"),
    (lambda q: q.contacts(asset=[0.0, 1.0]), TypeError, "asset has float64"),
    (lambda q: q.contacts(asset=[[0, 0]]), ValueError, "asset has shape"),
    (lambda q: q.contacts(poses(asset=1)), tandem.Error, "instance 1: .*asset"),
    (lambda q: q.contacts(poses(rotation=np.eye(3) * 1.01)), tandem.Error, "instance 1: .*rotation"),
    (lambda q: q.contacts(poses(rotation=np.diag([1, 1, -1]))), tandem.Error, "instance 1: .*rotation"),
    (lambda q: q.contacts(poses(translation=np.nan)), tandem.Error, "instance 1"),
    (lambda q: q.contacts(poses(translation=np.inf)), tandem.Error, "instance 1"),
    (lambda q: q.contacts(poses(translation=1e301)), tandem.Error, "instance 1"),
    (lambda q: q.distances(poses(translation=np.nan)), tandem.Error, "instance 1"),
    (lambda q: q.impacts(poses(translation=np.nan), STILL, 1.0), tandem.Error, "instance 1"),
    (lambda q: q.verdicts(poses(translation=np.nan), tolerance=0.1), tandem.Error, "instance 1"),
    (lambda q: q.keep_fixed(poses(translation=np.nan), [1, 1]), tandem.Error, "instance 1"),
    # Pairs.
    (lambda q: q.contacts(ROWS, pairs=[[0, 2]]), tandem.Error, "pair 0"),
    (lambda q: q.distances(ROWS, pairs=[[0, 1], [0, 9]]), tandem.Error, "pair 1"),
    (lambda q: q.contacts(ROWS, pairs=[[0, 1], [-1, 0]]), ValueError, "pairs: row 1"),
    (lambda q: q.contacts(ROWS, pairs=[0, 1]), ValueError, r"pairs has shape \(2,\)"),
    (lambda q: q.contacts(ROWS, pairs=[[0, 1, 2]]), ValueError, r"pairs has shape \(1, 3\)"),
    (lambda q: q.contacts(ROWS, pairs=[[0.5, 1.0]]), TypeError, "pairs has float64"),
    (lambda q: q.contacts(ROWS, pairs=np.zeros((1, 1), tandem.PAIR)), ValueError, "pairs has shape"),
    (lambda q: q.contacts(ROWS, pairs="01"), TypeError, "pairs has"),
    # Options.
    (lambda q: q.contacts(ROWS, mode="exactly"), ValueError, "mode is 'exactly' where one of 'exact', 'fast', 'boxes'"),
    (lambda q: q.contacts(ROWS, mode=0), ValueError, "mode is 0"),
    (lambda q: q.contacts(ROWS, within="far"), TypeError, "within is str"),
    (lambda q: q.contacts(ROWS, within=10**400), ValueError, "within is 1000"),
    (lambda q: q.contacts(ROWS, threads=0), ValueError, "threads is 0 where 1 to 1024"),
    (lambda q: q.contacts(ROWS, threads=2000), ValueError, "threads is 2000"),
    (lambda q: q.contacts(ROWS, threads=1.5), TypeError, "threads is float"),
    (lambda q: q.contacts(ROWS, filter=[1, 1]), TypeError, "filter is list"),
    (lambda q: q.contacts(ROWS, filter=tandem.Filter(motion=[0, 1, 0])), tandem.Error, "filter"),
    (lambda q: q.contacts(ROWS, filter=tandem.Filter(motion=[0, 9])), tandem.Error, "instance 1"),
    (lambda q: q.contacts(ROWS, filter=tandem.Filter(excluded=[[0, 7]])), tandem.Error, "instance"),
    (lambda q: tandem.Filter(motion=[0, 256]), ValueError, "motion: row 1"),
    (lambda q: tandem.Filter(motion=[[0, 1]]), ValueError, "motion has shape"),
    (lambda q: tandem.Filter(motion=[0], group=[1, 2]), ValueError, "group has shape"),
    (lambda q: tandem.Filter(excluded=[[0, -7]]), ValueError, "excluded: row 0"),
    (lambda q: q.manifolds(), tandem.Error, "did not find the contacts"),
    (lambda q: q.contained(), tandem.Error, "did not find the contacts"),
    (lambda q: q.manifolds(most_points=0), ValueError, "most_points is 0"),
    (lambda q: q.manifolds(most_points=8), ValueError, "most_points is 8"),
    (lambda q: q.distances(ROWS, reach=[1]), TypeError, "reach is list"),
    (lambda q: q.distances(ROWS, former=np.zeros(1)), TypeError, "former is an array of float64 .*FORMER"),
    (lambda q: q.impacts(ROWS, STILL[:1], 1.0), ValueError, r"motion has shape \(1,\) where \(2,\)"),
    (lambda q: q.impacts(ROWS, np.zeros((2, 9)), 1.0), TypeError, "motion is an array of float64 .*MOTION"),
    (lambda q: q.impacts(ROWS, STILL, None), TypeError, "duration is NoneType"),
    (lambda q: q.keep_fixed(ROWS, [1]), ValueError, "motion has shape"),
    (lambda q: q.keep_fixed(ROWS, [0, 5]), tandem.Error, "instance 1"),
    (lambda q: q.keep_fixed(None, [0, 1]), TypeError, "instances is missing"),
    # Queries and assets.
    (lambda q: tandem.Query(BOX), TypeError, "assets is one asset"),
    (lambda q: tandem.Query([BOX, None]), TypeError, "assets: entry 1 is NoneType"),
    (lambda q: tandem.Query(3), TypeError, ""),
    (lambda q: tandem.Query([]).contacts(ROWS), tandem.Error, "instance 0"),
    (lambda q: BOX.levels_from(-1), ValueError, "first is -1"),
    (lambda q: BOX.levels_from(2**40), ValueError, "first is"),
    (lambda q: BOX.triangles(1), tandem.Error, "no such level"),
    (lambda q: BOX.triangles("0"), TypeError, "level is str"),
    (lambda q: BOX.faces(-1), ValueError, "level is -1"),
    (lambda q: BOX.coarsest_level("x"), TypeError, "tolerance is str"),
    (lambda q: memoryview(tandem._tandem.Asset.__new__(tandem._tandem.Asset)), BufferError, "the asset was never made"),
    (lambda q: tandem.Asset.load(5), TypeError, "5|int"),
    (lambda q: tandem.Asset.load("x", access="mmap"), ValueError, "access is 'mmap'"),
    (lambda q: tandem.Asset.from_bytes("text"), TypeError, "bytes-like"),
    (lambda q: tandem.Asset.from_bytes(b"", check="none"), ValueError, "check is 'none'"),
    (lambda q: tandem.Asset.from_bytes(b""), tandem.Error, ""),
    (lambda q: tandem.Asset.from_bytes(b"\0" * 4096), tandem.Error, ""),
    (lambda q: tandem.Asset.from_bytes(memoryview(bytes(8192))[::2]), BufferError, ""),
    # Meshes.
    (lambda q: tandem.build(BOX_VERTICES.ravel(), BOX_FACES), ValueError, r"vertices has shape \(24,\)"),
    (lambda q: tandem.build(BOX_VERTICES[:, :2], BOX_FACES), ValueError, "vertices has shape"),
    (lambda q: tandem.build([["a", "b", "c"]], BOX_FACES), TypeError, "vertices has <U1"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES.astype(float)), TypeError, "faces has float64"),
    (lambda q: tandem.build(BOX_VERTICES, -BOX_FACES), ValueError, "faces: row 0"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES.ravel()), ValueError, r"faces has shape \(36,\)"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES + 8), tandem.Error, "none of the triangles"),
    (lambda q: tandem.build(BOX_VERTICES * np.nan, BOX_FACES), tandem.Error, "none of the triangles"),
    (lambda q: tandem.build([], []), tandem.Error, "none of the triangles"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, effort="max"), ValueError, "effort is 'max'"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, threads=-1), ValueError, "threads is -1"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, imaginary_share=np.nan), ValueError, "imaginary_share is nan"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, imaginary_share="x"), TypeError, "imaginary_share is str"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[1]), ValueError, r"face_ids has shape \(1,\) where \(12,\)"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[2**32 - 1] * 12), ValueError, "face_ids: row 0"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, face_ids=[0] * 11 + [2**32 - 2]), ValueError, "face_ids: row 11"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", 12), ("b", "", 2**32 - 13)]), ValueError, "parts have 2.32 - 1 faces"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=["ab"]), TypeError, "parts: row 0"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", 12), ("b", 5, 1)]), TypeError, "parts: row 1: path is int"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a\0", "", 12)]), ValueError, "parts: row 0: name has a zero"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("\ud800", "", 12)]), ValueError, "parts: row 0: name is no UTF-8"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, parts=[("a", "", -1)]), ValueError, "parts: row 0: number of faces is -1"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, provenance=5), TypeError, "provenance is int"),
    (lambda q: tandem.build(BOX_VERTICES, BOX_FACES, progress=5), TypeError, "progress is int"),
]
# Numbers of calls, each with what is too large for it.
AMOUNTS = [
    ("within", np.inf, lambda q, value: q.contacts(ROWS, within=value)),
    ("within", 1e301, lambda q, value: q.pairs(ROWS, within=value)),
    ("reach", None, lambda q, value: q.distances(ROWS, reach=value)),
    ("absolute_tolerance", None, lambda q, value: q.distances(ROWS, absolute_tolerance=value)),
    ("relative_tolerance", None, lambda q, value: q.distances(ROWS, relative_tolerance=value)),
    ("duration", np.inf, lambda q, value: q.impacts(ROWS, STILL, value)),
    ("tolerance", np.inf, lambda q, value: q.impacts(ROWS, STILL, 1.0, tolerance=value)),
    ("tolerance", 1e301, lambda q, value: q.verdicts(ROWS, tolerance=value)),
]
for name, too_large, ask in AMOUNTS:
    CASES += [(lambda q, ask=ask, value=value: ask(q, value), ValueError, f"^{name} is {re.escape(str(value))} where 0 to")
              for value in (np.nan, -1.0, -np.inf, too_large) if value is not None]


@pytest.mark.parametrize("number", range(len(CASES)))
def test_misuse(number):
    call, kind, words = CASES[number]
    query = tandem.Query([BOX])
    with pytest.raises(kind) as caught:
        call(query)
    assert type(caught.value) is kind and re.search(words, str(caught.value)), str(caught.value)
    # The query works as ever.
    assert len(query.contacts(ROWS).contacts) == 18


def test_the_largest_amounts_are_taken():
    query = tandem.Query([BOX])
    count = len(ROWS) * (len(ROWS) - 1) // 2
    assert len(query.pairs(ROWS, within=1e300)) == len(query.verdicts(ROWS, tolerance=1e300).verdicts) == count
    assert len(query.distances(ROWS, reach=np.inf, absolute_tolerance=np.inf).distances) == count
    query.impacts(ROWS, STILL, np.finfo(float).max, tolerance=np.finfo(float).max)


def test_an_error_leaves_no_contacts_to_make_manifolds_of():
    query = tandem.Query([BOX])
    query.contacts(ROWS)
    with pytest.raises(tandem.Error):
        query.contacts(poses(translation=np.nan))
    with pytest.raises(tandem.Error) as caught:
        query.manifolds()
    assert caught.value.name == "ContactsMissing"


def test_manifolds_name_the_asset_without_topology():
    query = tandem.Query([BOX, tandem.build(BOX_VERTICES, BOX_FACES, topology=False)])
    query.contacts(ROWS)
    with pytest.raises(tandem.Error) as caught:
        query.manifolds()
    assert (caught.value.name, caught.value.subject, caught.value.where) == ("NoTopology", "asset", 1)
