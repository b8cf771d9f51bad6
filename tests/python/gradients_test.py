"""Signed distances: values, signs and kinds, and derivatives against central differences. TANDEM_LONG=1 asks 10,000 configurations instead of some hundreds."""
import itertools
import os

import numpy as np
import pytest

import solids
import tandem
import tandem.gradients
from meshes import BOX_FACES, BOX_VERTICES
from tandem.gradients import APART, ENCLOSED, OVERLAPPING, TOUCHING, signed_distances

SHAPES = {"box": solids.box(0.5, 0.4, 0.3), "ball": solids.ball(0.5, 8, 12), "peg": solids.peg(0.3, 0.8, 12), "link": solids.chain_link(0.5, 0.15),
          "cup": solids.cup(0.4, 0.5, 0.1, 0.8)}
ASSETS = {name: tandem.build(*shape) for name, shape in SHAPES.items()}
PAIRS = list(itertools.combinations_with_replacement(SHAPES, 2))
CONFIGURATIONS = 10_000 if os.environ.get("TANDEM_LONG") else 300
STEP = 3e-6
RIGHT = 1e-6


def turned(vector):
    """The rotation by a vector along its axis, in rad (Rodrigues)."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle if angle else vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def random_rotation(random):
    return turned(random.normal(size=3) * np.pi)


def moved(row, motion):
    """An instance that moves by motion[:3] and turns by motion[3:] about its translation."""
    row = row.copy()
    row["translation"] += motion[:3]
    row["rotation"] = turned(motion[3:]) @ row["rotation"]
    return row


def placed(random, names, distance):
    """A scene of two bodies at random rotations, far from the origin's axes, whose centres are so far apart."""
    direction = random.normal(size=3)
    centre = random.normal(size=3)
    bodies = tandem.instances(asset=[0, 1], rotation=[random_rotation(random), random_rotation(random)],
                              translation=[centre, centre + distance * direction / np.linalg.norm(direction)])
    return tandem.Scene([ASSETS[name] for name in names], bodies)


def central_differences(scene, of_row):
    """(12,): the derivatives of of_row(row) by the motions of a, then of b, and the rows at all places, 24 of them."""
    bodies, slopes, rows = scene.instances, np.zeros(12), []
    for i in range(12):
        values = []
        for step in (STEP, -STEP):
            motion = np.zeros(12)
            motion[i] = step
            scene.place(np.array([moved(bodies[0], motion[:6]), moved(bodies[1], motion[6:])]))
            rows.append(signed_distances(scene, pairs=[[0, 1]]).distances[0])
            values.append(of_row(rows[-1]))
        slopes[i] = (values[0] - values[1]) / (2 * STEP)
    scene.place(bodies)
    return slopes, rows


def gradient_of(row):
    return np.concatenate([row["gradient_a"], row["gradient_b"]])


def stays(row, others):
    """Whether the nearest points, seen from the bodies, move less than a thousand times as far as the bodies: this is no tie, and edges are not nearly parallel."""
    return all(np.abs(other[name] - row[name]).max() < 1000 * STEP for other in others for name in ("in_a", "in_b"))


def test_gradients_of_bodies_apart_are_those_of_central_differences():
    random, worst, ties, asked = np.random.default_rng(5), 0.0, 0, 0
    while asked < CONFIGURATIONS:
        scene = placed(random, PAIRS[asked % len(PAIRS)], random.uniform(0.8, 3))
        row = signed_distances(scene, pairs=[[0, 1]]).distances[0]
        if row["kind"] != APART or row["distance"] < 0.02:
            continue
        asked += 1
        slopes, others = central_differences(scene, lambda row: row["distance"])
        if not stays(row, others):
            ties += 1
            continue
        worst = max(worst, np.abs(slopes - gradient_of(row)).max())
    print(f"{asked} configurations, {ties} of them ties; the largest error is {worst:.2g}")
    assert worst < RIGHT and ties <= asked / 50


