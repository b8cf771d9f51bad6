"""tandem.trimesh.CollisionManager beside trimesh.collision.CollisionManager over python-fcl."""

import contextlib
import doctest
import io
import os
import pickle
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("fcl")
pytest.importorskip("scipy")

import tandem
import tandem._bodies
import tandem.trimesh
from tandem._bodies import meeting_points
from tandem._convex import Solid, overlap
from trimesh.transformations import random_rotation_matrix, rotation_matrix, scale_matrix, translation_matrix

MANAGERS = {"trimesh": trimesh.collision.CollisionManager, "tandem": tandem.trimesh.CollisionManager}
BOX = trimesh.creation.box()
RING = trimesh.creation.torus(1.0, 0.3)
BALL = trimesh.creation.icosphere(subdivisions=2)
LARGE = trimesh.creation.box((9, 9, 9))
TRIANGLE = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)


def at(*place):
    return translation_matrix(place)


def filled(manager, **objects):
    """A manager of objects, each a mesh or a mesh and its transform."""
    for name, thing in objects.items():
        manager.add_object(name, *(thing if isinstance(thing, tuple) else (thing,)))
    return manager


def outcome(call):
    """What a call returns, or the type and words of what it raises. Floats to 1e-5, since trimesh takes transforms as float32; of data the names."""
    try:
        return plain(call())
    except Exception as defect:
        return type(defect), str(defect)


def plain(value):
    if isinstance(value, tuple):
        return tuple(plain(part) for part in value)
    if isinstance(value, list):
        return sorted((sorted(map(str, part.names)) for part in value), key=str)
    if isinstance(value, trimesh.collision.DistanceData):
        return "distance", sorted(map(str, value.names)), plain(value.distance)
    if isinstance(value, float):
        return "float", float(f"{value:.5g}") + 0.0
    return type(value), value


def both_say(question):
    """Asks each of the managers, which must say the same; what they say."""
    answers = {name: outcome(lambda: question(manager)) for name, manager in MANAGERS.items()}
    assert answers["tandem"] == answers["trimesh"]
    return answers["tandem"]


RETURNS = [{}, {"return_names": True}, {"return_data": True}, {"return_names": True, "return_data": True}]
RETURNS_ONE = [{key.replace("names", "name"): value for key, value in returns.items()} for returns in RETURNS]


@pytest.mark.parametrize("returns", RETURNS)
@pytest.mark.parametrize("objects", [{}, {"a": BOX}, {"a": BOX, "b": (BOX, at(3, 0.2, 0.1))}, {"b": BOX, "a": (BOX, at(0.7, 0.2, 0.1))}])
def test_collisions_of_few_objects_return_the_same(objects, returns):
    both_say(lambda made: filled(made(), **objects).in_collision_internal(**returns))
    both_say(lambda made: filled(made(), **objects).in_collision_single(BOX, at(0.2, 0.1, 0), **returns))
    both_say(lambda made: filled(made(), **objects).in_collision_single(BOX, at(90, 0.1, 0), **returns))
    both_say(lambda made: filled(made(), **objects).in_collision_other(filled(made(), b=BOX), **returns))
    both_say(lambda made: filled(made(), **objects).in_collision_other(made(), **returns))


@pytest.mark.parametrize("returns", RETURNS)
@pytest.mark.parametrize("objects", [{}, {"a": BOX}, {"b": BOX, "a": (BOX, at(3, 0.2, 0.1))}, {"b": BOX, "a": (BOX, at(0.7, 0.2, 0.1))}])
def test_distances_of_few_objects_return_the_same(objects, returns):
    both_say(lambda made: filled(made(), **objects).min_distance_internal(**returns))
    both_say(lambda made: filled(made(), **objects).min_distance_internal("b", **returns))
    both_say(lambda made: filled(made(), **objects).min_distance_other(filled(made(), c=(BALL, at(5, 1, 0))), **returns))
    both_say(lambda made: filled(made(), **objects).min_distance_other(made(), **returns))


