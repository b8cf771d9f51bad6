"""Closed meshes for the examples: vertices (n, 3) and triangles (m, 3), whose corners go anticlockwise seen from outside."""
import numpy as np


def box(size, centre=(0, 0, 0)):
    corners = np.array([[i >> k & 1 for k in range(3)] for i in range(8)]) - 0.5
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    triangles = [[a, b, c] for a, b, c, d in faces] + [[a, c, d] for a, b, c, d in faces]
    return corners * size + centre, np.array(triangles)


def turned(profile, sides, closed=True):
    """A profile (k, 2) of radii and heights turned about z. It runs anticlockwise; closed: its end joins its start, as
    that of a ring; else both ends lie on the axis, as those of a rod."""
    angle = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(angle), np.sin(angle)], 1)
    radius, height = np.array(profile, float).T
    rings = np.concatenate([radius[:, None, None] * around, np.broadcast_to(height[:, None, None], (len(radius), sides, 1))], 2)
    start = np.arange(len(profile) if closed else len(profile) - 1)
    low, side = np.meshgrid(start, np.arange(sides), indexing="ij")
    high, beside = (low + 1) % len(profile), (side + 1) % sides
    a, b, c, d = (row * sides + column for row, column in ((low, side), (low, beside), (high, beside), (high, side)))
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return joined(rings.reshape(-1, 3), triangles)


def joined(vertices, triangles):
    """The same with one vertex for each place, and without triangles that have two corners in one place."""
    vertices, row = np.unique(vertices.round(12) + 0.0, axis=0, return_inverse=True)
    triangles = row.reshape(-1)[triangles]
    different = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return vertices, triangles[different]


def rod(radius, length, sides=24):
    """A cylinder about z, from z = 0."""
    return turned([(0, 0), (radius, 0), (radius, length), (0, length)], sides, closed=False)


def ring(outer, inner, height, sides=32):
    """A tube about z, from z = 0."""
    return turned([(inner, 0), (outer, 0), (outer, height), (inner, height)], sides)


def torus(radius, thickness, sides=48, around=24):
    """Thickness: the radius of the tube."""
    angle = 2 * np.pi * np.arange(around) / around
    return turned(np.stack([radius + thickness * np.cos(angle), thickness * np.sin(angle)], 1), sides)


def about(axis, degrees):
    """The rotation about an axis of coordinates: 0 x, 1 y, 2 z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return rotation
