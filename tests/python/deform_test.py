"""Deforming assets: how positions are taken, what is refused, and that answers are those of assets built of the positions."""
import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES


@pytest.fixture
def box():
    return tandem.build(BOX_VERTICES, BOX_FACES)


@pytest.fixture
def scene(box):
    return tandem.Scene([box, box], asset=[0, 1], translation=[[0, 0, 0], [0, 0, 1.5]])


def rows(found):
    return sorted(map(tuple, found.contacts[["face_a", "face_b"]].tolist()))


@pytest.mark.parametrize("kind", [np.float32, np.float64, list])
def test_answers_are_those_of_assets_built_of_the_positions(scene, box, kind):
    numbers = np.random.default_rng(1)
    most = 0
    for _ in range(50):
        bent = (BOX_VERTICES + numbers.normal(scale=0.4, size=BOX_VERTICES.shape)).astype(np.float32)
        scene.deform(1, bent.tolist() if kind is list else bent.astype(kind))
        anew = tandem.Scene([box, tandem.build(bent, BOX_FACES)], scene.instances)
        assert rows(scene.contacts()) == rows(anew.contacts())
        x, y = scene.distances().distances, anew.distances().distances
        assert (x["lower"] <= y["upper"]).all() and (y["lower"] <= x["upper"]).all()
        most = max(most, len(scene.contacts().contacts))
    assert most > 0


def test_points_rays_and_configurations_see_the_positions(scene, box):
    numbers = np.random.default_rng(2)
    points, along = numbers.normal(size=(300, 3)) * 2, numbers.normal(size=(300, 3))
    hits = 0
    for _ in range(20):
        bent = (BOX_VERTICES + numbers.normal(scale=0.2, size=BOX_VERTICES.shape)).astype(np.float32)
        scene.deform(1, bent)
        anew = tandem.Scene([box, tandem.build(bent, BOX_FACES)], scene.instances)
        x, y = scene.closest(points, sides=True), anew.closest(points, sides=True)
        assert (x["lower"] <= y["upper"]).all() and (y["lower"] <= x["upper"]).all()
        assert np.array_equal(x["winding"], y["winding"]) and np.array_equal(x["within"], y["within"])
        x, y = scene.rays(points, along), anew.rays(points, along)
        assert np.array_equal(x[["body", "face"]], y[["body", "face"]])
        assert np.allclose(x["t"], y["t"], rtol=1e-9)
        hits += np.isfinite(x["t"]).sum()
        places = numbers.normal(scale=1.5, size=(40, 1, 3))
        assert np.array_equal(scene.configurations([1], translation=places).touching, anew.configurations([1], translation=places).touching)
    assert hits > 200


def test_float64_positions_are_decided_as_they_are(scene):
    assert len(scene.contacts().contacts) == 0
    top = BOX_VERTICES[:, 2].max()
    touching, beside = BOX_VERTICES.astype(float), BOX_VERTICES.astype(float)
    touching[touching[:, 2] == top, 2] = 1.5 + BOX_VERTICES[:, 2].min()
    beside[beside[:, 2] == top, 2] = np.nextafter(1.5 + BOX_VERTICES[:, 2].min(), 0)
    scene.deform(0, touching)
    assert len(scene.contacts().contacts) > 0
    scene.deform(0, beside)
    assert len(scene.contacts().contacts) == 0


def test_an_asset_says_how_many_positions_it_wants(box, scene):
    assert box.source_vertices == len(BOX_VERTICES)
    with pytest.raises(tandem.Error, match="not as many positions"):
        scene.deform(0, BOX_VERTICES[:-1])
    with pytest.raises(tandem.Error, match="asset"):
        scene.deform(2, BOX_VERTICES)
    for wrong in (BOX_VERTICES[:, :2], BOX_VERTICES.ravel(), "abc", None):
        with pytest.raises((ValueError, TypeError)):
            scene.deform(0, wrong)
    broken = BOX_VERTICES.astype(np.float32)
    broken[5, 1] = np.nan
    for kind in (np.float32, np.float64):
        with pytest.raises(tandem.Error, match="vertex 5: .*positions of asset 1") as raised:
            scene.deform(1, broken.astype(kind))
        assert (raised.value.subject, raised.value.where) == ("vertex", 5)
    assert len(scene.contacts().contacts) == 0


def test_what_is_not_offered_is_named(scene):
    scene.deform(0, BOX_VERTICES)
    with pytest.raises(tandem.Error, match="not offered for deformed"):
        scene.verdicts(tolerance=0.1)
    scene.contacts()
    scene.manifolds()
    scene.deform(0, BOX_VERTICES / 3)
    scene.contacts()
    with pytest.raises(tandem.Error, match="no float32 numbers"):
        scene.manifolds()


def test_looseness_tells_a_tree_that_no_longer_fits():
    numbers = np.random.default_rng(2)
    corners = numbers.random((500, 1, 3)) + 0.01 * numbers.random((500, 3, 3))
    faces = np.arange(1500).reshape(500, 3)
    scene = tandem.Scene([tandem.build(corners.reshape(-1, 3), faces)], translation=[[0, 0, 0]])
    assert scene.looseness(0) == 1
    scene.deform(0, corners.reshape(-1, 3).astype(np.float32))
    assert scene.looseness(0) == pytest.approx(1, abs=1e-4)
    scene.deform(0, (corners + numbers.random((500, 1, 3))).reshape(-1, 3).astype(np.float32))
    assert scene.looseness(0) > 2


def test_a_tree_for_poses_fits_them_better():
    numbers = np.random.default_rng(3)
    corners = 0.01 * numbers.random((500, 3, 3))
    places = numbers.random((2, 500, 1, 3))
    at_rest, pose = (corners + places).reshape(2, 1500, 3).astype(np.float32)
    faces = np.arange(1500).reshape(500, 3)
    assert tandem.build(at_rest, faces, poses=[]).hash == tandem.build(at_rest, faces).hash
    pairs = []
    for poses in (None, [pose], pose):
        scene = tandem.Scene([tandem.build(at_rest, faces, poses=poses)] * 2, asset=[0, 1], translation=[[0, 0, 0], [0.01, 0, 0]])
        for asset in range(2):
            scene.deform(asset, pose)
        pairs.append(scene.contacts().counters.block_pairs)
    assert pairs[1] == pairs[2] < 0.8 * pairs[0]


def test_poses_that_do_not_fit_are_refused():
    broken = np.stack([BOX_VERTICES.astype(float)] * 2)
    for bad in (np.nan, np.inf, 3.5e38):
        broken[1, 5, 2] = bad
        with pytest.raises(ValueError, match="vertex 5 of pose 1"):
            tandem.build(BOX_VERTICES, BOX_FACES, poses=broken)
    with pytest.raises(ValueError, match="poses has shape"):
        tandem.build(BOX_VERTICES, BOX_FACES, poses=[BOX_VERTICES[:-1]])
    with pytest.raises(ValueError, match="without levels"):
        tandem.build(BOX_VERTICES, BOX_FACES, poses=[BOX_VERTICES], levels="auto")
