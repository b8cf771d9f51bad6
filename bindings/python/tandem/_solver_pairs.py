"""The adapters for solvers share this: which pairs a scene is asked about."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import tandem
from tandem import _tandem


def asked_pairs(allowed: NDArray[np.integer[Any]], is_mesh: NDArray[np.bool_]) -> tuple[NDArray[np.uint32] | None, _tandem.Filter | None]:
    """Pairs and filter that ask a scene about the pairs `allowed`, (m, 2) with a < b and a mesh among them, and about no others. is_mesh: of each body.

    The pairs are named where less than half of those with a mesh are allowed, as in many small worlds; else the filter excludes the others of those that the
    scene finds.
    """
    count, others = len(is_mesh), int((~is_mesh).sum())
    if 4 * len(allowed) < count * (count - 1) - others * (others - 1):
        return np.unique(np.asarray(allowed, np.uint32), axis=0), None
    excluded = np.triu(is_mesh[:, None] | is_mesh, 1)
    excluded[allowed[:, 0], allowed[:, 1]] = False
    group, mask = np.where(is_mesh, 1, 2), np.where(is_mesh, 3, 1)
    return None, tandem.Filter(group=group, mask=mask, excluded=np.argwhere(excluded).astype(np.uint32))._core