@pytest.mark.parametrize("returns", RETURNS_ONE)
def test_distances_of_a_mesh_return_the_same(returns):
    for objects in ({}, {"a": BOX}, {"a": BOX, "b": (RING, at(4, 0, 0))}):
        both_say(lambda made: filled(made(), **objects).min_distance_single(BALL, at(7, 0.3, 0.1), **returns))
        both_say(lambda made: filled(made(), **objects).min_distance_single(BALL, at(-5, 0.3, 0.1), **returns))


@pytest.mark.parametrize("wrong", [
    lambda manager: manager.remove_object("x"),
    lambda manager: manager.set_transform("x", np.eye(4)),
    lambda manager: manager.set_transform("a", np.eye(3)),
    lambda manager: manager.set_transform("a", np.eye(4).tolist()),
    lambda manager: manager.set_transform("a", None),
    lambda manager: manager.min_distance_internal("x"),
    lambda manager: manager.min_distance_internal(name="x", return_names=True),
    lambda manager: manager.add_object("b", BOX, np.eye(3)),
    lambda manager: manager.add_object("b", BOX, 7),
    lambda manager: manager.add_object("b", 5),
    lambda manager: manager.add_object("b", None),
    lambda manager: manager.add_object([], BOX),
    lambda manager: manager.add_object("b", trimesh.points.PointCloud([[0, 0, 0.0]])),
    lambda manager: manager.in_collision_single(BOX, np.eye(3)),
    lambda manager: manager.in_collision_single(BOX, np.eye(4).tolist()),
    lambda manager: manager.in_collision_single("box"),
    lambda manager: manager.min_distance_single(BOX, np.eye(4).tolist()),
    lambda manager: (manager.remove_object("a"), manager.remove_object("a")),
])
def test_what_is_wrong_raises_the_same(wrong):
    answer = both_say(lambda made: wrong(filled(made(), a=BOX)))
    assert issubclass(answer[0], Exception)


def test_names_that_have_no_order_are_refused_in_pairs():
    for made in MANAGERS.values():
        manager = filled(made(), a=BOX)
        manager.add_object(3, BOX)
        with pytest.raises(TypeError, match="not supported between instances of"):
            manager.in_collision_internal(return_names=True)
        assert manager.in_collision_single(BOX, return_names=True) == (True, {"a", 3})


@pytest.mark.parametrize("story", [
    lambda manager: [manager.remove_object("b"), manager.in_collision_internal(return_names=True)],
    lambda manager: [manager.set_transform("b", at(0.5, 0, 0)), manager.in_collision_internal(return_names=True)],
    lambda manager: [manager.set_transform("b", at(0.5, 0, 0)), manager.set_transform("b", at(5, 0, 0)), manager.in_collision_internal(return_names=True)],
    lambda manager: [manager.remove_object("a"), manager.add_object("a", RING, at(3, 0, 0)), manager.in_collision_internal(return_names=True)],
    lambda manager: [manager.add_object("c", BALL, at(3.9, 0, 0)), manager.in_collision_internal(return_names=True)],
    lambda manager: [manager.add_object(None, BALL, at(30, 0, 0)), manager.in_collision_single(BALL, at(30, 1, 0), return_names=True)],
    lambda manager: [manager.in_collision_other(manager, return_names=True)],
    lambda manager: [manager.min_distance_other(manager)],
    lambda manager: [manager.min_distance_internal(), manager.min_distance_internal("a"), manager.min_distance_internal("b")],
    lambda manager: [manager.in_collision_single(BOX, at(3.5, 0, 0).astype(np.float32), return_names=True)],
])
def test_managers_tell_the_same_story(story):
    def ending(made):
        last = story(filled(made(), a=BOX, b=(BOX, at(3, 0.1, 0.2))))[-1]
        return last

    both_say(ending)