def test_gradients_of_enclosed_bodies_are_those_of_central_differences():
    random, small = np.random.default_rng(6), tandem.build(*solids.box(0.1, 0.07, 0.05))
    asked = 0
    for _ in range(30):
        bodies = tandem.instances(asset=[0, 1], rotation=[random_rotation(random), random_rotation(random)],
                                  translation=[[1, 2, 3], np.array([1, 2, 3]) + random.uniform(-0.15, 0.15, 3)])
        scene = tandem.Scene([ASSETS["box"], small], bodies)
        row = signed_distances(scene, pairs=[[0, 1]]).distances[0]
        if row["kind"] == OVERLAPPING:
            continue
        assert row["kind"] == ENCLOSED and row["distance"] < 0
        assert row["distance"] == -scene.distances(pairs=[[0, 1]], relative_tolerance=2.0**-48).distances["upper"][0]
        slopes, others = central_differences(scene, lambda row: row["distance"])
        if stays(row, others):
            asked += 1
            assert np.abs(slopes - gradient_of(row)).max() < RIGHT
    assert asked > 15


def overlapping(random, names):
    """A scene of two bodies that overlap a little, and its row."""
    apart, meeting = 2.5, 0.0
    scene = placed(random, names, apart)
    bodies = scene.instances
    direction = (bodies["translation"][1] - bodies["translation"][0]) / apart
    for _ in range(20):
        middle = (apart + meeting) / 2
        scene.move(1, rotation=bodies["rotation"][1], translation=bodies["translation"][0] + middle * direction)
        apart, meeting = (apart, middle) if len(scene.contacts(first_contact_only=True).contacts) else (middle, meeting)
    scene.move(1, rotation=bodies["rotation"][1], translation=bodies["translation"][0] + (meeting - random.uniform(0.005, 0.05)) * direction)
    return scene, signed_distances(scene, pairs=[[0, 1]]).distances[0]


def test_overlaps_end_along_their_direction():
    """Nearly as fast as b moves: the direction turns a little as it does."""
    random, asked = np.random.default_rng(7), 0
    for number in range(90):
        scene, row = overlapping(random, PAIRS[number % len(PAIRS)])
        if row["kind"] != OVERLAPPING:
            continue
        bodies, depths = scene.instances, []
        for step in (STEP, -STEP):
            scene.move(1, rotation=bodies["rotation"][1], translation=bodies["translation"][1] + step * row["direction"])
            depths.append(signed_distances(scene, pairs=[[0, 1]]).distances["distance"][0])
        asked += 1
        assert abs((depths[0] - depths[1]) / (2 * STEP) - 1) < 0.05
        assert np.array_equal(row["gradient_b"][:3], row["direction"]) and np.array_equal(row["gradient_a"][:3], -row["direction"])
    assert asked > 80


def test_gradients_of_corners_in_faces_of_boxes_are_derivatives_of_the_depth():
    random, asked, size = np.random.default_rng(8), 0, SHAPES["box"][0].max(axis=0)
    for _ in range(80):
        scene, row = overlapping(random, ("box", "box"))
        faces = [np.abs(body["rotation"].T @ row["direction"]).max() > 1 - 1e-12 for body in scene.instances]
        corners = [(np.abs(np.abs(row[f"in_{side}"]) - size) < 1e-6).all() for side in "ab"]
        if row["kind"] != OVERLAPPING or not (faces[0] and corners[1] or faces[1] and corners[0]):
            continue
        slopes, others = central_differences(scene, lambda row: row["distance"])
        asked += 1
        assert stays(row, others) and np.abs(slopes - gradient_of(row)).max() < RIGHT
    assert asked > 20


def test_the_distance_is_between_the_points():
    random = np.random.default_rng(9)
    kinds = set()
    for number in range(200):
        scene = placed(random, PAIRS[number % len(PAIRS)], random.uniform(0.1, 2))
        row = signed_distances(scene, pairs=[[0, 1]]).distances[0]
        kinds.add(int(row["kind"]))
        assert row["distance"] == pytest.approx(row["direction"] @ (row["point_b"] - row["point_a"]), abs=1e-9)
        assert np.linalg.norm(row["direction"]) == pytest.approx(1, abs=1e-12)
        for side, body in zip("ab", scene.instances):
            assert np.allclose(body["rotation"] @ row[f"in_{side}"] + body["translation"], row[f"point_{side}"], atol=1e-9)
    assert kinds >= {APART, OVERLAPPING}


