"""How the package takes bodies and gives arrays. What the answers are is in contract_test.py."""
import gc

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES


@pytest.fixture(scope="module")
def box():
    return tandem.build(BOX_VERTICES, BOX_FACES)


@pytest.fixture
def scene(box):
    return tandem.Scene([box])


def test_finds_contacts_of_the_bodies_that_meet(scene):
    pairs, contacts, counters = scene.place(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [3, 0, 0]]).contacts()
    assert pairs.tolist() == [(0, 1)]
    assert len(contacts) == counters.contacts > 0 and set(contacts["pair"]) == {0}
    assert contacts.dtype == tandem.CONTACT and contacts["face_a"].max() < 12


def test_bodies_that_touch_are_those_with_a_contact(box, scene):
    # A frame, and a body in its hole: their boxes meet, they do not.
    bars = [BOX_VERTICES * scale + shift for scale, shift in (([5, 1, 1], [0, 0, 0]), ([5, 1, 1], [0, 4, 0]), ([1, 3, 1], [0, 1, 0]), ([1, 3, 1], [4, 1, 0]))]
    frame = tandem.build(np.concatenate(bars), np.concatenate([BOX_FACES + 8 * bar for bar in range(4)]))
    places = [[0, 0, 0], [2, 2, 0], [2.5, 2.5, 0.5], [3.5, 2, 0]]
    found = tandem.Scene([frame, box], asset=[0, 1, 1, 1], translation=places).contacts()
    assert found.pairs.tolist() == [(0, 1), (0, 2), (0, 3), (1, 2), (2, 3)]
    assert found.touching.tolist() == [(0, 3), (1, 2), (2, 3)] and found.touching.dtype == tandem.PAIR
    assert tuple(found) == (found.pairs, found.contacts, found.counters) and found._fields == ("pairs", "contacts", "counters")
    apart = scene.place(translation=[[0, 0, 0], [3, 0, 0]]).contacts()
    assert len(apart.pairs) == len(apart.touching) == 0 and apart.touching.dtype == tandem.PAIR
    asked = scene.contacts(pairs=[[1, 0], [0, 1]])
    assert len(asked.pairs) == 2 and len(asked.touching) == 0


def test_takes_rotations_of_scipy(box, scene):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    turns = rotation.from_euler("z", [0, 30, 60], degrees=True)
    expected = tandem.instances(rotation=turns.as_matrix(), translation=[1, 0, 0]).tobytes()
    assert tandem.instances(rotation=turns, translation=[1, 0, 0]).tobytes() == expected
    assert tandem.Scene([box], rotation=turns, translation=[1, 0, 0]).instances.tobytes() == expected
    assert scene.place(rotation=turns, translation=[1, 0, 0]).instances.tobytes() == expected
    scene.move(2, rotation=turns[1], translation=[1, 0, 0])
    assert scene.add(rotation=turns[2], translation=[1, 0, 0]) == 3
    assert scene.instances[[0, 1, 3]].tobytes() == expected and scene.instances[2] == scene.instances[1]


def test_takes_quaternions_in_both_orders(box):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    turns = rotation.random(20, random_state=7)
    xyzw = turns.as_quat()
    for given in (xyzw, -xyzw, 3e-200 * xyzw, 1e300 * xyzw):
        np.testing.assert_allclose(tandem.rotations(xyzw=given), turns.as_matrix(), atol=1e-15)
        np.testing.assert_array_equal(tandem.rotations(wxyz=given[:, [3, 0, 1, 2]]), tandem.rotations(xyzw=given))
    np.testing.assert_array_equal(tandem.rotations(xyzw=xyzw[3]), tandem.rotations(xyzw=xyzw)[3])
    assert tandem.rotations(xyzw=[]).shape == (0, 3, 3)
    assert len(tandem.Scene([box], rotation=tandem.rotations(xyzw=xyzw)).instances) == 20
    for bad in ([0, 0, 0, 0], [0, 0, 1, np.nan], [np.inf, 0, 0, 1]):
        with pytest.raises(ValueError, match="xyzw: it is no rotation"):
            tandem.rotations(xyzw=bad)
        with pytest.raises(ValueError, match="wxyz: row 1 is no rotation"):
            tandem.rotations(wxyz=[[1, 0, 0, 0], bad])
    for both in ({}, {"xyzw": xyzw, "wxyz": xyzw}):
        with pytest.raises(TypeError, match="as xyzw or as wxyz"):
            tandem.rotations(**both)
    with pytest.raises(ValueError, match=r"xyzw has shape \(3,\)"):
        tandem.rotations(xyzw=[0, 0, 1])
    with pytest.raises(ValueError, match=r"shape \(20, 4\) .* tandem.rotations makes these of quaternions"):
        tandem.instances(rotation=xyzw)