def test_a_manager_that_changes_answers_as_a_new_one_does():
    rng, manager, objects = np.random.default_rng(8), MANAGERS["tandem"](), {}
    shapes = [RING, BOX, BALL]
    other = filled(MANAGERS["tandem"](), one=(RING, at(1, 0, 0)), two=(BOX, at(0, 2, 0)))
    for step in range(120):
        name, pose = f"body{rng.integers(9)}", rotation_matrix(rng.uniform(0, 6), rng.normal(size=3)) @ at(*rng.uniform(-2, 2, 3))
        if step % 10 == 7:
            pose[:3, :3] *= 1.5
        if name not in objects:
            objects[name] = shapes[rng.integers(3)], pose
            manager.add_object(name, *objects[name])
        elif rng.random() < 0.2:
            del objects[name]
            manager.remove_object(name)
        else:
            objects[name] = objects[name][0], pose
            manager.set_transform(name, pose)
        probe, place = shapes[step // 20 % 3], at(*rng.uniform(-3, 3, 3))
        for ask in (lambda it: it.in_collision_single(probe, place, return_names=True), lambda it: it.min_distance_single(probe, place),
                    lambda it: it.in_collision_other(other, return_names=True), lambda it: it.in_collision_internal(return_names=True),
                    lambda it: it.min_distance_internal(next(iter(objects), None))):
            if rng.random() < 0.5:
                assert plain(ask(manager)) == plain(ask(filled(MANAGERS["tandem"](), **objects)))


def test_a_convex_mesh_is_solid_and_another_is_its_surface():
    ring = trimesh.creation.torus(10.0, 3.0)
    for inner in (BOX, BALL, RING):
        assert both_say(lambda made: filled(made(), a=LARGE).in_collision_single(inner, at(0.3, 0.1, 0)))[1] is True
        assert both_say(lambda made: filled(made(), a=inner).in_collision_single(LARGE, at(0.3, 0.1, 0)))[1] is True
        assert both_say(lambda made: filled(made(), a=ring).in_collision_single(inner, at(10, 0.1, 0)))[1] is False
        assert both_say(lambda made: filled(made(), a=inner).in_collision_single(ring, at(-10, 0.1, 0)))[1] is False
    # One of two parts is inside, the other far away; or an open sheet is.
    parts = trimesh.util.concatenate([BOX.copy().apply_translation([50, 0, 0]), RING])
    for inner in (parts, TRIANGLE.subdivide()):
        assert both_say(lambda made: filled(made(), a=LARGE).in_collision_single(inner, at(0.3, 0.1, 0)))[1] is True
        assert both_say(lambda made: filled(made(), a=LARGE, b=inner).in_collision_internal(return_names=True))[1][1] == {("a", "b")}


def random_pose(rng, reach):
    """A pose whose numbers float32 holds, as trimesh takes them."""
    pose = random_rotation_matrix(rng.random(3))
    pose[:3, 3] = rng.uniform(-reach, reach, 3)
    return pose.astype(np.float32).astype(np.float64)


def float32_mesh(mesh):
    """A mesh whose vertices float32 holds, as Tandem stores them."""
    return trimesh.Trimesh(mesh.vertices.astype(np.float32).astype(np.float64), mesh.faces, process=False)


SHAPES = [float32_mesh(mesh) for mesh in (
    BOX, RING, BALL, trimesh.creation.cylinder(0.4, 1.5, sections=24), trimesh.creation.annulus(0.4, 0.8, 0.5, sections=24),
    trimesh.util.concatenate([trimesh.creation.box((2, 0.3, 0.3)), trimesh.creation.box((0.3, 2, 0.3)).apply_translation([1, 1, 0])]))]


@pytest.mark.parametrize("seed", range(30))
def test_random_scenes_have_the_same_names_and_distances(seed):
    rng = np.random.default_rng(seed)
    objects = {f"body{i}": (SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 3.0)) for i in range(12)}
    others = {f"body{i}": (SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 3.0)) for i in range(4)}
    probe, pose = SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 3.0)
    both_say(lambda made: filled(made(), **objects).in_collision_internal(return_names=True))
    both_say(lambda made: filled(made(), **objects).in_collision_other(filled(made(), **others), return_names=True))
    both_say(lambda made: filled(made(), **objects).in_collision_single(probe, pose, return_names=True))
    apart = {name: (mesh, at(*(4 * (pose[:3, 3]))) @ pose) for name, (mesh, pose) in objects.items()}
    if both_say(lambda made: filled(made(), **apart).in_collision_internal())[1]:
        return
    for returns in RETURNS:
        both_say(lambda made: filled(made(), **apart).min_distance_internal(**returns))
        both_say(lambda made: filled(made(), **apart).min_distance_internal("body3", **returns))
    data = filled(MANAGERS["tandem"](), **apart).min_distance_internal(return_data=True)[1]
    first, second = data.names
    assert np.linalg.norm(data.point(first) - data.point(second)) == pytest.approx(data.distance, rel=1e-9)