def test_kinds():
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    small = tandem.build(BOX_VERTICES / 4, BOX_FACES)
    at = [[0, 0, 0], [1, 0, 0], [0.9, 0.05, 0.05], [0.5, 0.4, 0.3], [4, 4, 4]]
    scene = tandem.Scene([box, small], asset=[0, 0, 0, 1, 0], translation=at)
    asked = [[0, 1], [2, 0], [0, 3], [3, 0], [4, 0], [0, 2], [0, 2]]
    found = signed_distances(scene, pairs=asked)
    assert found.pairs.tolist() == [tuple(pair) for pair in asked]
    assert found.distances["kind"].tolist() == [TOUCHING, OVERLAPPING, ENCLOSED, ENCLOSED, APART, OVERLAPPING, OVERLAPPING]
    assert np.allclose(found.distances["distance"], [0, -0.1, -0.25, -0.25, np.sqrt(27), -0.1, -0.1])
    assert np.allclose(found.distances["direction"][[0, 1, 5]], [[1, 0, 0], [-1, 0, 0], [1, 0, 0]])
    beyond = signed_distances(scene, pairs=[[4, 0]], reach=1).distances[0]
    assert beyond["distance"] == np.inf and beyond["kind"] == APART and not gradient_of(beyond).any() and not beyond["in_a"].any()
    assert len(signed_distances(scene.place(np.zeros(0, tandem.INSTANCE))).distances) == 0


def test_of_parallel_faces_one_pair_of_nearest_points_has_the_gradient():
    scene = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES)], translation=[[0, 0, 0], [1.5, 0.25, 0.5]])
    row = signed_distances(scene).distances[0]
    assert row["kind"] == APART and row["distance"] == pytest.approx(0.5, rel=1e-14) and row["direction"].tolist() == [1, 0, 0]
    assert np.array_equal(row["point_a"][1:], row["point_b"][1:]) and (row["point_a"][1:] >= [0.25, 0.5]).all() and (row["point_a"][1:] <= 1).all()
    for side, sign in (("a", -1), ("b", 1)):
        arm = row[f"point_{side}"] - scene.instances["translation"]["ab".index(side)]
        assert row[f"gradient_{side}"].tolist() == [sign, 0, 0, 0, sign * arm[2], -sign * arm[1]]


def test_of_several_overlaps_the_deepest_counts():
    legs = [solids.box(0.1, 0.1, 1) for _ in range(3)]
    vertices = np.concatenate([leg[0] + [place, 0, -low] for leg, place, low in zip(legs, (-1, 0, 1), (0.1, 0.3, 0.2))])
    legged = tandem.build(vertices, np.concatenate([leg[1] + 8 * number for number, leg in enumerate(legs)]))
    row = signed_distances(tandem.Scene([tandem.build(*solids.box(3, 3, 1)), legged], asset=[0, 1], translation=[[0, 0, 0], [0, 0, 2]])).distances[0]
    assert row["kind"] == OVERLAPPING and row["distance"] == pytest.approx(-0.3, abs=1e-6) and np.allclose(row["direction"], [0, 0, 1])
    assert np.abs(row["in_b"][:2]).max() < 0.11


def test_corners_that_touch_have_no_direction():
    scene = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES)], translation=[[0, 0, 0], [1, 1, 1]])
    row = signed_distances(scene).distances[0]
    assert row["kind"] == TOUCHING and row["distance"] == 0 and not gradient_of(row).any() and row["point_a"].tolist() == [1, 1, 1]


def test_bodies_almost_touching_and_tiny_and_huge_have_unit_directions():
    for size in (2.0**-100, 1.0, 2.0**100):
        asset = tandem.build(BOX_VERTICES * size, BOX_FACES)
        for gap in (2.0**-40, 0.5):
            row = signed_distances(tandem.Scene([asset], translation=np.array([[0, 0, 0], [1 + gap, 0, 0]]) * size)).distances[0]
            assert row["distance"] == pytest.approx(gap * size, rel=1e-3) and np.abs(row["direction"] - [1, 0, 0]).max() < 1e-3


