"""What the adapters for solvers share: which pairs a query is asked for, and where bodies come near each other."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import tandem


def pair_arguments(count: int, allowed: NDArray[np.integer[Any]]) -> dict[str, Any]:
    """Arguments of a query's methods that ask for the pairs `allowed`, (m, 2) with a < b, of `count` instances and for no others.

    They name the pairs where less than half of all are allowed, as in many small worlds, and else exclude the others of those that the
    query finds.
    """
    if 4 * len(allowed) < count * (count - 1):
        return {"pairs": np.unique(np.asarray(allowed, np.uint32), axis=0)}
    others = np.triu(np.ones((count, count), bool), 1)
    others[allowed[:, 0], allowed[:, 1]] = False
    return {"filter": tandem.Filter(excluded=np.argwhere(others).astype(np.uint32))}


class Touches:
    """Contact points of pairs of instances, a row for each.

    a, b: the instances, (n,). normal: unit, from a towards b, (n, 3). position: in the world, half-way between the surfaces, (n, 3). in_a, in_b: on
    the surfaces, in the coordinates of the assets, (n, 3). gap: how far the surfaces are apart, less than 0 where they overlap, (n,). id: of a
    point that is the same as in the step before; 0 where surfaces are apart.
    """

    def __init__(self, query: tandem.Query, instances: NDArray[np.void], most_points: int, reach: float, arguments: dict[str, Any]) -> None:
        """The points of all manifolds; and of pairs that are apart, by `reach` at most, their nearest points."""
        query.contacts(instances, **arguments)
        made = query.manifolds(most_points=most_points)
        manifold = made.manifolds[made.points["manifold"]]
        pairs = made.pairs[manifold["pair"]]
        self.a, self.b = pairs["a"].astype(np.intp), pairs["b"].astype(np.intp)
        self.normal, self.position, self.gap = manifold["normal"], made.points["position"], -made.points["depth"]
        self.in_a, self.in_b, self.id = made.points["in_a"], made.points["in_b"], made.points["id"]
        if reach > 0:
            self._add_near(query, instances, reach, arguments)

    def _add_near(self, query: tandem.Query, instances: NDArray[np.void], reach: float, arguments: dict[str, Any]) -> None:
        found = query.distances(instances, reach=reach, **arguments)
        rows = (found.distances["lower"] > 0) & (found.distances["upper"] < np.inf)
        near, pairs = found.distances[rows], found.pairs[rows]
        apart = near["point_b"] - near["point_a"]
        length = np.linalg.norm(apart, axis=1)
        certain = length > 0  # else the points are one, though the surfaces do not meet
        near, pairs, apart, length = near[certain], pairs[certain], apart[certain], length[certain]
        a, b = pairs["a"].astype(np.intp), pairs["b"].astype(np.intp)

        def local(point: NDArray[np.float64], instance: NDArray[np.intp]) -> NDArray[np.float64]:
            placed: NDArray[np.float64] = np.einsum("nji,nj->ni", instances["rotation"][instance], point - instances["translation"][instance])
            return placed

        self.a, self.b = np.concatenate([self.a, a]), np.concatenate([self.b, b])
        self.normal = np.concatenate([self.normal, apart / length[:, None]])
        self.position = np.concatenate([self.position, 0.5 * (near["point_a"] + near["point_b"])])
        self.gap = np.concatenate([self.gap, length])
        self.in_a = np.concatenate([self.in_a, local(near["point_a"], a)])
        self.in_b = np.concatenate([self.in_b, local(near["point_b"], b)])
        self.id = np.concatenate([self.id, np.zeros(len(a), np.uint64)])
