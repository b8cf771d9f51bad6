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
def query(box):
    return tandem.Query([box])


def test_finds_contacts_of_the_bodies_that_meet(query):
    pairs, contacts, counters = query.contacts(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [3, 0, 0]])
    assert pairs.tolist() == [(0, 1)]
    assert len(contacts) == counters.contacts > 0 and set(contacts["pair"]) == {0}
    assert contacts.dtype == tandem.CONTACT and contacts["face_a"].max() < 12


def test_takes_poses_in_every_form(query):
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    rows = np.zeros(2, tandem.INSTANCE)
    rows["rotation"] = [np.eye(3), turned]
    rows["translation"][1] = [0.5, 0.25, 0.125]
    transforms = np.tile(np.eye(4), (2, 1, 1))
    transforms[:, :3, :3] = rows["rotation"]
    transforms[:, :3, 3] = rows["translation"]
    expected = query.contacts(rows).contacts.tolist()
    assert expected
    others = [
        query.contacts(tandem.instances(0, rows["rotation"], rows["translation"])),
        query.contacts(asset=[0, 0], rotation=[np.eye(3), turned], translation=rows["translation"].tolist()),
        query.contacts(rotation=rows["rotation"].astype("f4"), translation=rows["translation"].astype("f4")),
        query.contacts(transform=transforms),
        query.contacts(transform=np.asfortranarray(transforms)),
        query.contacts(np.concatenate([rows, rows])[::-1][1:3]),
        query.contacts(rows, pairs=[[0, 1]]),
        query.contacts(rows, pairs=np.array([(0, 1)], tandem.PAIR)),
        query.contacts(rows, threads=3)]
    for other in others:
        assert other.contacts.tolist() == expected


def test_one_argument_is_for_all_rows():
    made = tandem.instances(asset=[0, 1, 2], rotation=np.diag([1.0, -1, -1]), translation=[1, 2, 3])
    assert made["asset"].tolist() == [0, 1, 2] and (made["rotation"] == np.diag([1.0, -1, -1])).all() and (made["translation"] == [1, 2, 3]).all()
    assert len(tandem.instances()) == 1 and len(tandem.instances([])) == 0


def test_empty_scenes_have_no_contacts(query):
    for found in (query.contacts(np.zeros(0, tandem.INSTANCE)), query.contacts(asset=[]), query.contacts(translation=np.zeros((0, 3))),
                  query.contacts(translation=[[0, 0, 0], [0, 0, 0]], pairs=[])):
        assert len(found.pairs) == len(found.contacts) == 0 and found.pairs.dtype == tandem.PAIR


def test_first_contacts_self_pairs_and_clearance(query):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
    assert len(query.contacts(rows, first_contact_only=True).contacts) == 1
    assert query.contacts(rows, self_pairs=True).pairs.tolist() == [(0, 0), (0, 1), (1, 1)]
    apart = tandem.instances(translation=[[0, 0, 0], [1.25, 0, 0]])
    assert len(query.contacts(apart, within=0.2499).contacts) == 0
    assert len(query.contacts(apart, within=0.25).contacts) > 0
    assert len(query.contacts(rows, mode="boxes").contacts) >= len(query.contacts(rows).contacts)
    assert query.pairs(rows).tolist() == [(0, 1)]


def test_filters_pairs(query):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [0.25, 0.25, 0.25]])
    assert query.pairs(rows).tolist() == [(0, 1), (0, 2), (1, 2)]
    assert query.pairs(rows, filter=tandem.Filter(motion=[tandem.FIXED, tandem.FIXED, tandem.MOVING])).tolist() == [(0, 2), (1, 2)]
    assert query.pairs(rows, filter=tandem.Filter(group=[1, 2, 3], mask=[2, 1, 1])).tolist() == [(0, 1), (0, 2)]
    assert query.contacts(rows, filter=tandem.Filter(excluded=[[1, 0], [2, 1]])).pairs.tolist() == [(0, 2)]
    for group in ([1, 2], []):
        with pytest.raises(tandem.Error) as caught:
            query.contacts(rows, filter=tandem.Filter(group=group))
        assert caught.value.name == "FilterMismatch"
    with pytest.raises(ValueError, match="mask"):
        tandem.Filter(group=[1, 2], mask=[1])