def contact_faces(made, a, b, pose):
    """The set of the faces of every contact, -1 for that of a convex body, as python-fcl has it."""
    manager = filled(made(), a=a)
    convex = {"a": a.is_convex, "__external": b.is_convex}
    contacts = manager.in_collision_single(b, pose, return_data=True)[1]
    return {tuple(-1 if convex[name] else contact.index(name) for name in ("a", "__external")) for contact in contacts}


@pytest.mark.parametrize("seed", range(20))
def test_contacts_have_the_same_faces(seed):
    rng = np.random.default_rng(100 + seed)
    for a in SHAPES:
        b, pose = SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 0.7)
        assert contact_faces(MANAGERS["tandem"], a, b, pose) == contact_faces(MANAGERS["trimesh"], a, b, pose)


def test_contacts_of_convex_meshes_have_the_shortest_depth():
    """python-fcl's is that too, or longer."""
    rng = np.random.default_rng(7)
    convex = [mesh for mesh in SHAPES if mesh.is_convex]
    same = 0
    for _ in range(60):
        a, b, pose = convex[rng.integers(len(convex))], convex[rng.integers(len(convex))], random_pose(rng, 0.6)
        found = {name: filled(made(), a=a).in_collision_single(b, pose, return_data=True)[1] for name, made in MANAGERS.items()}
        assert len(found["tandem"]) == len(found["trimesh"])
        for ours, theirs in zip(found["tandem"], found["trimesh"]):
            manager = filled(MANAGERS["tandem"](), a=a)
            assert manager.min_distance_single(b, pose) == pytest.approx(-ours.depth)
            # Going by the depth along the normal parts the bodies, going by less does not.
            assert not manager.in_collision_single(b, at(*(1.001 * ours.depth * ours.normal)) @ pose)
            assert manager.in_collision_single(b, at(*(0.999 * ours.depth * ours.normal)) @ pose)
            assert theirs.depth > ours.depth - 1e-5
            same += theirs.depth == pytest.approx(ours.depth, rel=1e-4)
    assert same > 10


def test_the_normal_points_to_the_mesh_or_the_other_manager():
    for shape in (BOX, BALL, RING):
        place = at(shape.extents[0] - 0.15, 0.02, 0.01)
        single = filled(MANAGERS["tandem"](), a=shape).in_collision_single(shape, place, return_data=True)[1]
        other = filled(MANAGERS["tandem"](), a=shape).in_collision_other(filled(MANAGERS["tandem"](), b=(shape, place)), return_data=True)[1]
        internal = filled(MANAGERS["tandem"](), a=shape, b=(shape, place)).in_collision_internal(return_data=True)[1]
        for contacts in (single, other, internal):
            assert len(contacts) > 0
            assert all(contact.normal[0] > 0.6 for contact in contacts)
            assert all(0 < contact.depth < 0.16 for contact in contacts)
    # Between a convex body and another the normal points to the convex one, in trimesh too.
    for made in MANAGERS.values():
        for first, second, sign in ((BOX, RING, -1), (RING, BOX, 1)):
            contacts = filled(made(), a=first).in_collision_single(second, at(1.75, 0, 0), return_data=True)[1]
            assert max(contacts, key=lambda contact: contact.depth).normal == pytest.approx([sign, 0, 0], abs=1e-6)


def test_coinciding_boxes_part_along_the_first_axis_from_the_first_corner():
    answers = []
    for made in MANAGERS.values():
        contact, = filled(made(), a=(BOX, at(5, 0, 0))).in_collision_single(BOX, at(5, 0, 0), return_data=True)[1]
        answers.append((contact.depth, *contact.normal, *contact.point))
    assert answers[0] == pytest.approx(answers[1])


