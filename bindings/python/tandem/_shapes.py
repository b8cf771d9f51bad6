"""The adapters for solvers share this: closed meshes made of primitives and height fields, about their own centre, with z as their axis.

A round shape is a stack of rings. Its error e is the least for which all its faces lie between the shape scaled by 1 - e and by 1 + e: a sphere and an ellipsoid
about the centre, a cylinder about its axis, a capsule about the nearest point of its axis. Points of a face are no farther from the centre of a unit sphere than
its corners, at distance 1, and no nearer than its plane, at distance d at least. Scaled by 2 / (1 + d) they lie between 1 - e and 1 + e with
e = (1 - d) / (1 + d). An affine map takes these bounds to an ellipsoid. Ends of a cylinder and boxes are exact. Files keep float32, which adds 2^-24.
"""
from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["PRIMITIVES", "Shapes", "height_field", "slab"]

PRIMITIVES = ("box", "sphere", "ellipsoid", "capsule", "cylinder", "cone")

Solid = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]  # vertices (n, 3), faces (m, 3), outwards


def _strip(upper: int, a: int, lower: int, b: int) -> list[tuple[int, int, int]]:
    """Faces between two rings of a and b corners, the first of which are `upper` and `lower`: one of both is 1, both are equal, or they differ by a corner a quarter."""
    def u(k: int) -> int:
        return upper + k % a

    def v(k: int) -> int:
        return lower + k % b

    if 1 in (a, b):
        return [(u(0), v(k), v(k + 1)) for k in range(b)] if a == 1 else [(u(k), v(0), u(k + 1)) for k in range(a)]
    if a == b:
        return [face for k in range(a) for face in ((u(k), v(k), v(k + 1)), (u(k), v(k + 1), u(k + 1)))]
    faces, quarter = [], min(a, b) // 4
    for q in range(4):
        i, j = (q * n // 4 for n in (a, b))
        for k in range(quarter + 1):
            faces.append((u(i + k), v(j + k), v(j + k + 1)) if a < b else (u(i + k), v(j + k), u(i + k + 1)))
            if k < quarter:
                faces.append((u(i + k), v(j + k + 1), u(i + k + 1)) if a < b else (v(j + k), v(j + k + 1), u(i + k + 1)))
    return faces


def _stack(rings: Sequence[tuple[float, float, int]]) -> Solid:
    """Rings of (radius, height, corners) from the top down; the first and last have one corner."""
    vertices: list[npt.NDArray[np.float64]] = []
    faces: list[tuple[int, int, int]] = []
    first = 0
    for place, (radius, height, count) in enumerate(rings):
        angle = 2 * np.pi * np.arange(count) / count
        vertices.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], axis=1))
        if place:
            before = rings[place - 1][2]
            faces += _strip(first - before, before, first, count)
        first += count
    return np.concatenate(vertices), np.array(faces)


def _quarter_rings(sides: int) -> list[tuple[float, float, int]]:
    """The upper half of a unit sphere, from its pole to its equator of 4 * sides corners."""
    return [(np.sin(angle), np.cos(angle), max(1, 4 * i)) for i, angle in enumerate(0.5 * np.pi * np.arange(sides + 1) / sides)]


def _capsule(sides: int, radius: float, half_length: float) -> Solid:
    """Corners are at the radius. With half_length 0 it is a sphere."""
    upper = [(radius * r, radius * z + half_length, count) for r, z, count in _quarter_rings(sides)]
    lower = [(r, -z, count) for r, z, count in reversed(upper)]
    return _stack(upper + (lower if half_length > 0 else lower[1:]))


