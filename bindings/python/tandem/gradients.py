"""Signed distances of bodies and their derivatives by the poses (docs/gradients.md).

`tandem.torch` and `tandem.jax` make differentiable functions of them.
"""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import INSIDE
from ._arrays import Rows, pairs_of, whole_numbers
from ._scene import Distances, Scene

__all__ = ["APART", "ENCLOSED", "OVERLAPPING", "SIGNED_DISTANCE", "TOUCHING", "SignedDistances", "signed_distances"]

#: Kinds of signed distances: the surfaces are apart and no body is in the other; they meet without depth; they cross; they are apart, but one body, or a
#: component of it, is inside the other.
APART, TOUCHING, OVERLAPPING, ENCLOSED = range(4)

_VECTOR, _FORCE_AND_TORQUE = ("<f8", (3,)), ("<f8", (6,))
#: A signed distance: see `signed_distances`.
SIGNED_DISTANCE = np.dtype([("distance", "<f8"), ("direction", *_VECTOR), ("point_a", *_VECTOR), ("point_b", *_VECTOR), ("in_a", *_VECTOR), ("in_b", *_VECTOR),
                            ("gradient_a", *_FORCE_AND_TORQUE), ("gradient_b", *_FORCE_AND_TORQUE), ("kind", "<u4"), ("reserved", "<u4")])

_NARROWEST = 2.0**-48  # the least relative tolerance that distances keep
_Array = npt.NDArray[np.float64]


class SignedDistances(NamedTuple):
    """Object pairs, and the signed distance of each, array of SIGNED_DISTANCE."""

    pairs: Rows
    distances: Rows


def signed_distances(scene: Scene, *, pairs: npt.ArrayLike | None = None, reach: float | None = None) -> SignedDistances:
    """Finds signed distances of bodies a and b, and how these change as the bodies move.

    The rows have:

    - `kind`: APART, TOUCHING, OVERLAPPING or ENCLOSED.
    - `distance`: of the surfaces where APART (`upper` of `Scene.distances`); minus that where ENCLOSED; minus the depth of the deepest manifold where
      OVERLAPPING; 0 where TOUCHING. Infinite beyond the reach; all else is 0 then.
    - `direction`: unit vector in the world along which a motion of b makes the distance grow fastest; 0 where there is none.
    - `point_a`, `point_b`: the points that the distance is between, in the world: distance = direction . (point_b - point_a). `in_a` and `in_b` are the same in
      the coordinates of the mesh files.
    - `gradient_a`, `gradient_b`: force, then torque: if a body moves by a small u and turns by a small w (a vector along the axis, in rad) about its
      translation, all in the world, then the distance grows by force . u + torque . w.

    Where APART or ENCLOSED, gradients are the derivatives of the distance where these exist, and else belong to one of the nearest pairs of points. Where
    OVERLAPPING or TOUCHING they push the bodies apart along `direction`, but are not the derivatives of the depth in general (docs/gradients.md).

    Args:
        scene: as it stands. Its last `contacts` and manifolds are of these pairs then.
        pairs: where not given, those whose world boxes are within reach.
        reach: pairs that are surely farther apart have an infinite distance; None: all are looked at.

    Raises:
        Error: as `Scene.distances`, `Scene.manifolds` and `Scene.contained` do.

    >>> found = tandem.gradients.signed_distances(scene.place(translation=[[0, 0, 0], [1.5, 0.25, 0.25]]))
    >>> found.distances["distance"].round(9).tolist(), found.distances["gradient_b"][0, :3].tolist()
    ([0.5], [1.0, 0.0, 0.0])
    """
    nearest = scene.distances(pairs=pairs, reach=reach, relative_tolerance=_NARROWEST)
    if not len(nearest.pairs):
        return SignedDistances(nearest.pairs, np.zeros(0, SIGNED_DISTANCE))
    rows = _apart(nearest)
    bodies = scene.instances
    a, b = bodies[nearest.pairs["a"]], bodies[nearest.pairs["b"]]
    near = rows["distance"] < np.inf
    for side, body in (("a", a), ("b", b)):
        rows[f"in_{side}"][near] = _turned_back(body["rotation"], rows[f"point_{side}"] - body["translation"])[near]
    contacts = scene.contacts(pairs=nearest.pairs)
    if len(contacts.contacts):
        _take_overlaps(scene, rows, a, b)
    _take_enclosed(scene, rows)
    for side, body, sign in (("a", a, -1.0), ("b", b, 1.0)):
        force = sign * rows["direction"]
        torque = np.cross(rows[f"point_{side}"] - body["translation"], force)
        rows[f"gradient_{side}"] = np.concatenate([force, torque], axis=1) + 0.0  # not -0
    return SignedDistances(nearest.pairs, rows)


def _apart(nearest: Distances) -> Rows:
    """The rows of pairs as if all were apart, without points in the bodies and gradients."""
    rows = np.zeros(len(nearest.pairs), SIGNED_DISTANCE)
    found = nearest.distances
    rows["distance"] = found["upper"]
    for name in ("point_a", "point_b"):
        rows[name][found["upper"] < np.inf] = found[name][found["upper"] < np.inf]
    way = rows["point_b"] - rows["point_a"]
    # Powers of two keep squares of tiny and huge ways within float64.
    _, exponent = np.frexp(np.abs(way).max(axis=1))
    scaled = np.ldexp(way, -exponent[:, None])
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    has_direction = (found["upper"] > 0) & (length[:, 0] > 0)
    rows["direction"][has_direction] = scaled[has_direction] / length[has_direction]
    rows["kind"] = np.where(found["upper"] > 0, APART, TOUCHING)
    return rows