def hinged(library, angles, translations):
    """Bodies (n, 4, 4) turned by vectors (n, 3), by a library that differentiates."""
    zero = angles[:, 0] * 0
    x, y, z = angles[:, 0], angles[:, 1], angles[:, 2]
    skew = library.stack([library.stack([zero, -z, y], -1), library.stack([z, zero, -x], -1), library.stack([-y, x, zero], -1)], -2)
    square = (angles**2).sum(-1)[:, None, None]
    angle = square**0.5
    return library.eye(3) + library.sin(angle) / angle * skew + (1 - library.cos(angle)) / square * (skew @ skew), translations


BODIES, ASKED, WEIGHTS = [2, 0], [[0, 1], [2, 1], [0, 2]], [1.0, -2.0, 0.5]


def three_bodies():
    """A scene of three bodies apart, of which the first and the last get poses, and these."""
    random = np.random.default_rng(10)
    scene = tandem.Scene([ASSETS["box"], ASSETS["cup"], ASSETS["link"]], asset=[0, 1, 2], rotation=[random_rotation(random) for _ in range(3)],
                         translation=[[0, 0, 0], [1.7, 0.2, 0.1], [0.3, 1.9, -0.4]])
    return scene, random.normal(size=(2, 3)), np.array([[0.3, 1.9, -0.4], [0.1, 0, 0.2]])


def loss_by_hand(scene, angles, translations):
    scene.move(BODIES, rotation=[turned(vector) for vector in angles], translation=translations)
    return signed_distances(scene, pairs=ASKED).distances["distance"] @ WEIGHTS


def slopes_by_hand(scene, angles, translations):
    given, slopes = np.stack([angles, translations]), np.zeros((2, 2, 3))
    for place in np.ndindex(given.shape):
        values = []
        for step in (STEP, -STEP):
            at = given.copy()
            at[place] += step
            values.append(loss_by_hand(scene, *at))
        slopes[place] = (values[0] - values[1]) / (2 * STEP)
    return slopes


def test_derivatives_by_rotation_matrices_are_right_for_rotations():
    """The entry-wise derivative, times how the matrix changes as the body turns about an axis, is how the weighted sum of distances changes."""
    scene, angles, translations = three_bodies()
    function = tandem.gradients.PoseFunction(scene, ASKED, BODIES)
    rotations = np.array([turned(vector) for vector in angles])
    by_rotation, by_translation = function.pull_back(function.find(rotations, translations), np.array(WEIGHTS))
    for body, axis in itertools.product(range(2), range(3)):
        turns, ways = [], []
        for step in (STEP, -STEP):
            motion = step * np.eye(3)[axis]
            turning, moving = rotations.copy(), translations.copy()
            turning[body] = turned(motion) @ turning[body]
            moving[body] += motion
            turns.append(function.find(turning, translations)["distance"] @ WEIGHTS)
            ways.append(function.find(rotations, moving)["distance"] @ WEIGHTS)
        change = np.cross(np.eye(3)[axis], rotations[body].T).T
        assert abs((turns[0] - turns[1]) / (2 * STEP) - (by_rotation[body] * change).sum()) < RIGHT
        assert abs((ways[0] - ways[1]) / (2 * STEP) - by_translation[body, axis]) < RIGHT


def test_torch():
    torch = pytest.importorskip("torch")
    from tandem.torch import signed_distances as differentiable

    scene, angles, translations = three_bodies()
    given = [torch.tensor(array, requires_grad=True) for array in (angles, translations)]
    rotation, translation = hinged(torch, *given)
    distance, kind = differentiable(scene, ASKED, BODIES, rotation=rotation, translation=translation)
    assert distance.dtype == torch.float64 and kind.tolist() == [APART] * 3 and not kind.requires_grad
    loss = distance @ torch.tensor(WEIGHTS, dtype=torch.float64)
    assert loss.item() == pytest.approx(loss_by_hand(scene, angles, translations), abs=1e-12)
    got = [tensor.numpy() for tensor in torch.autograd.grad(loss, given, retain_graph=True)]
    assert np.abs(np.stack(got) - slopes_by_hand(scene, angles, translations)).max() < RIGHT
    with pytest.raises(RuntimeError, match="differentiable once"):
        torch.autograd.grad(loss, given, create_graph=True)

    transform = torch.eye(4).repeat(2, 1, 1)  # float32
    transform[:, :3, :3], transform[:, :3, 3] = rotation.detach(), translation.detach()
    transform.requires_grad_()
    coarse, _ = differentiable(scene, ASKED, BODIES, transform=transform)
    assert coarse.dtype == torch.float32 and torch.allclose(coarse, distance.float(), atol=1e-5)
    coarse.sum().backward()
    assert transform.grad.dtype == torch.float32 and transform.grad[:, :3].abs().sum() > 1 and not transform.grad[:, 3].any()
    check_refusals(lambda **poses: differentiable(scene, ASKED, BODIES, **poses), torch)


