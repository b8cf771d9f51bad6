"""Bodies at their places and what is found between them: what `tandem.trimesh` is made of."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

import trimesh.triangles

from . import FIXED, INSIDE, INSTANCE, NO_INDEX, Asset, Error, Filter, Scene, build
from ._convex import Array, Overlap, Solid, cross, face_overlaps, overlap

RIGID = 4e-7  # what a pose may be off: scenes take 1e-6, by another measure of the same matrix
ROUNDING = 1e-5  # a matrix that is so near to a rotation is meant to be one
PRECISION = 1e-12  # of distances, relative
SMALL = 10_000  # faces of a mesh
FEW_PAIRS = 64  # whose distances are asked for at once
MEETING_STEPS = 32
IDENTITY = np.eye(3)
CONTACTS_AT_A_TIME = 1 << 16


@dataclass(slots=True)
class Contact:
    """The arguments of trimesh's ContactData: bodies a and b, in either order, their faces b1 and b2, and where, along what and how deep they meet. The normal
    points from a to b."""

    a: int
    b: int
    b1: int
    b2: int
    normal: Array
    pos: Array
    penetration_depth: float


@dataclass(slots=True)
class Nearest:
    """The arguments of trimesh's DistanceData: bodies a and b, how far apart they are, their nearest points, and the faces these are on."""

    a: int
    b: int
    min_distance: float
    nearest_points: Sequence[Array | None]
    b1: int
    b2: int


