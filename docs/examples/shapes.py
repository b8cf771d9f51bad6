"""Closed meshes for the examples: vertices (n, 3) and triangles (m, 3), whose corners go anticlockwise seen from outside."""
import numpy as np


def box(size, centre=(0, 0, 0)):
    corners = np.array([[i >> k & 1 for k in range(3)] for i in range(8)]) - 0.5
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    triangles = [[a, b, c] for a, b, c, d in faces] + [[a, c, d] for a, b, c, d in faces]
    return corners * size + centre, np.array(triangles)


def around(angles, radii, heights):
    """Points about the z axis, such as a loop."""
    return np.stack(np.broadcast_arrays(radii * np.cos(angles), radii * np.sin(angles), heights), axis=-1)


def lofted(loops):
    """Joins closed loops (k, n, 3), each with the next. Points at one place become one vertex, so a loop may be a point, and the last be the first again."""
    loops = np.asarray(loops, float)
    vertices, at = np.unique(loops.reshape(-1, 3).round(12) + 0.0, axis=0, return_inverse=True)
    grid = at.reshape(loops.shape[:2])
    below, above = grid[:-1], grid[1:]
    corners = [below, np.roll(below, -1, axis=1), np.roll(above, -1, axis=1), above]
    triangles = np.concatenate([np.stack([corners[i] for i in three], axis=-1).reshape(-1, 3) for three in ((0, 1, 2), (0, 2, 3))])
    different = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return vertices, triangles[different]


def turned(profile, sides, closed=True):
    """A profile (k, 2) of radii and heights turned about z. It runs anticlockwise; closed: its end joins its start, as
    that of a ring; else both ends lie on the axis, as those of a rod."""
    angles = 2 * np.pi * np.arange(sides) / sides
    radii, heights = np.array([*profile, *profile[:1]] if closed else profile, float).T[..., None]
    return lofted(around(angles, radii, heights))


def thread(heights, lead, radius, depth, lobes=3, sides=96):
    """Loops for `lofted`, one at each height: a cross-section whose radius goes up and down by `depth` at each of its lobes, turned by 360 degrees a lead."""
    angles = 2 * np.pi * np.arange(sides) / sides
    radii = radius + depth * np.cos(lobes * angles)
    return [around(angles + 2 * np.pi * height / lead, radii, height) for height in heights]


def rod(radius, length, sides=24):
    """A cylinder about z, from z = 0."""
    return turned([(0, 0), (radius, 0), (radius, length), (0, length)], sides, closed=False)


def ring(outer, inner, height, sides=32):
    """A tube about z, from z = 0."""
    return turned([(inner, 0), (outer, 0), (outer, height), (inner, height)], sides)


def tube(path, radius, sides=24):
    """A rod along points (k, 3) of a plane across the y axis."""
    path = np.array(path, float)
    along = np.gradient(path, axis=0)
    across = np.cross([0, -1, 0], along / np.linalg.norm(along, axis=1, keepdims=True))
    angles = 2 * np.pi * np.arange(sides)[:, None] / sides
    loops = path[:, None] + radius * (np.cos(angles) * across[:, None] - np.sin(angles) * [0, 1, 0])
    ends = np.broadcast_to(path[[0, -1], None], (2, *loops.shape[1:]))
    return lofted([ends[0], *loops, ends[1]])


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


def joined(meshes):
    """Several meshes as one."""
    firsts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate([faces + first for first, (_, faces) in zip(firsts, meshes)])


def sheet(width, height, cells_across, cells_up):
    """An open rectangle in the plane x = 0, about the z axis and above z = 0."""
    across, up = np.meshgrid(np.linspace(-0.5, 0.5, cells_across + 1) * width, np.linspace(0, 1, cells_up + 1) * height)
    vertices = np.stack([0 * across, across, up], -1).reshape(-1, 3)
    a = (np.arange(cells_up)[:, None] * (cells_across + 1) + np.arange(cells_across)).reshape(-1)
    b, c, d = a + 1, a + cells_across + 2, a + cells_across + 1
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