def test_contact_points_lie_on_both_bodies():
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b, pose = SHAPES[rng.integers(len(SHAPES))], SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 0.7)
        moved = b.copy().apply_transform(pose)
        for contact in filled(MANAGERS["tandem"](), a=a).in_collision_single(b, pose, return_data=True)[1]:
            assert np.linalg.norm(contact.normal) == pytest.approx(1)
            assert contact.depth >= 0
            if a.is_convex or b.is_convex:
                continue
            for mesh, name in ((a, "a"), (moved, "__external")):
                corners = mesh.triangles[[contact.index(name)]]
                assert trimesh.triangles.closest_point(corners, [contact.point])[0] == pytest.approx(contact.point, abs=1e-5)


def test_meeting_points_of_crossing_flat_and_touching_triangles():
    base = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    crossing = np.array([[0.2, 0.2, -1], [0.2, 0.2, 1], [5, 5, 0.0]])
    flat = base + [0.2, 0.2, 0]
    corner = base + [1, 0, 0]
    a, b = np.array([base] * 3), np.array([crossing, flat, corner])
    points = meeting_points(a, b)
    for triangles in (a, b):
        assert np.abs(trimesh.triangles.closest_point(triangles, points) - points).max() < 1e-9


def test_the_way_that_parts_convex_bodies_is_the_shortest():
    rng = np.random.default_rng(11)
    for _ in range(40):
        a, b = (Solid(rng.normal(size=(rng.integers(4, 40), 3)) * rng.uniform(0.1, 2, 3)) for _ in range(2))
        found = overlap(a, b)
        differences = (a.vertices[:, None] - b.vertices[None]).reshape(-1, 3)
        if not Solid(differences).contains(np.zeros((1, 3)))[0]:
            continue
        assert found.depth == pytest.approx(Solid(differences).offsets.min(), abs=1e-9)
        assert (a.vertices @ found.normal).max() - (b.vertices @ found.normal).min() == pytest.approx(found.depth)
        for solid, point in ((a, found.point_a), (b, found.point_b)):
            assert solid.contains(point[None], 1e-8)[0]
            assert not solid.contains(point[None], -1e-8)[0]


def test_the_deepest_of_all_collisions_is_the_distance():
    """Where python-fcl stops at the first that it sees."""
    manager = filled(MANAGERS["tandem"](), a=BOX, b=(BOX, at(0.9, 0, 0)), c=(BOX, at(1.2, 0, 0)), d=(RING, at(9, 0, 0)))
    assert manager.min_distance_internal(return_names=True) == (pytest.approx(-0.7), ("b", "c"))
    assert manager.min_distance_internal("a", return_names=True) == (pytest.approx(-0.1), ("a", "b"))
    distance, data = manager.min_distance_single(BOX, at(0, 0.8, 0), return_data=True)
    assert distance == pytest.approx(-0.2)
    assert np.linalg.norm(data.point("a") - data.point("__external")) == pytest.approx(0.2)


def test_distances_of_collisions_are_negative_where_one_is_convex_and_else_0():
    assert filled(MANAGERS["tandem"](), a=RING).min_distance_single(RING, at(0.5, 0, 0)) == 0
    distance, data = filled(MANAGERS["tandem"](), a=RING).min_distance_single(BOX, at(1.75, 0, 0), return_data=True)
    assert distance == pytest.approx(-0.05, abs=1e-5)
    assert np.linalg.norm(data.point("a") - data.point("__external")) == pytest.approx(0.05, abs=1e-5)
    assert filled(MANAGERS["tandem"](), a=LARGE).min_distance_single(RING) < -3


def test_a_name_that_is_there_is_replaced():
    """trimesh 5.2.0 keeps the former object among those that it collides."""
    manager = filled(MANAGERS["tandem"](), a=BOX)
    manager.add_object("a", BOX, at(9, 0, 0))
    assert not manager.in_collision_single(BOX)
    assert manager.in_collision_single(BOX, at(9, 0, 0), return_names=True) == (True, {"a"})
    manager.remove_object("a")
    assert not manager.in_collision_single(BOX, at(9, 0, 0))