def _turned_back(rotation: _Array, vectors: _Array) -> _Array:
    """Vectors (m, 3) of the world in the axes of bodies."""
    turned: _Array = np.einsum("mij,mi->mj", rotation, vectors)
    return turned


def _take_overlaps(scene: Scene, rows: Rows, a: Rows, b: Rows) -> None:
    """Gives pairs that meet the deepest point of their manifolds."""
    _, manifolds, points = scene.manifolds(most_points=1, match_previous=False)
    manifolds = manifolds[manifolds["point_count"] > 0]
    order = np.lexsort((-manifolds["depth"], manifolds["pair"]))  # stable: the first of those that are equally deep
    pairs, first = np.unique(manifolds["pair"][order], return_index=True)
    deepest = points[manifolds["first_point"][order[first]]]
    rows["kind"][pairs] = np.where(deepest["depth"] > 0, OVERLAPPING, TOUCHING)
    rows["distance"][pairs] = -deepest["depth"] + 0.0  # not -0
    rows["direction"][pairs] = deepest["normal"]
    for side, body in (("a", a[pairs]), ("b", b[pairs])):
        inner = deepest[f"in_{side}"]
        rows[f"in_{side}"][pairs] = inner
        rows[f"point_{side}"][pairs] = np.einsum("mij,mj->mi", body["rotation"], inner) + body["translation"]


def _take_enclosed(scene: Scene, rows: Rows) -> None:
    """Turns the sign of pairs whose surfaces are apart, but of which one body has a component inside the other."""
    contained = scene.contained().contained
    enclosed = np.zeros(len(rows), bool)
    enclosed[contained["pair"][contained["flags"] & INSIDE != 0]] = True
    enclosed &= rows["kind"] == APART
    rows["kind"][enclosed] = ENCLOSED
    rows["distance"][enclosed] *= -1
    rows["direction"][enclosed] *= -1


class PoseFunction:
    """The signed distances of pairs as a function of the poses of bodies, and its derivative the other way: what tandem.torch and tandem.jax wrap.

    Args:
        scene: whose bodies move; all others stand where they are.
        pairs: (m, 2) or array of PAIR.
        bodies: (n,), the numbers of the bodies that have poses, each once.
    """

    def __init__(self, scene: Scene, pairs: npt.ArrayLike, bodies: npt.ArrayLike) -> None:
        self._scene = scene
        given = pairs_of(pairs)
        if given is None:
            raise TypeError("pairs is None where pairs of bodies are wanted")
        self._pairs = given
        self._bodies = np.atleast_1d(whole_numbers(bodies, "bodies"))
        if len(np.unique(self._bodies)) != len(self._bodies):
            raise ValueError("bodies has a body twice")
        self.pair_count, self.body_count = len(given), len(self._bodies)
        order = np.argsort(self._bodies)
        self._sides = []  # sign, name of the point, rows of pairs, rows of bodies
        for sign, side in ((-1.0, "a"), (1.0, "b")):
            place = np.searchsorted(self._bodies, given[side], sorter=order)
            place = order[np.minimum(place, len(order) - 1)] if len(order) else np.zeros(len(given), int)
            moves = np.flatnonzero(self._bodies[place] == given[side]) if len(order) else np.zeros(0, int)
            self._sides.append((sign, f"in_{side}", moves, place[moves]))

    def find(self, rotation: Any, translation: Any) -> Rows:
        """Places the bodies, (n, 3, 3) and (n, 3), and returns an array of SIGNED_DISTANCE (m,)."""
        shapes, wanted = (np.shape(rotation), np.shape(translation)), ((self.body_count, 3, 3), (self.body_count, 3))
        if shapes != wanted:
            raise ValueError(f"rotation and translation have shapes {shapes} where {wanted} are wanted")
        self._scene.move(self._bodies, rotation=rotation, translation=translation)
        if not self.pair_count:
            return np.zeros(0, SIGNED_DISTANCE)
        return signed_distances(self._scene, pairs=self._pairs).distances

    def pull_back(self, found: Rows, weights: _Array) -> tuple[_Array, _Array]:
        """The derivative of the sum of weights (m,) times distances by the rotations, (n, 3, 3), and the translations, (n, 3).

        A pair's distance is direction . (R_b in_b + t_b - R_a in_a - t_a). The derivative takes direction, in_a and in_b as constants. They may be: of bodies
        apart, the points are the nearest and the direction is that between them, so to first order their change does not change the distance."""
        rotation, translation = np.zeros((self.body_count, 3, 3)), np.zeros((self.body_count, 3))
        forces = weights[:, None] * found["direction"]
        for sign, point, moves, body in self._sides:
            force = sign * forces[moves]
            np.add.at(translation, body, force)
            np.add.at(rotation, body, force[:, :, None] * found[point][moves, None, :])
        return rotation, translation


def rotation_and_translation(rotation: Any, translation: Any, transform: Any) -> tuple[Any, Any]:
    """The parts of poses (n, 4, 4), or those that are given instead, arrays of any library."""
    if (transform is None) == (rotation is None) or (rotation is None) != (translation is None):
        raise TypeError("rotation and translation are wanted, or transform instead of both")
    return (rotation, translation) if transform is None else (transform[..., :3, :3], transform[..., :3, 3])
