"""Contacts, manifolds, distances, impacts of small scenes whose answers are known."""
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


def test_empty_scenes_have_no_contacts(scene):
    found = [scene.contacts()]
    found += [scene.place(**bodies).contacts() for bodies in ({"instances": np.zeros(0, tandem.INSTANCE)}, {"asset": []}, {"translation": np.zeros((0, 3))})]
    found.append(scene.place(translation=[[0, 0, 0], [0, 0, 0]]).contacts(pairs=[]))
    for one in found:
        assert len(one.pairs) == len(one.contacts) == 0 and one.pairs.dtype == tandem.PAIR


def test_first_contacts_self_pairs_and_clearance(scene):
    scene.place(translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
    assert len(scene.contacts(first_contact_only=True).contacts) == 1
    assert scene.contacts(self_pairs=True).pairs.tolist() == scene.pairs(self_pairs=True).tolist() == [(0, 0), (0, 1), (1, 1)]
    assert len(scene.contacts(mode="boxes").contacts) >= len(scene.contacts().contacts)
    assert scene.pairs().tolist() == [(0, 1)]
    scene.place(translation=[[0, 0, 0], [1.25, 0, 0]])
    assert len(scene.contacts(within=0.2499).contacts) == 0
    assert len(scene.contacts(within=0.25).contacts) > 0
    assert scene.pairs().tolist() == [] and scene.pairs(reach=0.3).tolist() == [(0, 1)]


def test_filters_pairs(scene):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [0.25, 0.25, 0.25]])
    assert scene.place(rows).pairs().tolist() == [(0, 1), (0, 2), (1, 2)]
    assert scene.place(rows, filter=tandem.Filter(motion=[tandem.FIXED, tandem.FIXED, tandem.MOVING])).pairs().tolist() == [(0, 2), (1, 2)]
    assert scene.place(rows, filter=tandem.Filter(group=[1, 2, 3], mask=[2, 1, 1])).pairs().tolist() == [(0, 1), (0, 2)]
    assert scene.place(rows, filter=tandem.Filter(excluded=[[1, 0], [2, 1]])).contacts().pairs.tolist() == [(0, 2)]
    for group in ([1, 2], []):
        with pytest.raises(tandem.Error) as caught:
            scene.place(rows, filter=tandem.Filter(group=group))
        assert caught.value.name == "FilterMismatch"
    with pytest.raises(ValueError, match="mask"):
        tandem.Filter(group=[1, 2], mask=[1])


def test_fixed_bodies_are_kept(scene):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [0.25, 0.25, 0.25]])
    filter = tandem.Filter([tandem.FIXED, tandem.FIXED, tandem.MOVING])
    expected = scene.place(rows, filter=filter).contacts().contacts.tolist()
    scene.move(2, translation=[9, 9, 9])
    assert len(scene.contacts().contacts) == 0
    scene.move(2, rows[2:])
    assert scene.contacts().contacts.tolist() == expected != []
    scene.set_motion(0, tandem.MOVING)
    assert scene.pairs().tolist() == [(0, 1), (0, 2), (1, 2)]
    with pytest.raises(tandem.Error) as caught:
        scene.place(rows[:2], filter=filter)
    assert caught.value.name == "FilterMismatch"


def test_bodies_come_go_and_move(box):
    """What a scene finds after changes is what a new one finds."""
    random = np.random.default_rng(4)
    scene, standing = tandem.Scene([box, tandem.build(BOX_VERTICES * 0.7, BOX_FACES)]), {}
    for _ in range(60):
        action, at = random.integers(3), random.uniform(0, 2.5, 3)
        if action == 0 or not standing:
            asset = int(random.integers(2))
            body = scene.add(asset, translation=at)
            assert body == next(number for number in range(len(standing) + 1) if number not in standing)
            standing[body] = asset, at
        elif action == 1:
            body = int(random.choice(list(standing)))
            scene.move(body, translation=at)
            standing[body] = standing[body][0], at
        else:
            body = int(random.choice(list(standing)))
            scene.remove(body)
            del standing[body]
        numbers = np.array(sorted(standing), np.uint32)
        fresh = tandem.Scene([box, tandem.build(BOX_VERTICES * 0.7, BOX_FACES)])
        if standing:
            fresh.place(asset=[standing[n][0] for n in numbers], translation=np.array([standing[n][1] for n in numbers]))
        found, expected = scene.contacts(), fresh.contacts()
        assert found.contacts.tobytes() == expected.contacts.tobytes()
        assert found.pairs.tolist() == [(numbers[a], numbers[b]) for a, b in expected.pairs.tolist()]
        shown = scene.instances
        assert [n for n, row in enumerate(shown) if row["asset"] != tandem.NO_INDEX] == numbers.tolist()


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


def test_bodies_within_others(box):
    small = tandem.build(BOX_VERTICES / 4 + 0.25, BOX_FACES)
    scene = tandem.Scene([box, small], asset=[0, 1])
    for contacts in (None, scene.contacts().contacts):
        (pair, inner, component, flags), = scene.contained().contained.tolist()
        assert (pair, inner, component, flags) == (0, 1, 0, tandem.INSIDE)
        assert contacts is None or len(contacts) == 0


def test_distances(scene):
    scene.place(translation=[[0, 0, 0], [1.5, 0, 0], [9, 0, 0]])
    found = scene.distances()
    assert found.pairs.tolist() == [(0, 1), (0, 2), (1, 2)]
    assert (found.distances["lower"] <= [0.5, 8, 6.5]).all() and (found.distances["upper"] >= [0.5, 8, 6.5]).all()
    assert np.allclose(found.distances["upper"], [0.5, 8, 6.5])
    assert scene.distances(reach=1.0).pairs.tolist() == [(0, 1)]
    former = np.zeros(1, tandem.FORMER)
    former["b"], former["triangle_a"], former["triangle_b"] = 1, found.distances["triangle_a"][0], found.distances["triangle_b"][0]
    assert np.allclose(scene.distances(former=former).distances["upper"], [0.5, 8, 6.5])


def test_impacts(scene):
    scene.place(translation=[[0, 0, 0], [1.5, 0, 0]])
    motion = np.zeros(2, tandem.MOTION)
    motion["velocity"][1] = [-1, 0, 0]
    found = scene.impacts(motion, 2.0)
    assert found.pairs.tolist() == [(0, 1)] and found.impacts["status"].tolist() == [tandem.IMPACT_IN_STEP]
    assert 0.49 < found.impacts["t_safe"][0] <= 0.5
    assert scene.impacts(motion, 0.25).pairs.tolist() == []
    assert scene.impacts(motion, 0.25, pairs=[[0, 1]]).impacts["status"].tolist() == [tandem.NO_IMPACT]


def test_verdicts(scene):
    scene.place(translation=[[0, 0, 0], [0.5, 0, 0], [9, 0, 0]])
    found = scene.verdicts(tolerance=0.0, pairs=[[0, 1], [0, 2]])
    assert found.verdicts["verdict"].tolist() == [tandem.TOUCH, tandem.APART]


def test_assets_may_go_before_scenes_and_scenes_before_arrays(scene):
    own = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES)], translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
    gc.collect()
    found = own.contacts()
    del own
    gc.collect()
    assert found.contacts.tolist() == scene.place(translation=[[0, 0, 0], [0.5, 0.5, 0.5]]).contacts().contacts.tolist()
    found.contacts["pair"] = 7  # arrays are the caller's