def test_transforms_that_scale_shear_or_mirror_stretch_the_mesh():
    wedge = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    rng = np.random.default_rng(5)
    for shape in (wedge, RING):
        for matrix in (scale_matrix(3), np.diag([1, 2, 0.5, 1.0]), np.diag([-1, 1, 1, 1.0]), at(1, 2, 3) @ np.diag([2, 2, -2, 1.0]) @ rotation_matrix(1, [1, 2, 3]),
                       np.array([[1, 0.5, 0, 1], [0, 1, 0.2, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])):
            moved = shape.copy().apply_transform(matrix)
            for _ in range(10):
                pose = random_pose(rng, 2.5)
                baked = filled(MANAGERS["tandem"](), a=moved).in_collision_single(BOX, pose, return_data=True)
                given = filled(MANAGERS["tandem"](), a=(shape, matrix)).in_collision_single(BOX, pose, return_data=True)
                assert given[0] == baked[0]
                assert sorted(contact.index("a") for contact in given[1]) == sorted(contact.index("a") for contact in baked[1])
                assert max((c.depth for c in given[1]), default=0) == pytest.approx(max((c.depth for c in baked[1]), default=0), abs=1e-5)


def test_a_stretched_body_that_turns_is_built_once():
    manager = filled(MANAGERS["tandem"](), a=(RING, scale_matrix(2.5)))
    assets = set()
    for turn in np.linspace(0, 3, 50):
        manager.set_transform("a", rotation_matrix(turn, [1, 2, 3]) @ scale_matrix(2.5))
        manager.in_collision_single(BOX)
        assets.add(id(manager._bodies.assets[0]))
    assert len(assets) == 1


def test_every_stretch_of_a_mesh_is_built_once(monkeypatch):
    builds = []
    build = tandem._bodies.build
    monkeypatch.setattr(tandem._bodies, "build", lambda *arguments, **options: builds.append(1) or build(*arguments, **options))
    ring = RING.copy()
    manager = filled(MANAGERS["tandem"](), a=(ring, scale_matrix(2)), b=(ring, at(9, 0, 0) @ scale_matrix(3)))
    for frame in range(5):
        manager.set_transform("a", at(0, frame, 0) @ scale_matrix(2))
        manager.in_collision_internal()
        manager.add_object(f"c{frame}", ring, at(frame, 0, 0) @ scale_matrix(3))
        manager.in_collision_internal()
    assert len(builds) == 3


def test_a_mesh_that_was_stretched_can_be_pickled():
    ring = RING.copy()
    assert not filled(MANAGERS["tandem"](), a=(ring, scale_matrix(2))).in_collision_single(BOX)
    again = pickle.loads(pickle.dumps(ring))
    assert filled(MANAGERS["tandem"](), a=(again, scale_matrix(0.4))).in_collision_single(BOX)


def test_an_object_that_its_transform_leaves_nothing_of_is_named():
    manager = filled(MANAGERS["tandem"](), a=BOX, thing=(RING, np.diag([0, 0, 0, 1.0])))
    for _ in range(2):
        with pytest.raises(tandem.Error, match="thing, stretched by its transform: "):
            manager.in_collision_internal()
    manager.set_transform("thing", np.eye(4))
    assert manager.in_collision_internal() is True


def test_transforms_that_drift_from_a_rotation_are_taken_for_one():
    manager = filled(MANAGERS["tandem"](), a=RING, b=(RING, at(0.5, 0, 0)))
    before = manager._placed().assets[0]
    manager.set_transform("a", np.eye(4) * (1 + 3e-6))
    assert manager.in_collision_internal()
    assert manager._bodies.assets[0] is before


def test_transforms_that_are_not_finite_are_refused_by_name():
    manager = filled(MANAGERS["tandem"](), a=BOX, thing=RING)
    for bad in (np.nan, np.inf):
        manager.set_transform("thing", at(bad, 0, 0))
        with pytest.raises(ValueError, match="thing"):
            manager.in_collision_internal()
        manager.set_transform("thing", np.eye(4) * bad)
        with pytest.raises(ValueError, match="thing"):
            manager.min_distance_internal()
    manager.set_transform("thing", np.eye(4))
    assert manager.in_collision_internal()


def test_meshes_without_triangles_are_refused():
    for mesh in (trimesh.Trimesh(), trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], process=False)):
        with pytest.raises(tandem.Error, match="triangle"):
            MANAGERS["tandem"]().add_object("a", mesh)