def test_takes_poses_in_every_form(box, scene):
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    rows = np.zeros(2, tandem.INSTANCE)
    rows["rotation"] = [np.eye(3), turned]
    rows["translation"][1] = [0.5, 0.25, 0.125]
    transforms = np.tile(np.eye(4), (2, 1, 1))
    transforms[:, :3, :3] = rows["rotation"]
    transforms[:, :3, 3] = rows["translation"]
    expected = scene.place(rows).contacts().contacts.tolist()
    assert expected and scene.instances.tobytes() == rows.tobytes()
    forms = [
        {"instances": tandem.instances(0, rows["rotation"], rows["translation"])},
        {"asset": [0, 0], "rotation": [np.eye(3), turned], "translation": rows["translation"].tolist()},
        {"rotation": rows["rotation"].astype("f4"), "translation": rows["translation"].astype("f4")},
        {"transform": transforms},
        {"transform": np.asfortranarray(transforms)},
        {"instances": np.concatenate([rows, rows])[::-1][1:3]}]
    for form in forms:
        assert scene.place(**form).contacts().contacts.tolist() == expected
        assert tandem.Scene([box], threads=3, **form).contacts().contacts.tolist() == expected
        scene.place(translation=np.zeros((2, 3)))
        form.pop("asset", None)
        scene.move([0, 1], **form)
        assert scene.contacts().contacts.tolist() == expected
    for pairs in ([[0, 1]], np.array([(0, 1)], tandem.PAIR)):
        assert scene.contacts(pairs=pairs).contacts.tolist() == expected
    scene.threads = 3
    assert scene.contacts().contacts.tolist() == expected and scene.threads == 3


def test_one_argument_is_for_all_rows():
    made = tandem.instances(asset=[0, 1, 2], rotation=np.diag([1.0, -1, -1]), translation=[1, 2, 3])
    assert made["asset"].tolist() == [0, 1, 2] and (made["rotation"] == np.diag([1.0, -1, -1])).all() and (made["translation"] == [1, 2, 3]).all()
    assert len(tandem.instances()) == 1 and len(tandem.instances([])) == 0


def test_manifolds_remember_the_contacts_and_the_points_before(scene):
    rows = tandem.instances(translation=[[0, 0, 0], [0.2, 0.1, 0.75]])
    scene.place(rows).contacts()
    rows["translation"] += 100  # of no consequence for the manifolds of what was asked
    first = scene.manifolds()
    assert len(first.manifolds) == 1 and np.allclose(first.manifolds["normal"], [[0, 0, 1]])
    assert first.manifolds["depth"][0] == 0.25 and len(first.points) == first.manifolds["point_count"][0] == 4
    assert (first.points["previous"] == tandem.NO_INDEX).all()
    for ask_contacts in (True, False):  # which manifolds() does where nobody has
        scene.place(translation=[[0, 0, 0], [0.2, 0.1, 0.75]])
        if ask_contacts:
            scene.contacts()
        again = scene.manifolds()
        assert sorted(again.points["previous"]) == [0, 1, 2, 3] and set(again.points["id"]) == set(first.points["id"])
    scene.move(1, translation=[0.2, 0.1, 9])
    assert len(scene.manifolds().manifolds) == 0
    scene.move(1, translation=[0.2, 0.1, 0.75])
    assert len(scene.manifolds(most_points=1).points) == 1
    scene.pairs()
    assert len(scene.manifolds().points) == 4
    scene.contacts(first_contact_only=True)
    with pytest.raises(tandem.Error) as caught:
        scene.contained()
    assert caught.value.name == "ContactsMissing"


def test_assets_may_go_before_scenes_and_scenes_before_arrays(scene):
    own = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES)], translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
    gc.collect()
    found = own.contacts()
    del own
    gc.collect()
    assert found.contacts.tolist() == scene.place(translation=[[0, 0, 0], [0.5, 0.5, 0.5]]).contacts().contacts.tolist()
    found.contacts["pair"] = 7  # arrays are the caller's


def test_configurations_take_poses_as_they_are():
    """Matrices, rotations with translations, and poses of both shapes, of float64 or not, say the same."""
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    scene = tandem.Scene([box], translation=[[0, 0, 0], [3, 0, 0], [5, 0, 0]])
    random = np.random.default_rng(8)
    rotation, translation = tandem.rotations(xyzw=random.normal(size=(400, 4))).reshape(200, 2, 3, 3), random.uniform(-2, 3, (200, 2, 3))
    pose = np.concatenate([rotation, translation[:, :, None]], axis=2)
    transform = np.tile(np.eye(4), (200, 2, 1, 1))
    transform[..., :3, :3], transform[..., :3, 3] = rotation, translation
    expected = scene.configurations([1, 2], rotation=rotation, translation=translation, pairs="all")
    assert 0 < expected.touching.sum() < 200
    for given in ({"pose": pose}, {"pose": pose.reshape(200, 2, 12)}, {"pose": np.asfortranarray(pose)}, {"transform": transform}, {"transform": transform.tolist()}):
        found = scene.configurations([1, 2], **given, pairs="all")
        assert np.array_equal(found.pairs, expected.pairs) and np.array_equal(found.touching, expected.touching)
    with pytest.raises(TypeError, match="pose stands instead"):
        scene.configurations([1, 2], pose=pose, translation=translation)
    with pytest.raises(ValueError, match="pose has shape"):
        scene.configurations([1, 2], pose=pose[..., :2])
    with pytest.raises(TypeError, match="pose has <U1"):
        scene.configurations([1], pose=np.full((1, 1, 4, 3), "a"))
    pose[7, 1, 0, 0] = np.nan
    with pytest.raises(tandem.Error, match="not finite") as caught:
        scene.configurations([1, 2], pose=pose)
    assert caught.value.where == 15