class Shape:
    """The shape of a mesh in scenes: an asset, and whether it is solid."""

    def __init__(self, vertices: Array, faces: Array, is_convex: bool) -> None:
        self.faces = faces
        self.is_convex = is_convex
        # Starting threads takes longer than to build a small tree.
        self.asset: Asset = build(vertices, faces, effort="fast", gpu_blocks=False, threads=1 if len(faces) < SMALL else 0)
        # The asset holds these coordinates.
        self.vertices: Array = (vertices - self.asset.origin).astype(np.float32) + self.asset.origin
        low, high = self.asset.bounds
        self.middle, self.half = (low + high) / 2, (high - low) / 2
        self._solid: Solid | None = None
        self._stretched: WeakValueDictionary[bytes, Shape] = WeakValueDictionary()
        self._last_stretched: Shape | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Returns the state of a mesh that is pickled. Stretched shapes stay behind: weak references cannot be."""
        return {name: value for name, value in vars(self).items() if name not in ("_stretched", "_last_stretched")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _stretched=WeakValueDictionary(), _last_stretched=None)

    @staticmethod
    def of(mesh: Any) -> Shape:
        """The shape of a trimesh.Trimesh, which the mesh keeps as long as it does not change."""
        is_convex = bool(mesh.is_convex)
        shape: Shape | None = mesh._cache["tandem"]
        if shape is None:
            shape = Shape(np.array(mesh.vertices, np.float64), np.array(mesh.faces), is_convex)
            mesh._cache["tandem"] = shape
        return shape

    def stretched(self, stretch: Array) -> Shape:
        """The shape with every vertex v at stretch v. Those that bodies have are kept, and the last one."""
        key = stretch.tobytes()
        made = self._stretched.get(key)
        if made is None:
            # Mirrored triangles would face inwards.
            faces = self.faces if np.linalg.det(stretch) > 0 else self.faces[:, ::-1]
            made = self._stretched[key] = Shape(self.vertices @ stretch.T, faces, self.is_convex)
        self._last_stretched = made
        return made

    def solid(self) -> Solid:
        """The convex hull."""
        if self._solid is None:
            self._solid = Solid(self.vertices[np.unique(self.faces)])
        return self._solid


def _rotation_and_stretch(matrix: Array) -> tuple[Array, Array | None]:
    """The rotation and the symmetric stretch, None where there is none, whose product a matrix (3, 3) is. Digits beyond the twelfth of the stretch are
    dropped, so that a stretched body that turns keeps its shape."""
    left, sizes, right = np.linalg.svd(matrix)
    rotation = left @ right
    stretch = right.T * sizes @ right
    if np.linalg.det(rotation) < 0:
        rotation, stretch = -rotation, -stretch
    if np.abs(stretch - np.eye(3)).max() <= ROUNDING:
        return rotation, None
    unit = 2.0 ** np.ceil(np.log2(sizes[0])) if sizes[0] > 0 else 1.0
    return rotation, np.round(stretch / unit, 12) * unit + 0.0  # not -0


#: The pairs that are asked about, see Search: first_side, alone and ignored.
Asked = tuple[int | None, int | None, tuple[tuple[int, int], ...]]


class Bodies:
    """Shapes at places, with names. The places are (4, 4) matrices.

    Attributes: `rows`, array of tandem.INSTANCE; `given`, the shapes that were given; `shapes`, those that the rows' assets are of: stretched where a place
    stretches; `convex` (n,), which are; `ours`, of joined ones, the first.
    """

    ours: Bodies | None = None

    def __init__(self, names: list[Hashable], shapes: list[Shape], places: list[Array]) -> None:
        self.names = names
        self.given = shapes
        self.rows = np.zeros(len(names), INSTANCE)
        self.convex = np.array([shape.is_convex for shape in shapes], bool)
        self.shapes = list(shapes)
        self._solids: dict[int, Solid] = {}
        self._name_assets()
        self.move(range(len(names)), places)

    def _name_assets(self) -> None:
        different = list({id(shape): shape for shape in self.shapes}.values())
        numbers = {id(shape): number for number, shape in enumerate(different)}
        self.rows["asset"] = [numbers[id(shape)] for shape in self.shapes]
        self.assets = [shape.asset for shape in different]
        self._middle, self._half = (np.array([getattr(shape, name) for shape in different]).reshape(-1, 3) for name in ("middle", "half"))
        self._scene: Scene | None = None
        self._asked: Asked | None = None  # that the scene's filter is of; None: the bodies are yet to be placed there
        self._moved: set[int] = set()  # since they were placed there

    @staticmethod
    def joined(ours: Bodies, theirs: Bodies, former: Bodies | None) -> Bodies:
        """Returns both, ours first. Takes the scene of the former result where that is of the same assets."""
        both = object.__new__(Bodies)
        both.ours = ours
        both.names = ours.names + theirs.names
        both.given = ours.given + theirs.given
        both.shapes = ours.shapes + theirs.shapes
        both.convex = np.concatenate([ours.convex, theirs.convex])
        both.rows = np.concatenate([ours.rows, theirs.rows])
        both._solids = {}
        both._name_assets()
        if former is not None and _same(former.assets, both.assets):
            both._scene = former._scene
        return both

    def move(self, bodies: Sequence[int], places: list[Array]) -> None:
        """Puts bodies at other places. Raises ValueError where one is not finite."""
        if not places:
            return
        matrices = np.array(places)
        linear = matrices[:, :3, :3]
        self.rows["rotation"][bodies] = linear
        self.rows["translation"][bodies] = matrices[:, :3, 3]
        if not np.isfinite(matrices[:, :3]).all():
            first = int(np.isfinite(matrices[:, :3]).all(axis=(1, 2)).argmin())
            raise ValueError(f"the transform of {self.names[bodies[first]]} is not finite")
        off = np.abs(linear.transpose(0, 2, 1) @ linear - IDENTITY).max(axis=(1, 2))
        rigid = ((off <= RIGID) & (np.linalg.det(linear) > 0)).tolist()
        shapes = [self.given[body] if rigid[i] else self._turned(body, linear[i]) for i, body in enumerate(bodies)]
        same = _same(shapes, [self.shapes[body] for body in bodies])
        for body, shape in zip(bodies, shapes):
            self.shapes[body] = shape
            self._solids.pop(body, None)
        self._moved.update(bodies)
        if not same:
            self._name_assets()

    def _turned(self, body: int, linear: Array) -> Shape:
        """The shape of a body whose place is not rigid; its rotation goes into the rows."""
        self.rows["rotation"][body], stretch = _rotation_and_stretch(linear)
        if stretch is None:
            return self.given[body]
        try:
            return self.given[body].stretched(stretch)
        except Error as error:
            message = f"{self.names[body]}, stretched by its transform: {error}"
            raise Error(message, error.status, error.name, error.subject, error.where) from error

    def scene(self, asked: Asked, threads: int) -> Scene:
        """The bodies where they stand, and with a filter that asks about some pairs."""
        if self._scene is None:
            self._scene = Scene(self.assets, threads=threads)
        if self._asked != asked:
            self._asked = None  # until it is done
            self._scene.place(self.rows, filter=self._filter(*asked))
        elif self._moved:
            moved = sorted(self._moved)
            self._scene.move(moved, self.rows[moved])
        self._asked = asked
        self._moved.clear()
        return self._scene

    def _filter(self, first_side: int | None, alone: int | None, ignored: tuple[tuple[int, int], ...]) -> Filter | None:
        if first_side is None and alone is None:
            return Filter(excluded=ignored) if ignored else None
        sides = np.ones(len(self.names), np.uint32)
        sides[slice(first_side, None) if alone is None else alone] = 2
        # The first side stands still from call to call, as far as the scene is to know: it finds no pairs within it.
        return Filter(motion=np.where(sides == 1, FIXED, 0), group=sides, mask=3 - sides, excluded=ignored or None)

    def solid(self, body: int) -> Solid:
        """The convex hull of a body where it stands."""
        if body not in self._solids:
            row = self.rows[body]
            self._solids[body] = self.shapes[body].solid().moved(row["rotation"], row["translation"])
        return self._solids[body]

    def corners(self, body: int, faces: Array) -> Array:
        """(n, 3, 3) of faces of a body where it stands."""
        row, shape = self.rows[body], self.shapes[body]
        corners: Array = shape.vertices[shape.faces[faces]] @ row["rotation"].T + row["translation"]
        return corners

    def corners_of(self, bodies: Array, faces: Array) -> Array:
        """(n, 3, 3) of a face each of n bodies."""
        corners = np.empty((len(faces), 3, 3))
        order = np.argsort(bodies, kind="stable")
        bounds = np.flatnonzero(np.diff(bodies[order], prepend=-1, append=-1))
        for first, last in zip(bounds[:-1], bounds[1:]):
            rows = order[first:last]
            corners[rows] = self.corners(int(bodies[rows[0]]), faces[rows])
        return corners

    def boxes(self) -> tuple[Array, Array]:
        """(n, 3) the least and the greatest coordinates of boxes that the bodies lie in."""
        asset, rotation = self.rows["asset"], self.rows["rotation"]
        middles = np.einsum("nij,nj->ni", rotation, self._middle[asset]) + self.rows["translation"]
        halves = np.einsum("nij,nj->ni", np.abs(rotation), self._half[asset])
        return middles - halves, middles + halves


def _same(some: Sequence[object], others: Sequence[object]) -> bool:
    return len(some) == len(others) and all(one is other for one, other in zip(some, others))


class Search:
    """A question about pairs of bodies: of all; of the first `first_side` with the others; or of the body `alone` with the others. Never of `ignored` pairs."""

    def __init__(self, bodies: Bodies, threads: int, first_side: int | None = None, alone: int | None = None, ignored: list[tuple[int, int]] | None = None) -> None:
        self.bodies = bodies
        count = len(bodies.names)
        self._pair_count = count * (count - 1) // 2
        if first_side is not None or alone is not None:
            second = 1 if first_side is None else count - first_side
            self._pair_count = second * (count - second)
        self._pair_count -= sum(alone is None or alone in pair for pair in ignored or ())
        self._asked: Asked = (first_side, alone, tuple(ignored or ()))
        self._threads = threads

    def _scene(self) -> Scene:
        return self.bodies.scene(self._asked, self._threads)

    def any_collision(self) -> bool:
        """Returns whether there is one."""
        if self._pair_count == 0:
            return False
        found = self._scene().contacts(first_contact_only=True)
        return len(found.contacts) > 0 or bool(len(found.pairs) and self._enclosed_pairs(_columns(found.pairs)))

    def colliding_pairs(self) -> set[tuple[int, int]]:
        """The pairs of bodies (a, b), a < b, that collide: whose surfaces meet, or one of whom is convex and has a component of the other inside."""
        if self._pair_count == 0:
            return set()
        found = self._scene().contacts(first_contact_only=True)
        pairs = _columns(found.pairs)
        meet = np.zeros(len(pairs), bool)
        meet[found.contacts["pair"]] = True
        return set(map(tuple, pairs[meet].tolist())) | self._enclosed_pairs(pairs[~meet])

    def contacts(self) -> Iterator[Contact]:
        """All contacts: one for each pair of convex bodies; of a convex body and another one for each face of the other that meets the solid; one for each
        pair of faces of others that meet."""
        if self._pair_count == 0:
            return
        scene = self._scene()
        found = scene.contacts()
        contained = scene.contained().contained
        pairs = _columns(found.pairs)
        bounds = np.searchsorted(found.contacts["pair"], np.arange(len(pairs) + 1))
        convex = self.bodies.convex[pairs]
        is_open: Array = ~(convex[:, 0] | convex[:, 1])
        meet = np.diff(bounds) > 0
        yield from self._surface_contacts(pairs, found.contacts[is_open[found.contacts["pair"]]])
        meet[self._enclosed(pairs, contained)] = True
        for pair in np.flatnonzero(meet & ~is_open):
            a, b = map(int, pairs[pair])
            if convex[pair].all():
                yield self._convex_contact(a, b)
            else:
                yield from self._face_contacts(a, b, found.contacts[bounds[pair] : bounds[pair + 1]])

    def nearest(self) -> Nearest | None:
        """The pair that is nearest, or the deepest of those that collide; None where there is no pair. Of equals the first."""
        if self._pair_count == 0:
            return None
        colliding = self.colliding_pairs()
        if colliding:
            return self._deepest(np.array(sorted(colliding)))
        scene = self._scene()
        lows, highs = self.bodies.boxes()
        extent = float(np.linalg.norm(highs.max(axis=0) - lows.min(axis=0)))
        reach = None
        if self._pair_count > FEW_PAIRS:
            pair = self._nearest_boxes(lows, highs)
            # If one body is asked about with many, the reach takes all that can be as near as the one whose box is the nearest.
            reach = extent / 256 if pair is None else float(scene.distances(pairs=[pair]).distances["upper"][0])
        while True:
            found = scene.distances(reach=reach, relative_tolerance=PRECISION)
            distances = found.distances["upper"].copy()
            distances[found.distances["triangle_a"] == NO_INDEX] = np.inf
            # A pair that is not in the list, or has no points, is farther apart than the reach.
            if len(distances) and distances.min() <= (np.inf if reach is None else reach):
                first = int(distances.argmin())
                return _nearest(found.pairs[first], found.distances[first])
            assert reach is not None
            reach = 4 * reach if reach < extent else None

    def _nearest_boxes(self, lows: Array, highs: Array) -> tuple[int, int] | None:
        """Returns one body and, of the others that it is asked about with, the one whose box is the nearest; else None."""
        first_side, body, ignored = self._asked
        if first_side == len(lows) - 1:
            body = first_side
        if body is None:
            return None
        gaps = np.maximum(np.maximum(lows - highs[body], lows[body] - highs), 0)
        squares = np.einsum("ni,ni->n", gaps, gaps)
        squares[[body, *(other for pair in ignored if body in pair for other in pair)]] = np.inf
        other = int(squares.argmin())
        return min(body, other), max(body, other)

    def _deepest(self, pairs: Array) -> Nearest:
        """Returns the deepest of the pairs (n, 2) that collide, the first of equals."""
        lows, highs = self.bodies.boxes()
        a, b = pairs.T
        # No two convex bodies are deeper than their boxes, others have no depth; of a convex body and another each has to be looked at.
        bounds = np.minimum(highs[a] - lows[b], highs[b] - lows[a]).min(axis=1)
        convex = self.bodies.convex[pairs]
        bounds[~convex.all(axis=1)] = np.inf
        bounds[~convex.any(axis=1)] = 0
        deepest: Nearest | None = None
        for row in np.argsort(-bounds, kind="stable"):
            if deepest is not None and bounds[row] <= -deepest.min_distance:
                break
            found = self._collision(*map(int, pairs[row]))
            if deepest is None or (found.min_distance, found.a, found.b) < (deepest.min_distance, deepest.a, deepest.b):
                deepest = found
        assert deepest is not None
        return deepest

    def _enclosed_pairs(self, apart: Array) -> set[tuple[int, int]]:
        """Returns those of pairs (n, 2), whose surfaces do not meet, that have a component of one body inside the other, convex body."""
        if not self.bodies.convex.any():
            return set()
        apart = apart[self.bodies.convex[apart].any(axis=1)]
        if len(apart) == 0:
            return set()
        scene = self._scene()
        scene.contacts(pairs=apart)
        rows = self._enclosed(apart, scene.contained().contained)
        return set(map(tuple, apart[rows].tolist()))

    def _enclosed(self, pairs: Array, contained: Array) -> Array:
        """(n,) the rows of the pairs with a component of one body inside the other, which is convex."""
        outer = pairs[contained["pair"], np.where(contained["inner"] == 1, 0, 1)]
        rows: Array = contained["pair"][self.bodies.convex[outer] & (contained["flags"] & INSIDE > 0)]
        return rows

    def _collision(self, a: int, b: int) -> Nearest:
        convex = self.bodies.convex[[a, b]]
        if convex.all():
            solids = self.bodies.solid(a), self.bodies.solid(b)
            found = overlap(*solids)
            return Nearest(a, b, -found.depth, [found.point_a, found.point_b], *self._faces(a, b, found))
        scene, pair = self._scene(), [(a, b)]
        if convex.any():
            meeting = scene.contacts(pairs=pair).contacts
            deepest = max(self._face_contacts(a, b, meeting), key=lambda contact: contact.penetration_depth)
            half = deepest.normal * deepest.penetration_depth / 2
            ends = [(deepest.a, deepest.pos + half, deepest.b1), (deepest.b, deepest.pos - half, deepest.b2)]
            (_, point_a, face_a), (_, point_b, face_b) = sorted(ends, key=lambda end: end[0])
            return Nearest(a, b, -deepest.penetration_depth, [point_a, point_b], face_a, face_b)
        return _nearest((a, b), scene.distances(pairs=pair).distances[0])

    def _faces(self, a: int, b: int, found: Overlap) -> tuple[int, int]:
        """The faces of two convex bodies whose corners are the farthest along the way that parts them; of equals the first."""
        ends = []
        for body, side in ((a, 1.0), (b, -1.0)):
            faces = np.arange(len(self.bodies.shapes[body].faces))
            along = (self.bodies.corners(body, faces) @ (side * found.normal)).min(axis=1)
            ends.append(int(np.flatnonzero(along >= along.max() - 1e-9 * self.bodies.solid(body).size)[0]))
        return ends[0], ends[1]

    def _convex_contact(self, a: int, b: int) -> Contact:
        found = overlap(self.bodies.solid(a), self.bodies.solid(b))
        return Contact(a, b, *self._faces(a, b, found), found.normal, found.middle, found.depth)

    def _face_contacts(self, a: int, b: int, meeting: Array) -> Iterator[Contact]:
        """Yields the contacts of a convex body and another: the other's faces that meet its surface, then those inside. As in python-fcl, normals point from
        the other to the convex one, whichever is a."""
        a_is_solid = bool(self.bodies.convex[a])
        body, other = (a, b) if a_is_solid else (b, a)
        solid_column, face_column = ("face_a", "face_b") if a_is_solid else ("face_b", "face_a")
        crossing, first = np.unique(meeting[face_column], return_index=True)
        solid = self.bodies.solid(body)
        inner = np.setdiff1d(np.arange(len(self.bodies.shapes[other].faces)), crossing)
        # A face that does not meet the surface is inside where its middle is.
        middles = self.bodies.corners(other, inner).mean(axis=1)
        inside = solid.contains(middles)
        if len(crossing) == 0 and not inside.any():
            inside[solid.nearest(middles)] = True  # rounding moved it out of the hull
        faces = np.concatenate([crossing, inner[inside]])
        corners = self.bodies.corners(other, faces)
        depths, normals, planes = face_overlaps(solid, corners)
        points = corners.mean(axis=1)
        solid_faces = meeting[solid_column][first]
        points[: len(crossing)] = meeting_points(self.bodies.corners(body, solid_faces), corners[: len(crossing)])
        solid_faces = np.concatenate([solid_faces, self._faces_of_planes(body, solid, planes[len(crossing) :])])
        rows = zip(faces.tolist(), solid_faces.tolist(), -normals, points, depths.tolist())
        for row in rows:
            yield Contact(other, body, *row)

    def _faces_of_planes(self, body: int, solid: Solid, planes: Array) -> Array:
        """(n,) of each of the planes of a solid, by number, a face of the mesh that is the nearest to it."""
        corners = self.bodies.corners(body, np.arange(len(self.bodies.shapes[body].faces)))
        found = {int(plane): int((corners @ solid.normals[plane]).min(axis=1).argmax()) for plane in np.unique(planes)}
        return np.array([found[int(plane)] for plane in planes], np.intp)

    def _surface_contacts(self, pairs: Array, meeting: Array) -> Iterator[Contact]:
        """Yields the contacts of bodies that are not convex. Normal and depth are those of the contact region that is the nearest; where there is none, of
        which the surfaces touch in a point, the normal is that of a's face."""
        if len(meeting) == 0:
            return
        a, b = pairs[meeting["pair"]].T
        points, normals, depths = np.empty((len(meeting), 3)), np.empty((len(meeting), 3)), np.zeros(len(meeting))
        for first in range(0, len(meeting), CONTACTS_AT_A_TIME):
            rows = slice(first, first + CONTACTS_AT_A_TIME)
            corners_a = self.bodies.corners_of(a[rows], meeting["face_a"][rows])
            corners_b = self.bodies.corners_of(b[rows], meeting["face_b"][rows])
            points[rows] = meeting_points(corners_a, corners_b)
            normals[rows] = unit_normals(corners_a)
        found = self._scene().manifolds(match_previous=False)
        regions, places = found.manifolds, found.points["position"]
        which, starts = np.unique(meeting["pair"], return_index=True)
        for pair, start, end in zip(which, starts, np.append(starts[1:], len(meeting))):
            first, last = np.searchsorted(regions["pair"], [pair, pair + 1])
            own = regions[first:last]
            if len(own) == 0:
                continue
            begin = int(own["first_point"][0])
            region_of_point = np.repeat(np.arange(len(own)), own["point_count"])
            region = np.zeros(end - start, np.intp)
            if len(own) > 1:
                gaps = points[start:end, None] - places[begin : begin + len(region_of_point)]
                region = region_of_point[np.einsum("ijk,ijk->ij", gaps, gaps).argmin(axis=1)]
            normals[start:end], depths[start:end] = own["normal"][region], own["depth"][region]
        bodies = zip(a.tolist(), b.tolist(), meeting["face_a"].tolist(), meeting["face_b"].tolist())
        for faces, normal, point, depth in zip(bodies, normals, points, depths.tolist()):
            yield Contact(*faces, normal, point, depth)


