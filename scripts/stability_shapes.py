"""Closed meshes that scripts/stability makes: arrays of vertices and of triangles, which wind counterclockwise seen from outside. Lengths are metres."""
import functools
import sys

import numpy as np

from common import tools

sys.path.append(str(tools.ROOT / "docs/examples"))
from shapes import around, lofted, thread, turned  # noqa: E402

GAP = 3e-4  # between bowls of which each lies in the next
FOOT = 0.14  # radians: the half-angle of a bowl's flat bottom
RING, WIRE = 0.5, 0.1  # radii of a ring, and of its wire
BOWL, WALL = 0.5, 0.01  # a bowl's outer radius and its thickness
COIN = 0.5, 0.025  # radius, and half the thickness
PIN, PLAY = 0.1, 5e-4  # radius of the gear's pin, and what bores are wider; the nut's thread too
TEETH, PITCH = 20, 0.5  # of a gear; the radius at which it rolls on its like
LEAD = 0.5  # way of a nut in a turn
BOLT, NUT, THIN_NUT = 2.5, 0.3, 0.02  # heights


def obj_of(vertices, triangles):
    return "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()) + "".join(f"f {a} {b} {c}\n" for a, b, c in (triangles + 1).tolist())


def sphere(radius, subdivisions):
    """An icosahedron whose triangles were quartered again and again: 20 * 4^subdivisions triangles; a vertex is lowest."""
    golden = (1 + 5 ** 0.5) / 2
    vertices = np.array([np.roll([0, i, j * golden], k) for k in range(3) for i in (-1, 1) for j in (-1, 1)])
    triangles = np.array([(a, b, c) for a in range(12) for b in range(12) for c in range(12) if a < b and a < c and b != c
                          and np.allclose(np.linalg.norm(vertices[[a, b, c]] - vertices[[b, c, a]], axis=1), 2)
                          and np.linalg.det(vertices[[a, b, c]]) > 0])
    for _ in range(subdivisions):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        pairs, middle = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = len(vertices) + middle.reshape(-1, 3).T
        a, b, c = triangles.T
        vertices = np.concatenate([vertices, vertices[pairs].mean(axis=1)])
        vertices *= np.linalg.norm(vertices[0]) / np.linalg.norm(vertices, axis=1)[:, None]
        triangles = np.concatenate([np.stack(three, axis=1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return radius * vertices / np.linalg.norm(vertices[0]), triangles


def ring():
    angles = 2 * np.pi * np.arange(25) / 24
    return turned(np.stack([RING + WIRE * np.cos(angles), WIRE * np.sin(angles)], axis=1), 48, closed=False)


def bowl_profile(radius):
    angles = np.linspace(FOOT, np.pi / 2, 13)
    return radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1)


def bowl(radius):
    """Half a spherical shell with a flat bottom; the sphere's centre is the origin."""
    outside, inside = bowl_profile(radius), bowl_profile(radius - WALL)
    return turned([(0, outside[0, 1]), *outside, *inside[::-1], (0, inside[0, 1])], 48, closed=False)


def coin():
    radius, half = COIN
    return turned([(0, -half), (radius, -half), (radius, half), (0, half)], 1024, closed=False)


def top():
    """A disc on a stem that ends in a point, the origin."""
    return turned([(0, 0), (0.04, 0.04), (0.04, 0.12), (0.25, 0.12), (0.25, 0.18), (0, 0.18)], 96, closed=False)


# A thread is a cross-section of three lobes, turned as it rises.
LOBES, CORE, LOBE, AROUND = 3, 0.1, 0.02, 96


def lobed(height, play=0.0):
    heights = np.arange(round(height / LEAD * AROUND) + 1) * LEAD / AROUND
    return thread(heights, LEAD, CORE + play, LOBE, LOBES, AROUND)


def bolt():
    loops = lobed(BOLT)
    return lofted([0 * loops[0], *loops, 0 * loops[-1] + [0, 0, loops[-1][0, 2]]])


def nut(height):
    inside = lobed(height, PLAY)
    outside = [around(np.arctan2(loop[:, 1], loop[:, 0]), 0.2, loop[:, 2]) for loop in inside]
    return lofted([*outside, *inside[::-1], outside[0]])


def gear_outline():
    """Angles and radii of involute teeth (20 degrees), one of them around angle 0, which leave each other 1 mm at the pitch circle."""
    module, pressure = 2 * PITCH / TEETH, np.radians(20)
    base = PITCH * np.cos(pressure)

    def involute(radii):
        angles = np.arccos(base / radii)
        return np.tan(angles) - angles
    radii = np.linspace(base, PITCH + module, 10)
    half = np.pi / (2 * TEETH) - 2.5e-4 / PITCH + involute(PITCH) - involute(radii)
    radii, half = np.append(PITCH - 1.25 * module, radii), np.append(half[0] + 0.01, half)
    angles = np.concatenate([-half, half[::-1]])
    return (angles + 2 * np.pi * np.arange(TEETH)[:, None] / TEETH).ravel(), np.tile(np.append(radii, radii[::-1]), TEETH)


def gear():
    angles, radii = gear_outline()
    bore = PIN + PLAY
    return lofted([around(angles, radii, 0), around(angles, radii, 0.1), around(angles, bore, 0.1), around(angles, bore, 0), around(angles, radii, 0)])


SHAPES = {"ring": ring, "coin": coin, "top": top, "bolt": bolt, "nut": functools.partial(nut, NUT), "thin_nut": functools.partial(nut, THIN_NUT), "gear": gear,
          "pin": functools.partial(turned, [(0, -0.1), (PIN, -0.1), (PIN, 0.3), (0, 0.3)], 200, closed=False)}
SHAPES |= {f"sphere_{20 * 4 ** n}": functools.partial(sphere, 0.5, n) for n in (3, 5, 6)}
SHAPES |= {f"bowl_{i}": functools.partial(bowl, BOWL - i * (WALL + GAP)) for i in range(10)}
