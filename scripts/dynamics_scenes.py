"""Scenes of scripts/dynamics_peers: bodies of boxes and other convex shapes on a ground. Lengths are metres."""
import functools
import itertools

import numpy as np

JITTER = 5e-4
OVERLAP = 1e-5  # so that engines find contacts from the start


class Hull:
    """The convex hull of some points, of which no four lie in a plane but on a face of four; the centroid is moved to the origin."""
    lengths = None

    def __init__(self, points):
        points = np.asarray(points, float)
        self.triangles = hull_triangles(points)
        corners = points[self.triangles]
        parts = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        self.volume = parts.sum()
        self.points = points - (parts[:, None] * corners.sum(axis=1)).sum(axis=0) / 4 / self.volume


class Cuboid(Hull):
    def __init__(self, lengths):
        super().__init__([[s * length / 2 for s, length in zip(signs, lengths)] for signs in itertools.product((-1, 1), repeat=3)])
        self.lengths = lengths


def hull_triangles(points):
    """Triangles, counterclockwise seen from outside: a face of more corners is a fan."""
    faces = {}
    scale = np.ptp(points, axis=0).max()
    for a, b, c in itertools.combinations(range(len(points)), 3):
        normal = np.cross(points[b] - points[a], points[c] - points[a])
        heights = (points - points[a]) @ normal / np.linalg.norm(normal) / scale
        if heights.max() < 1e-9 or heights.min() > -1e-9:
            faces[tuple(np.flatnonzero(abs(heights) < 1e-9))] = normal if heights.max() < 1e-9 else -normal
    triangles = []
    for corners, normal in faces.items():
        corners = np.array(corners)
        out = points[corners] - points[corners].mean(axis=0)
        along = out[0] / np.linalg.norm(out[0])
        across = np.cross(normal / np.linalg.norm(normal), along)
        ring = corners[np.argsort(np.arctan2(out @ across, out @ along))]
        triangles += [(ring[0], ring[i], ring[i + 1]) for i in range(1, len(ring) - 1)]
    return np.array(triangles)


class Body:
    """A body to come: its shape, where its centroid is, density (0: fixed), velocities, and how it is turned, a quaternion w x y z."""

    def __init__(self, shape, at, density=1000, velocity=(0, 0, 0), turn=(1, 0, 0, 0), spin=(0, 0, 0)):
        self.shape, self.at, self.density, self.velocity, self.turn, self.spin = shape, np.array(at, float), density, velocity, turn, spin
        self.mass = density * shape.volume


CUBE, PLATE, TARGET, DOMINO = Cuboid((1, 1, 1)), Cuboid((1, 1, 0.01)), Cuboid((2, 2, 0.01)), Cuboid((0.2, 1, 2))
GROUND = Body(Cuboid((300, 40, 2)), (0, 0, -1), 0)


def layer(i):
    """The height of the centre of a cube of layer i."""
    return i + 0.5 - OVERLAP * (i + 1)


def tower(count, ratio=1, jitter=0.0):
    random = np.random.default_rng(1)
    return [GROUND] + [Body(CUBE, [*random.uniform(-jitter, jitter, 2), layer(i)], 1000 * (ratio if i == count - 1 else 1)) for i in range(count)]


def stack(side):
    """Cubes face to face, each moved by up to the jitter."""
    random = np.random.default_rng(1)
    return [GROUND] + [Body(CUBE, [*(np.array([x, y]) + random.uniform(-JITTER, JITTER, 2)), layer(z)]) for z in range(side) for y in range(side) for x in range(side)]


def pyramid(base):
    """A wall of cubes, each on two: that of Box3D's benchmark large_pyramid where base is 100."""
    return [GROUND] + [Body(CUBE, [x + 0.5 * (i - base + 1), 0, layer(i)]) for i in range(base) for x in range(base - i)]


def arch(count=15, inner=4.0, outer=5.0):
    """Half a ring of wedges that stands on the ground by friction alone."""
    angle, ring = np.pi / count, [GROUND]
    half = 0.5 * angle + OVERLAP / (inner + outer)
    wedge = Hull([[radius * np.sin(s * half), y, radius * np.cos(half)] for radius in (inner, outer) for s in (-1, 1) for y in (-0.5, 0.5)])
    centre = inner * np.cos(half) - wedge.points[:, 2].min()  # distance of the centroid from the middle of the ring
    for i in range(count):
        turned = (i + 0.5) * angle - 0.5 * np.pi
        ring.append(Body(wedge, [centre * np.sin(turned), 0, centre * np.cos(turned)], turn=(np.cos(turned / 2), 0, np.sin(turned / 2), 0)))
    return ring


def dominoes(count=50, lean=np.radians(10)):
    """A row of which the first falls on the next."""
    row = [GROUND] + [Body(DOMINO, [i - count / 2, 0, 1 - OVERLAP]) for i in range(count)]
    foot, (x, z) = row[1].at + [0.1, 0, -1], (-0.1, 1)
    row[1] = Body(DOMINO, foot + [x * np.cos(lean) + z * np.sin(lean), 0, z * np.cos(lean) - x * np.sin(lean)], turn=(np.cos(lean / 2), 0, np.sin(lean / 2), 0))
    return row


def heap(count=300, kinds=10):
    """Convex bodies of 16 corners, up to 1 m long, that fall on the ground from columns of 5 by 5, turned at random."""
    random = np.random.default_rng(1)

    def directions(n, dimensions):
        ways = random.normal(size=(n, dimensions))
        return ways / np.linalg.norm(ways, axis=1)[:, None]

    shapes = [Hull(directions(16, 3) * (0.5, 0.4, 0.3)) for _ in range(kinds)]
    turns = directions(count, 4)
    return [GROUND] + [Body(shapes[i % kinds], [1.1 * (i % 5 - 2), 1.1 * (i // 5 % 5 - 2), 0.6 + 1.1 * (i // 25)], turn=tuple(turns[i])) for i in range(count)]


def plates(speeds, phases, dt):
    """Plates shot at fixed plates, from [speed, phase] of the way of a step further off; speeds are in two thicknesses a step."""
    bodies = []
    for i, speed in enumerate(speeds):
        for j, phase in enumerate(phases):
            velocity, at = speed * 0.02 / dt, np.array([4 * i, 4 * j, 0])
            bodies += [Body(TARGET, at, 0), Body(PLATE, at + [0, 0, 0.0101 + velocity * dt * (1 + phase)], velocity=(0, 0, -velocity))]
    return bodies


# Scenes that ought to stand still, and scenes that ought to come to rest: bodies and seconds.
STANDING = {("tower30", "jittered"): (functools.partial(tower, 30, jitter=JITTER), 20), ("masses", "heavy on light, 100:1"): (functools.partial(tower, 2, 100), 10),
            ("masses", "heavy on light, 1000:1"): (functools.partial(tower, 2, 1000), 10), ("masses", "heavy on nine, 1000:1"): (functools.partial(tower, 10, 1000), 10),
            ("stack", "5^3"): (functools.partial(stack, 5), 10), ("pyramid", "base 20"): (functools.partial(pyramid, 20), 10),
            ("pyramid", "base 100"): (functools.partial(pyramid, 100), 10), ("arch", "15 wedges"): (arch, 10)}
SETTLING = {("dominoes", "50"): (dominoes, 15), ("heap", "300 convex"): (heap, 15)}