def _columns(pairs: Array) -> Array:
    """(n, 2) intp of an array of tandem.PAIR."""
    columns: Array = np.stack([pairs["a"], pairs["b"]], axis=1).astype(np.intp)
    return columns


def _nearest(pair: Any, row: Any) -> Nearest:
    return Nearest(int(pair[0]), int(pair[1]), float(row["upper"]), [row["point_a"].copy(), row["point_b"].copy()], int(row["face_a"]), int(row["face_b"]))


def unit_normals(corners: Array) -> Array:
    """(n, 3) of triangles (n, 3, 3)."""
    normals: Array = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    return normals


def meeting_points(a: Array, b: Array) -> Array:
    """(n, 3) a point of both triangles of each of n pairs that meet, a and b (n, 3, 3): the middle of where the edges of one go through the other. Of
    triangles in one plane, and where rounding hides the crossing, what going to and fro between the nearest points of both comes to."""
    total, count = np.zeros((len(a), 3)), np.zeros(len(a))
    for edges, other in ((a, b), (b, a)):
        origin, u, v = other[:, 0], other[:, 1] - other[:, 0], other[:, 2] - other[:, 0]
        normal = cross(u, v)
        square = np.maximum((normal * normal).sum(axis=1), np.finfo(float).tiny)[:, None]
        # These give s and t of a point origin + s u + t v of the plane.
        to_s, to_t = cross(v, normal) / square, cross(normal, u) / square
        heights = np.einsum("nij,nj->ni", edges - origin[:, None], normal)
        ends, heights_of_ends = np.roll(edges, -1, axis=1), np.roll(heights, -1, axis=1)
        crosses = heights * heights_of_ends < 0
        part = heights / np.where(crosses, heights - heights_of_ends, 1)
        points = edges + part[:, :, None] * (ends - edges)
        s, t = (np.einsum("nij,nj->ni", points - origin[:, None], to) for to in (to_s, to_t))
        hit = crosses & (s >= 0) & (t >= 0) & (s + t <= 1)
        total += (points * hit[:, :, None]).sum(axis=1)
        count += hit.sum(axis=1)
    middles: Array = total / np.maximum(count, 1)[:, None]
    rest = count == 0
    if rest.any():
        near = a[rest].mean(axis=1)
        for triangles in MEETING_STEPS * (b[rest], a[rest]):
            near = trimesh.triangles.closest_point(triangles, near)  # type: ignore[no-untyped-call]
        middles[rest] = near
    return middles