def test_meshes_share_assets_until_they_change():
    mesh = RING.copy()
    manager = filled(MANAGERS["tandem"](), a=mesh, b=(mesh, at(9, 0, 0)))
    assert len(manager._placed().assets) == 1
    assert filled(MANAGERS["tandem"](), a=mesh)._placed().assets[0] is manager._bodies.assets[0]
    mesh.apply_translation([0, 0, 5])
    manager.add_object("c", mesh)
    assert len(manager._placed().assets) == 2
    assert manager.in_collision_internal(return_names=True) == (False, set())
    assert manager.in_collision_single(BOX, at(1, 0, 5), return_names=True) == (True, {"c"})


def test_open_and_damaged_meshes_collide_by_their_faces():
    rng = np.random.default_rng(17)
    torn = float32_mesh(trimesh.Trimesh(RING.vertices, RING.faces[rng.permutation(len(RING.faces))[:900]]))
    doubled = float32_mesh(trimesh.Trimesh(RING.vertices, np.concatenate([RING.faces, RING.faces[:50, ::-1]]), process=False))
    for mesh in (torn, doubled, TRIANGLE):
        for _ in range(10):
            pose = random_pose(rng, 1.0)
            both_say(lambda made: filled(made(), a=mesh).in_collision_single(SHAPES[1], pose, return_names=True))
            both_say(lambda made: filled(made(), a=mesh).in_collision_single(SHAPES[0], pose, return_names=True))
    # A flat face among others is left out, and the others keep their numbers.
    faces = np.concatenate([[[0, 0, 1]], RING.faces])
    manager = filled(MANAGERS["tandem"](), a=trimesh.Trimesh(RING.vertices, faces, process=False))
    contacts = manager.in_collision_single(RING, at(0.5, 0.1, 0), return_data=True)[1]
    plain_contacts = filled(MANAGERS["tandem"](), a=RING).in_collision_single(RING, at(0.5, 0.1, 0), return_data=True)[1]
    assert {c.index("a") for c in contacts} == {c.index("a") + 1 for c in plain_contacts}


def test_touching_counts():
    for shape in (BOX, LARGE, TRIANGLE):
        low, high = shape.bounds
        place = at(high[0] - low[0], 0, 0)
        for returns in RETURNS:
            answer = filled(MANAGERS["tandem"](), a=shape).in_collision_single(shape, place, **returns)
            assert (answer if isinstance(answer, bool) else answer[0]) is True
        assert filled(MANAGERS["tandem"](), a=shape).min_distance_single(shape, place) == pytest.approx(0, abs=1e-12)


def test_many_small_bodies_on_a_large_one():
    """trimesh's regression: one large body, hundreds of small ones that all meet it."""
    names = {f"probe{i}": (RING, at(i - 200, 0, 0) @ scale_matrix(1 / 16)) for i in range(400)}
    manager = filled(MANAGERS["tandem"](), **names)
    ground = trimesh.creation.box((1000, 10, 10)).apply_translation([0, 0, 0])
    assert manager.in_collision_single(ground, return_names=True) == (True, set(names))


def test_primitives_are_built_again_when_they_change():
    box = trimesh.primitives.Box((1, 1, 1))
    manager = filled(MANAGERS["tandem"](), a=BOX)
    assert not manager.in_collision_single(box, at(1.5, 0, 0))
    box.primitive.extents = (3, 1, 1)
    assert manager.in_collision_single(box, at(1.5, 0, 0))


def test_flat_and_far_bodies_have_depths():
    rng = np.random.default_rng(2)
    for _ in range(60):
        flat = trimesh.Trimesh((BOX.vertices * [1, 1, 10.0 ** rng.uniform(-9, -1)]) @ random_rotation_matrix(rng.random(3))[:3, :3].T, BOX.faces, process=False)
        far = 10.0 ** rng.uniform(0, 6)
        manager = filled(MANAGERS["tandem"](), a=(flat, at(far, 0, 0)), b=(BALL, at(far, 0.1, 0.2)))
        assert manager.in_collision_internal(return_names=True, return_data=True)[:2] == (True, {("a", "b")})
        assert -2.1 < manager.min_distance_internal() < 0