def test_jax():
    jax = pytest.importorskip("jax")
    from tandem.jax import signed_distances as make

    scene, angles, translations = three_bodies()
    with jax.enable_x64(True):
        distances = make(scene, ASKED, BODIES)

        def loss(angles, translations):
            rotation, translation = hinged(jax.numpy, angles, translations)
            return distances(rotation=rotation, translation=translation)[0] @ jax.numpy.array(WEIGHTS)

        by_hand = slopes_by_hand(scene, angles, translations)
        for gradient in (jax.grad(loss, (0, 1)), jax.jit(jax.grad(loss, (0, 1)))):
            assert np.abs(np.stack(gradient(angles, translations)) - by_hand).max() < RIGHT
        assert float(loss(angles, translations)) == pytest.approx(loss_by_hand(scene, angles, translations), abs=1e-12)
        several = np.stack([translations, translations + 0.1])
        batch = jax.vmap(jax.grad(loss, 1), (None, 0))(angles, several)
        assert np.abs(batch[0] - by_hand[1]).max() < RIGHT
        assert np.abs(batch[1] - slopes_by_hand(scene, angles, several[1])[1]).max() < RIGHT
        with pytest.raises(Exception, match="JVP|callback"):
            jax.grad(lambda t: jax.grad(loss, 1)(angles, t).sum())(translations)
    transform = np.zeros((2, 4, 4), np.float32)
    transform[:, 3, 3] = 1
    transform[:, :3, :3], transform[:, :3, 3] = [turned(vector) for vector in angles], translations
    coarse, kind = distances(transform=transform)
    assert coarse.dtype == np.float32 and kind.tolist() == [APART] * 3
    assert np.allclose(coarse, signed_distances(scene, pairs=ASKED).distances["distance"], atol=1e-6)
    check_refusals(distances, jax.numpy)


def check_refusals(function, library):
    with pytest.raises(TypeError, match="transform instead of both"):
        function(translation=library.zeros((2, 3)))
    for rotation, translation in ((library.eye(3)[None], library.zeros((2, 3))), (library.zeros((2, 3, 3)), library.zeros((3, 3)))):
        with pytest.raises(Exception, match="where .* are wanted"):
            function(rotation=rotation, translation=translation)
    with pytest.raises(Exception, match="not a rotation"):
        function(rotation=library.zeros((2, 3, 3)), translation=library.zeros((2, 3)))


@pytest.mark.parametrize("bodies,pairs,kind,message", [([0, 0], [[0, 1]], ValueError, "twice"), ([0], None, TypeError, "pairs is None")])
def test_wrong_arguments_are_refused(bodies, pairs, kind, message):
    with pytest.raises(kind, match=message):
        tandem.gradients.PoseFunction(tandem.Scene([ASSETS["box"]]), pairs, bodies)


def test_bodies_without_poses_stand():
    scene = tandem.Scene([ASSETS["box"]], translation=[[0, 0, 0], [2, 0, 0], [4, 0, 0]])
    function = tandem.gradients.PoseFunction(scene, [[0, 1], [1, 2]], [2])
    found = function.find(np.eye(3)[None], [[5, 0, 0]])
    assert np.allclose(found["distance"], [1, 2])
    rotation, translation = function.pull_back(found, np.array([1.0, 1.0]))
    assert rotation.shape == (1, 3, 3) and translation.tolist() == [[1, 0, 0]]
    empty = tandem.gradients.PoseFunction(scene, np.zeros((0, 2), int), [])
    assert len(empty.find(np.zeros((0, 3, 3)), np.zeros((0, 3)))) == 0
