"""The adapters for solvers share this: which pairs a scene is asked about, and where bodies come near each other."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

import tandem

_Array = NDArray[np.float64]
Asked = tuple[NDArray[np.uint32] | None, tandem.Filter | None]


def asked_pairs(count: int, allowed: NDArray[np.integer[Any]]) -> Asked:
    """Pairs and filter that ask a scene about the pairs `allowed`, (m, 2) with a < b, of `count` instances and about no others.

    The pairs are named where less than half of all are allowed, as in many small worlds; else the filter excludes the others of those that the
    scene finds.
    """
    if 4 * len(allowed) < count * (count - 1):
        return np.unique(np.asarray(allowed, np.uint32), axis=0), None
    others = np.triu(np.ones((count, count), bool), 1)
    others[allowed[:, 0], allowed[:, 1]] = False
    return None, tandem.Filter(excluded=np.argwhere(others).astype(np.uint32))


class Touches:
    """Contact points of pairs of instances, a row for each.

    a, b: the instances, (n,). normal: unit, from a towards b, (n, 3). position: in the world, half-way between the surfaces, (n, 3). in_a, in_b: on
    the surfaces, in the coordinates of the assets, (n, 3). gap: how far the surfaces are apart, less than 0 where they overlap, (n,).
    """

    def __init__(self, scene: tandem.Scene, instances: NDArray[np.void], most_points: int, asked: Asked) -> None:
        """The points of all manifolds of the instances, which the scene gets. asked: what asked_pairs() gave."""
        self._scene, self._instances, self._most_points, (self._pairs, filter) = scene, instances, most_points, asked
        self._take(scene.place(instances, filter=filter), self._pairs)

    def _take(self, scene: tandem.Scene, asked: npt.ArrayLike | None) -> None:
        pairs = scene.contacts(pairs=asked).pairs
        made = scene.manifolds(most_points=self._most_points, match_previous=False)
        manifold = made.points["manifold"]
        self.pair = made.manifolds["pair"][manifold].astype(np.intp)  # the row among pairs
        self.a, self.b = pairs["a"][self.pair].astype(np.intp), pairs["b"][self.pair].astype(np.intp)
        self.normal, self.position, self.gap = made.manifolds["normal"][manifold], made.points["position"], -made.points["depth"]
        self.in_a, self.in_b = made.points["in_a"], made.points["in_b"]

    def add_near(self, reach: Callable[[NDArray[np.intp], NDArray[np.intp]], _Array], largest: float) -> None:
        """Adds points of pairs that are apart, by at most reach(a, b), which is at most `largest`.

        One body is moved towards the other by the reach, in the direction of their nearest points. The points of the manifolds that it then has are
        those that are within reach along that direction; it is moved back with them. A pair that has no manifold even so has its nearest points.
        """
        found = self._scene.distances(pairs=self._pairs, reach=largest)
        a, b = found.pairs["a"].astype(np.intp), found.pairs["b"].astype(np.intp)
        way = found.distances["point_b"] - found.distances["point_a"]
        gap, within = np.linalg.norm(way, axis=1), reach(a, b)
        rows = (found.distances["lower"] > 0) & (gap > 0) & (gap <= within)
        if not rows.any():
            return
        a, b, gap, within, near = a[rows], b[rows], gap[rows], within[rows], found.distances[rows]
        way = way[rows] / gap[:, None]
        moved = self._instances[np.stack([a, b], axis=1).ravel()]  # each pair has two instances of its own
        moved["translation"][1::2] -= within[:, None] * way
        touches = copy.copy(self)
        touches._take(self._scene.place(moved), np.arange(2 * len(a)).reshape(-1, 2))
        back = (within[:, None] * way)[touches.pair]
        gap_back = touches.gap + np.einsum("ni,ni->n", back, touches.normal)
        # No surfaces are nearer than `lower`: what seems so met on the way, and not along it. Depths are right to a hundredth.
        least = near["lower"][touches.pair]
        true = gap_back >= least - 0.02 * within[touches.pair]
        row = touches.pair[true]
        alone = np.setdiff1d(np.arange(len(a)), row)

        def local(point: _Array, instance: NDArray[np.intp]) -> _Array:
            placed: _Array = np.einsum("nji,nj->ni", self._instances["rotation"][instance], point - self._instances["translation"][instance])
            return placed

        for name, of_manifolds, of_nearest in (
            ("a", a[row], a[alone]), ("b", b[row], b[alone]), ("normal", touches.normal[true], way[alone]),
            ("position", (touches.position + 0.5 * back)[true], 0.5 * (near["point_a"] + near["point_b"])[alone]),
            ("in_a", touches.in_a[true], local(near["point_a"][alone], a[alone])), ("in_b", touches.in_b[true], local(near["point_b"][alone], b[alone])),
            ("gap", np.maximum(gap_back, least)[true], gap[alone]),
        ):
            setattr(self, name, np.concatenate([getattr(self, name), of_manifolds, of_nearest]))
