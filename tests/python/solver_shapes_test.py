"""The meshes of primitives that the adapters for solvers make: closed, outwards, and as near to the primitive as is said."""
import numpy as np
import pytest

import solids
import tandem
from tandem import _shapes

RADIUS, HALF, AXES = 0.3, 0.7, np.array([0.1, 0.2, 0.5])


def points_of(solid):
    """Corners of the faces, and random points on them."""
    corners = solid[0][solid[1]]
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), (20, len(corners)))
    return np.concatenate([corners.reshape(-1, 3), np.einsum("kfi,fij->kfj", weights, corners).reshape(-1, 3)])


def share_of_capsule(points):
    """How far points are from the axis of a capsule, as a part of its radius."""
    return np.linalg.norm(points - np.stack([0 * points[:, 0], 0 * points[:, 0], np.clip(points[:, 2], -HALF, HALF)], axis=1), axis=1) / RADIUS


def share_of_round(points, radius):
    """How far points between the flat ends are from the axis, as a part of the radius at their height."""
    x, y, z = points[np.abs(points[:, 2]) < HALF * (1 - 1e-9)].T
    return np.hypot(x, y) / radius(z)


CASES = {
    "sphere": ((RADIUS, 0, 0), 4 / 3 * np.pi * RADIUS**3, lambda p: np.linalg.norm(p, axis=1) / RADIUS),
    "ellipsoid": (AXES, 4 / 3 * np.pi * AXES.prod(), lambda p: np.linalg.norm(p / AXES, axis=1)),
    "capsule": ((RADIUS, HALF, 0), np.pi * RADIUS**2 * (4 / 3 * RADIUS + 2 * HALF), share_of_capsule),
    "cylinder": ((RADIUS, HALF, 0), 2 * np.pi * RADIUS**2 * HALF, lambda p: share_of_round(p, lambda z: RADIUS)),
    "cone": ((RADIUS, HALF, 0), 2 / 3 * np.pi * RADIUS**2 * HALF, lambda p: share_of_round(p, lambda z: RADIUS * (HALF - z) / (2 * HALF)))}


@pytest.mark.parametrize("tolerance", [0.5, 0.05, 0.01, 0.002])
@pytest.mark.parametrize("kind", CASES)
def test_faces_are_within_the_tolerance(kind, tolerance):
    size, volume, share = CASES[kind]
    solid = _shapes.Shapes(tolerance).of(kind, *size)
    shares = share(points_of(solid))
    assert 1 - tolerance - 1e-12 <= shares.min() and shares.max() <= 1 + tolerance + 1e-12
    assert shares.max() > 1 and shares.min() < 1
    assert solids.volume(*solid) == pytest.approx(volume, rel=3 * tolerance)


def test_no_more_faces_than_the_tolerance_asks_for():
    counts = [len(_shapes.Shapes(tolerance).of("sphere", 1, 0, 0)[1]) for tolerance in (0.01, 0.005, 0.002)]
    assert counts == [392, 800, 2048]


@pytest.mark.parametrize("solid", [*(_shapes.Shapes(0.01).of(kind, *case[0]) for kind, case in CASES.items()), _shapes.Shapes(0.5).of("box", 1, 2, 3),
                                   _shapes.slab(2.0), _shapes.height_field(1, 2, 0.5, np.random.default_rng(1).uniform(size=(4, 7)))])
def test_meshes_are_closed(solid):
    assert tandem.build(*solid).levels[0].closed
    edges = np.concatenate([solid[1][:, [i, (i + 1) % 3]] for i in range(3)])
    assert len(np.unique(edges, axis=0)) == len(edges) and {tuple(e) for e in edges.tolist()} == {tuple(e) for e in edges[:, ::-1].tolist()}
    assert solids.volume(*solid) > 0


def test_flat_shapes_are_exact():
    assert solids.volume(*_shapes.Shapes(0.1).of("box", 1, 2, 3)) == 48
    vertices, faces = _shapes.slab(2.0)
    assert vertices[:, 2].max() == 0 and solids.volume(vertices, faces) == 32
    heights = np.array([[0.0, 1.0], [2.0, 5.0]])
    vertices, faces = _shapes.height_field(1, 2, 0.5, heights)
    # The base, and two prisms of area 4 up to corners at 0, 1, 5 and at 0, 5, 2.
    assert solids.volume(vertices, faces) == pytest.approx(8 * 0.5 + 4 * (6 / 3 + 7 / 3))
