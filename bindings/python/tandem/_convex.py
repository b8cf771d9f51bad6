"""Finds how deep convex bodies overlap, for `tandem.trimesh`. Needs SciPy, as trimesh does to tell that a mesh is convex."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull, QhullError  # type: ignore[import-untyped]

Array = npt.NDArray[Any]

FIRST_DIRECTIONS = 16  # of a body's faces, about so many
FEW_CROSSINGS = 600  # of an edge of one body and one of the other
CHUNK = 1 << 22  # numbers of a matrix that are there at a time


def cross(u: Array, v: Array) -> Array:
    """The cross products of vectors (..., 3); of few vectors NumPy 2's own takes twice as long, or more."""
    products: Array = np.empty(np.broadcast_shapes(u.shape, v.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[..., i] = u[..., j] * v[..., k] - u[..., k] * v[..., j]
    return products


@dataclass(frozen=True, slots=True)
class Overlap:
    """The shortest way to part two bodies. Lengths are in the bodies' unit."""

    depth: float  #: length of that way
    normal: Array  #: (3,) its unit vector, along which b goes
    point_a: Array  #: (3,) of a's surface, deepest in b
    point_b: Array  #: (3,) of b's surface: point_a - depth * normal

    @property
    def middle(self) -> Array:
        """(3,) half-way between the two points."""
        return (self.point_a + self.point_b) / 2


class Solid:
    """The convex hull of points: `vertices` (n, 3); `normals` (k, 3) and `offsets` (k,) of its faces, outside of which normal . x > offset; `edges` (m, 3), the
    directions of its edges, parallel ones once; `size`, the diagonal of its bounds."""

    def __init__(self, vertices: Array) -> None:
        hull = _hull(vertices)
        self.vertices = np.ascontiguousarray(vertices[hull.vertices])
        # Triangles of one face have the same plane to the bit.
        planes, face = np.unique(hull.equations, axis=0, return_inverse=True)
        face = face.reshape(-1)
        self.normals, self.offsets = planes[:, :3], -planes[:, 3]
        # The edge across from corner k of a triangle is that with its neighbour k.
        triangle, corner = np.nonzero(face[:, None] < face[hull.neighbors])
        ends = vertices[hull.simplices[triangle[:, None], (corner[:, None] + [1, 2]) % 3]]
        ways = ends[:, 1] - ends[:, 0]
        ways /= np.maximum(np.linalg.norm(ways, axis=1), np.finfo(float).tiny)[:, None]
        leading = np.take_along_axis(ways, np.abs(ways).argmax(axis=1)[:, None], axis=1)
        self.edges: Array = ways[np.unique(np.round(ways * np.sign(leading), 9), axis=0, return_index=True)[1]]
        self.size = float(np.linalg.norm(np.ptp(vertices, axis=0)))

    def moved(self, rotation: Array, translation: Array) -> Solid:
        """The body at a pose: rotation (3, 3), translation (3,)."""
        body = object.__new__(Solid)
        body.vertices = self.vertices @ rotation.T + translation
        body.normals = self.normals @ rotation.T
        body.offsets = self.offsets + body.normals @ translation
        body.edges = self.edges @ rotation.T
        body.size = self.size
        return body

    def _heights(self, points: Array) -> Array:
        """(n,) how far points (n, 3) are outside of the plane of a face, at most; negative: inside."""
        heights = np.empty(len(points))
        for rows in _chunks(len(points), len(self.offsets)):
            heights[rows] = (points[rows] @ self.normals.T - self.offsets).max(axis=1)
        return heights

    def contains(self, points: Array, margin: float = 0.0) -> Array:
        """(n,) whether each of the points (n, 3) is inside or no farther than `margin` outside of all faces' planes."""
        if margin > 0:
            return np.asarray(self._heights(points) <= margin)
        room = 1e-6 * self.size  # for rounding: what is outside of the box needs no look at the planes
        inside: Array = ((points >= self.vertices.min(axis=0) - room) & (points <= self.vertices.max(axis=0) + room)).all(axis=1)
        inside[inside] = self._heights(points[inside]) <= margin
        return inside

    def nearest(self, points: Array) -> int:
        """Returns which of the points (n, 3) is the deepest inside, or the least far outside of a face's plane."""
        return int(self._heights(points).argmin())


def _hull(points: Array, incremental: bool = False) -> Any:
    try:
        return ConvexHull(points, incremental)
    except QhullError:
        return ConvexHull(points, incremental, "QJ")  # flat to rounding: points are moved by as much


def _chunks(rows: int, columns: int) -> list[slice]:
    step = max(1, CHUNK // max(columns, 1))
    return [slice(first, first + step) for first in range(0, rows, step)]


def _farthest(vertices: Array, directions: Array) -> Array:
    """(m,) which of the vertices is the farthest along each of the directions (m, 3)."""
    found = np.empty(len(directions), np.intp)
    for rows in _chunks(len(directions), len(vertices)):
        found[rows] = (directions[rows] @ vertices.T).argmax(axis=1)
    return found


def overlap(a: Solid, b: Solid) -> Overlap:
    """The shortest way that parts two solids that meet.

    The differences of the points of a and those of b are a convex body D; moving b along n parts them as soon as it goes beyond D's farthest point along n.
    The least such distance is that of a face of D. Of equally short ways it is the one whose normal comes first in the order of coordinates, so that the
    answer does not depend on rounding.
    """
    tolerance = 1e-10 * (a.size + b.size)
    normals, ways = (_all_ways if len(a.edges) * len(b.edges) <= FEW_CROSSINGS else _nearest_ways)(a, b, tolerance)
    shortest = np.round(normals[ways <= ways.min() + tolerance], 12)
    normal = shortest[np.lexsort(shortest.T[::-1])[0]]
    depth = max(0.0, float((a.vertices @ normal).max() - (b.vertices @ normal).min()))
    point_a = _deepest_point(a, b, depth, normal, 10 * tolerance)
    return Overlap(depth, normal, point_a, point_a - depth * normal)


def _all_ways(a: Solid, b: Solid, tolerance: float) -> tuple[Array, Array]:
    """Directions (n, 3), among them the normals of all faces of D, and (n,) how far D goes along each: its faces are those of a, those of b turned round, and
    parallelograms of an edge each."""
    crosses = cross(a.edges[:, None], b.edges[None]).reshape(-1, 3)
    lengths = np.linalg.norm(crosses, axis=1)
    crosses = crosses[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    normals = np.concatenate([a.normals, -b.normals, crosses, -crosses])
    return normals, (a.vertices @ normals.T).max(axis=0) - (b.vertices @ normals.T).min(axis=0)


def _nearest_ways(a: Solid, b: Solid, tolerance: float) -> tuple[Array, Array]:
    """Directions (n, 3) of D's nearest faces, and (n,) how far D goes along each.

    D is approached from within by the hull of those of its points that are the farthest along some direction: where no face of the hull that is nearer than
    the best direction so far has a point of D beyond it, that direction is the best of all.
    """

    def supports(directions: Array) -> Array:
        points: Array = a.vertices[_farthest(a.vertices, directions)] - b.vertices[_farthest(b.vertices, -directions)]
        return points

    points = supports(np.concatenate([body[:: 1 + len(body) // FIRST_DIRECTIONS] for body in (a.normals, -b.normals)]))
    if np.linalg.matrix_rank(points - points[0], tolerance) < 3:
        points = np.concatenate([points, a.vertices - b.vertices[0]])  # which spans space as a does
    shortest = np.inf  # of the ways that were tried
    hull = _hull(points, incremental=True)
    while True:
        normals, offsets = hull.equations[:, :3], -hull.equations[:, 3]
        near = offsets <= shortest + tolerance
        normals, offsets = normals[near], offsets[near]
        found = supports(normals)
        ways = (found * normals).sum(axis=1)
        shortest = min(shortest, float(ways.min()))
        beyond = (ways > offsets + tolerance) & (offsets <= shortest + tolerance)
        if not beyond.any():
            return normals, ways
        hull.add_points(found[beyond])


def _deepest_point(a: Solid, b: Solid, depth: float, normal: Array, tolerance: float) -> Array:
    """(3,) a point of a that touches b once b has gone `depth` along the normal: the first vertex that does, where one does."""
    along_a, along_b = a.vertices @ normal, b.vertices @ normal
    deepest_a = a.vertices[along_a >= along_a.max() - tolerance]
    deepest_b = b.vertices[along_b <= along_b.min() + tolerance]
    shift = depth * normal
    touching: Array = np.concatenate([deepest_a[b.contains(deepest_a - shift, tolerance)], deepest_b[a.contains(deepest_b + shift, tolerance)] + shift])
    if len(touching) == 0:
        # Edges cross: weights of the vertices of either side, each of sum 1, with one middle.
        one = a.size + b.size
        sums = np.zeros((2, len(deepest_a) + len(deepest_b)))
        sums[0, : len(deepest_a)] = sums[1, len(deepest_a) :] = one
        columns = np.concatenate([np.concatenate([deepest_a, -deepest_b]).T, sums])
        weights = nnls(columns, np.r_[shift, one, one])[0][: len(deepest_a)]
        touching = (weights @ deepest_a / weights.sum())[None]
    first: Array = touching[0]
    return first


def face_overlaps(solid: Solid, corners: Array) -> tuple[Array, Array, Array]:
    """Finds how triangles (n, 3, 3) that meet a solid are parted from it along the normal of one of its faces, or their own: of these ways the shortest. That
    is the shortest way of all unless one across two edges is shorter.

    Returns depths (n,), normals (n, 3), along which the triangle goes, and (n,) which plane of the solid is the nearest along it.
    """
    count = len(corners)
    depths, planes = np.empty(count), np.empty(count, np.intp)
    for rows in _chunks(count, 3 * len(solid.offsets)):
        ways = solid.offsets - (corners[rows] @ solid.normals.T).min(axis=1)
        planes[rows] = ways.argmin(axis=1)
        depths[rows] = ways.min(axis=1)
    normals = solid.normals[planes]
    crosses = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own = crosses / np.maximum(np.linalg.norm(crosses, axis=1), np.finfo(float).tiny)[:, None]
    heights = (own * corners[:, 0]).sum(axis=1)
    for side in (own, -own):
        ways = np.empty(count)
        for rows in _chunks(count, len(solid.vertices)):
            ways[rows] = (side[rows] @ solid.vertices.T).max(axis=1)
        ways -= heights if side is own else -heights
        better = ways < depths - 1e-12 * solid.size
        depths[better], normals[better] = ways[better], side[better]
    return np.maximum(depths, 0.0), normals, planes