def _nearest_of_ball(sides: int) -> float:
    """The distance of the nearest plane of a face of the unit sphere from the centre."""
    vertices, faces = _capsule(sides, 1.0, 0.0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return float(((normal * a).sum(axis=1) / np.linalg.norm(normal, axis=1)).min())


def _nearest_of_prism(sides: int) -> float:
    return float(np.cos(np.pi / (4 * sides)))


class Shapes:
    """Meshes of primitives whose error is at most `tolerance`.

    Raises:
        ValueError: the tolerance is not a number from 1e-6 to 0.5.
    """

    def __init__(self, tolerance: float) -> None:
        if not 1e-6 <= tolerance <= 0.5:
            raise ValueError(f"tolerance {tolerance}: is not from 1e-6 to 0.5")
        self._tolerance = tolerance

    def _fewest(self, nearest: Callable[[int], float]) -> tuple[int, float]:
        """Returns the fewest sides of a quarter that are enough, and what the radius is scaled by. nearest: of a number of sides the distance d."""
        def error(sides: int) -> float:
            return (1 - nearest(sides)) / (1 + nearest(sides))

        low, high = 0, 1  # too few, and perhaps enough
        while error(high) > self._tolerance:
            low, high = high, 2 * high
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if error(middle) <= self._tolerance else (middle, high)
        return high, 2 / (1 + nearest(high))

    @functools.cached_property
    def _ball(self) -> tuple[int, float]:
        return self._fewest(_nearest_of_ball)

    @functools.cached_property
    def _prism(self) -> tuple[int, float]:
        return self._fewest(_nearest_of_prism)

    def of(self, kind: str, x: float, y: float, z: float) -> Solid:
        """The mesh of one of PRIMITIVES. x, y, z: half sizes of a box, semi-axes of an ellipsoid; else x is the radius and y half the length, of a capsule that
        of its straight part. A cone points up, and is about the middle of its height."""
        if kind == "box":
            return _box(x, y, z)
        if kind in ("sphere", "ellipsoid"):
            sides, scale = self._ball
            vertices, faces = _capsule(sides, scale, 0.0)
            return vertices * (x if kind == "sphere" else (x, y, z)), faces
        if kind == "capsule":
            sides, scale = self._ball
            return _capsule(sides, scale * x, y)
        sides, scale = self._prism
        rings = [(scale * x, y, 4 * sides)] if kind == "cylinder" else []
        return _stack([(0.0, y, 1), *rings, (scale * x, -y, 4 * sides), (0.0, -y, 1)])


def _box(x: float, y: float, z: float) -> Solid:
    vertices = np.array([[i, j, k] for i in (-x, x) for j in (-y, y) for k in (-z, z)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return vertices, np.array(faces)


def slab(half_width: float) -> Solid:
    """Its upper side is square, in the plane z = 0; it is as thick as half of that."""
    vertices, faces = _box(half_width, half_width, 0.5 * half_width)
    return vertices - (0, 0, 0.5 * half_width), faces


def height_field(x: float, y: float, base: float, heights: npt.NDArray[np.floating[Any]]) -> Solid:
    """A solid from -x, -y, -base to x, y and heights (rows, columns) over 0: columns go along x, rows along y. MuJoCo cuts each cell by the same diagonal."""
    rows, columns = heights.shape
    place = np.arange(rows * columns).reshape(rows, columns)
    across, along = np.meshgrid(np.linspace(-x, x, columns), np.linspace(-y, y, rows))
    top = np.stack([across, along, heights], axis=-1).reshape(-1, 3)
    a, b, c, d = (place[i, j].ravel() for i, j in ((np.s_[:-1], np.s_[:-1]), (np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1]), (np.s_[1:], np.s_[1:])))
    rim = np.concatenate([place[0, :-1], place[:-1, -1], place[-1, :0:-1], place[:0:-1, 0]])  # counterclockwise
    below = len(top) + np.arange(len(rim))
    middle = np.full(len(rim), len(top) + len(rim))
    vertices = np.concatenate([top, top[rim] * (1, 1, 0) - (0, 0, base), [[0, 0, -base]]])
    next_rim, next_below = np.roll(rim, -1), np.roll(below, -1)
    faces = [(a, b, d), (a, d, c), (rim, below, next_below), (rim, next_below, next_rim), (middle, next_below, below)]
    return vertices, np.concatenate([np.stack(corners, axis=1) for corners in faces])
