"""The adapters for solvers share this: which pairs a scene is asked about."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tandem import EVERY_WORLD

_Whole = NDArray[np.integer[Any]]


def asked_pairs(allowed: _Whole, is_mesh: NDArray[np.bool_], world: _Whole | None = None) -> tuple[NDArray[np.uint32] | None, dict[str, Any] | None]:
    """Pairs, or arguments of a Filter, that ask a scene about the pairs `allowed`, (m, 2) with a < b and a mesh among them, and about no others.

    The pairs are named where less than half of those with a mesh are allowed; else the filter excludes the others of those that the scene finds.

    Args:
        is_mesh: of each body.
        world: of each body, or EVERY_WORLD; allowed pairs are of one world. None: there is one.
    """
    of = np.zeros(len(is_mesh), np.int64) if world is None else np.asarray(world, np.int64)
    if 2 * len(allowed) < _count(is_mesh, of):
        return np.unique(np.asarray(allowed, np.uint32), axis=0), None
    candidates = _candidates(is_mesh, of)
    keys, allowed_keys = (pairs[:, 0] * len(is_mesh) + pairs[:, 1] for pairs in (candidates, np.asarray(allowed, np.int64)))
    excluded = candidates[~np.isin(keys, allowed_keys)]
    columns: dict[str, Any] = {"group": np.where(is_mesh, 1, 2).astype(np.uint32), "mask": np.where(is_mesh, 3, 1).astype(np.uint32),
                               "excluded": excluded.astype(np.uint32)}
    if world is not None:
        columns["world"] = of.astype(np.uint32)
    return None, columns


def _count(is_mesh: NDArray[np.bool_], world: NDArray[np.int64]) -> int:
    """How many pairs with a mesh may meet by their worlds."""
    def pairs(chosen: NDArray[np.bool_]) -> int:
        sizes = np.unique(world[chosen & (world != EVERY_WORLD)], return_counts=True)[1].astype(np.int64)
        everywhere = int((chosen & (world == EVERY_WORLD)).sum())
        return int((sizes * (sizes - 1) // 2).sum() + everywhere * (everywhere - 1) // 2 + everywhere * sizes.sum())

    return pairs(np.ones_like(is_mesh)) - pairs(~is_mesh)


def _candidates(is_mesh: NDArray[np.bool_], world: NDArray[np.int64]) -> NDArray[np.int64]:
    """These pairs, (m, 2) with a < b."""
    everywhere = np.flatnonzero(world == EVERY_WORLD)
    bodies = np.argsort(world, kind="stable")[:len(world) - len(everywhere)]  # EVERY_WORLD is the largest
    _, first, sizes = np.unique(world[bodies], return_index=True, return_counts=True)
    found = [everywhere[np.stack(np.triu_indices(len(everywhere), 1), axis=1)],
             np.stack(np.meshgrid(everywhere, bodies, indexing="ij"), axis=-1).reshape(-1, 2)]
    for size in np.unique(sizes):
        places = np.stack(np.triu_indices(size, 1), axis=1)
        found.append(bodies[(first[sizes == size, None, None] + places).reshape(-1, 2)])
    pairs: NDArray[np.int64] = np.sort(np.concatenate(found), axis=1)
    with_mesh: NDArray[np.int64] = pairs[is_mesh[pairs].any(axis=1)]
    return with_mesh
