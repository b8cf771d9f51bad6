"""Meshes of the tests of the adapters: vertices (n, 3) and faces (m, 3), closed, outwards."""
import numpy as np


def lathe(profile, sides):
    """Turns a polygon about z: (n, 2) of radius and height, counterclockwise with the radius to the right. Its first and last corners may be on the axis."""
    profile = np.asarray(profile, float)
    place, vertices = [], []  # where each corner's ring of vertices begins
    angle = 2 * np.pi * np.arange(sides) / sides
    for radius, height in profile:
        place.append(len(vertices))
        turns = angle if radius > 0 else angle[:1]
        vertices += [[radius * np.cos(a), radius * np.sin(a), height] for a in turns]
    faces = []
    for corner in range(len(profile)):
        following = (corner + 1) % len(profile)
        on_axis = profile[corner, 0] == 0, profile[following, 0] == 0
        if all(on_axis):
            continue
        for side in range(sides):
            a, b = (place[corner] + (0 if on_axis[0] else s % sides) for s in (side, side + 1))
            d, c = (place[following] + (0 if on_axis[1] else s % sides) for s in (side, side + 1))
            faces += [face for face in ([a, b, c], [a, c, d]) if len(set(face)) == 3]
    return np.array(vertices), np.array(faces)


def box(x, y, z):
    """From -x, -y, -z to x, y, z."""
    vertices = np.array([[i, j, k] for i in (-x, x) for j in (-y, y) for k in (-z, z)], float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return vertices, np.array(faces)


def ball(radius, rings=12, sides=24):
    height = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rings + 1)
    profile = radius * np.stack([np.cos(height), np.sin(height)], axis=1)
    profile[[0, -1], 0] = 0
    return lathe(profile, sides)


def cup(inner, outer, floor, height, sides=32):
    """Open above, from z = 0 up."""
    return lathe([[0, 0], [outer, 0], [outer, height], [inner, height], [inner, floor], [0, floor]], sides)


def ring(inner, outer, height, sides=32):
    """About z, from z = 0 up."""
    return lathe([[inner, 0], [outer, 0], [outer, height], [inner, height]], sides)


def peg(radius, height, sides=32):
    """A cylinder from z = 0 up."""
    return lathe([[0, 0], [radius, 0], [radius, height], [0, height]], sides)


def chain_link(radius, wire, sides=24, wire_sides=8):
    """A torus about z."""
    angle = 2 * np.pi * np.arange(wire_sides) / wire_sides
    return lathe(np.stack([radius + wire * np.cos(angle), wire * np.sin(angle)], axis=1), sides)


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6