def test_docstring_examples():
    assert doctest.testmod(tandem.trimesh) == (0, 8)


def test_the_page_shows_what_happens():
    page = (Path(os.environ["TANDEM_SOURCE_DIR"]) / "docs/python_trimesh.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```\n(?:```\n(.*?)^```\n)?", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) > 1
    names = {}
    for code, shown in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "python_trimesh.md", "exec"), names)
        assert printed.getvalue() == shown


def test_mypy_finds_nothing(tmp_path):
    pytest.importorskip("mypy")
    package = Path(tandem.__file__).parent
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), "-m", "tandem.trimesh"], capture_output=True, text=True,
                          env={**os.environ, "MYPYPATH": str(package.parent)}, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_scenes():
    scene = trimesh.Scene()
    scene.add_geometry(BOX, node_name="box")
    scene.add_geometry(RING, node_name="ring", transform=at(3, 0, 0))
    scene.add_geometry(RING, node_name="large ring", transform=scale_matrix(3))
    manager, objects = tandem.trimesh.scene_to_collision(scene)
    assert set(objects) == {"box", "ring", "large ring"}
    assert objects["ring"].transform == pytest.approx(at(3, 0, 0))
    assert manager.in_collision_internal(return_names=True) == (True, {("large ring", "ring")})


def test_threads_and_managers_side_by_side():
    rng = np.random.default_rng(23)
    objects = {f"body{i}": (SHAPES[rng.integers(len(SHAPES))], random_pose(rng, 4.0)) for i in range(60)}
    expected = filled(MANAGERS["tandem"](), **objects).in_collision_internal(return_names=True)
    assert expected[0]
    answers = []

    def ask():
        manager = filled(tandem.trimesh.CollisionManager(threads=2), **objects)
        answers.extend(manager.in_collision_internal(return_names=True) for _ in range(5))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [expected] * 20


def test_distance_data_of_nobody():
    assert filled(MANAGERS["tandem"]()).min_distance_internal() == sys.float_info.max
    data = filled(MANAGERS["tandem"]()).min_distance_single(BOX, return_data=True)[1]
    assert data.names == {None, "__external"}
    assert data.index("__external") == -1
    assert data.point("__external") is None


if __name__ == "__main__":
    sys.exit(pytest.main([__file__, "-q"]))


def test_ignored_pairs_are_not_looked_at():
    box = trimesh.creation.box()
    manager = tandem.trimesh.CollisionManager()
    for name, x in (("c", 0.6), ("a", 0.0), ("b", 0.3)):
        manager.add_object(name, box, trimesh.transformations.translation_matrix([x, 0, 0]))
    for a, b in (("b", "a"), ("a", "c")):
        manager.set_pair_ignored(a, b)
    assert manager.ignored_pairs == {("a", "b"), ("a", "c")} and manager.is_pair_ignored("a", "b") and manager.is_pair_ignored("b", "a")
    assert manager.in_collision_internal(return_names=True) == (True, {("b", "c")})
    assert manager.in_collision_internal() is True
    assert {tuple(sorted(contact.names)) for contact in manager.in_collision_internal(return_data=True)[1]} == {("b", "c")}
    assert manager.min_distance_internal(return_names=True)[1] == ("b", "c")
    assert manager.min_distance_internal(name="a") == sys.float_info.max  # nobody is left
    manager.set_pair_ignored("c", "b")
    assert manager.in_collision_internal(return_names=True) == (False, set()) and manager.in_collision_internal() is False
    assert manager.in_collision_single(box) is True
    manager.set_pair_ignored("c", "b", ignored=False)
    assert manager.in_collision_internal() is True
    manager.remove_object("a")
    assert manager.ignored_pairs == set()
    for a, b in (("b", "b"), ("b", "ghost"), ("ghost", "b")):
        with pytest.raises(ValueError, match=a if a == b else "ghost"):
            manager.set_pair_ignored(a, b)
    manager.set_pair_ignored("b", "c")
    manager.clear_ignored_pairs()
    assert manager.ignored_pairs == set() and not manager.is_pair_ignored("b", "c") and not manager.is_pair_ignored("b", "ghost")