def test_fixed_bodies_are_kept(query):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0.5, 0.5], [0.25, 0.25, 0.25]])
    motion = [tandem.FIXED, tandem.FIXED, tandem.MOVING]
    expected = query.contacts(rows, filter=tandem.Filter(motion)).contacts.tolist()
    query.keep_fixed(rows, motion)
    assert query.contacts(rows, filter=tandem.Filter(motion)).contacts.tolist() == expected != []
    with pytest.raises(tandem.Error) as caught:
        query.contacts(rows[:2])
    assert caught.value.name == "KeptMismatch"
    with pytest.raises(ValueError, match="motion has shape"):
        query.keep_fixed(rows, motion[:2])


def test_manifolds_remember_the_instances_and_the_points_before(query):
    rows = tandem.instances(translation=[[0, 0, 0], [0.2, 0.1, 0.75]])
    query.contacts(rows)
    rows["translation"] += 100  # of no consequence for the manifolds of what was asked
    first = query.manifolds()
    assert len(first.manifolds) == 1 and np.allclose(first.manifolds["normal"], [[0, 0, 1]])
    assert first.manifolds["depth"][0] == 0.25 and len(first.points) == first.manifolds["point_count"][0] == 4
    assert (first.points["previous"] == tandem.NO_INDEX).all()
    query.contacts(translation=[[0, 0, 0], [0.2, 0.1, 0.75]])
    again = query.manifolds()
    assert sorted(again.points["previous"]) == [0, 1, 2, 3] and set(again.points["id"]) == set(first.points["id"])
    assert len(query.manifolds(most_points=1).points) == 1
    query.pairs(translation=[[0, 0, 0], [0.2, 0.1, 0.75]])
    with pytest.raises(tandem.Error) as caught:
        query.manifolds()
    assert caught.value.name == "ContactsMissing"


def test_bodies_within_others(box):
    small = tandem.build(BOX_VERTICES / 4 + 0.25, BOX_FACES)
    query = tandem.Query([box, small])
    assert len(query.contacts(asset=[0, 1]).contacts) == 0
    (pair, inner, component, flags), = query.contained().contained.tolist()
    assert (pair, inner, component, flags) == (0, 1, 0, tandem.INSIDE)


def test_distances(query):
    rows = tandem.instances(translation=[[0, 0, 0], [1.5, 0, 0], [9, 0, 0]])
    found = query.distances(rows)
    assert found.pairs.tolist() == [(0, 1), (0, 2), (1, 2)]
    assert (found.distances["lower"] <= [0.5, 8, 6.5]).all() and (found.distances["upper"] >= [0.5, 8, 6.5]).all()
    assert np.allclose(found.distances["upper"], [0.5, 8, 6.5])
    assert query.distances(rows, reach=1.0).pairs.tolist() == [(0, 1)]
    former = np.zeros(1, tandem.FORMER)
    former["b"], former["triangle_a"], former["triangle_b"] = 1, found.distances["triangle_a"][0], found.distances["triangle_b"][0]
    assert np.allclose(query.distances(rows, former=former).distances["upper"], [0.5, 8, 6.5])


def test_impacts(query):
    rows = tandem.instances(translation=[[0, 0, 0], [1.5, 0, 0]])
    motion = np.zeros(2, tandem.MOTION)
    motion["velocity"][1] = [-1, 0, 0]
    found = query.impacts(rows, motion, 2.0)
    assert found.pairs.tolist() == [(0, 1)] and found.impacts["status"].tolist() == [tandem.IMPACT_IN_STEP]
    assert 0.49 < found.impacts["t_safe"][0] <= 0.5
    assert query.impacts(rows, motion, 0.25).pairs.tolist() == []
    assert query.impacts(None, motion, 0.25, pairs=[[0, 1]], translation=rows["translation"]).impacts["status"].tolist() == [tandem.NO_IMPACT]


def test_verdicts(query):
    rows = tandem.instances(translation=[[0, 0, 0], [0.5, 0, 0], [9, 0, 0]])
    found = query.verdicts(rows, tolerance=0.0, pairs=[[0, 1], [0, 2]])
    assert found.verdicts["verdict"].tolist() == [tandem.TOUCH, tandem.APART]


def test_assets_may_go_before_queries_and_queries_before_arrays(query):
    own = tandem.Query([tandem.build(BOX_VERTICES, BOX_FACES)])
    gc.collect()
    found = own.contacts(translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
    del own
    gc.collect()
    assert found.contacts.tolist() == query.contacts(translation=[[0, 0, 0], [0.5, 0.5, 0.5]]).contacts.tolist()
    found.contacts["pair"] = 7  # arrays are the caller's
