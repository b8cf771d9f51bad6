"""The tree of an asset: boxes of its nodes, for pictures and statistics."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import tandem

from ._asset import sections_of

# Places in a .bvh file, version 1 (formats/FORMAT.md).
_BLOCKS = 2
_BLOCK = np.dtype([("centre", "<f4", (3, 4)), ("half_extent", "<f4", (3, 4)), ("index", "<u4", 4), ("kind", "<u4", 4)])
_INTERNAL, _LEAF = 0, 1


def boxes(asset: tandem.Asset, depth: int, level: int = 0) -> NDArray[np.float64]:
    """The boxes of the nodes at a depth: (n, 2, 3), lower and upper corners in the coordinates of the mesh file.

    Depth 0 is one box around everything, depth 1 the nodes of the root block, up to four, and so on. Leaves that
    end above the depth are there too, so the boxes of every depth hold the whole mesh; from `levels[level].depth` on
    they are the boxes of the triangles. Raises IndexError where the asset shows no such level, and ValueError where
    depth is negative.
    """
    if depth < 0:
        raise ValueError(f"depth {depth}: is not to be negative")
    if not 0 <= level < len(asset.levels):
        raise IndexError(f"level {level} of {len(asset.levels)}")
    blocks = _blocks(asset, level)
    ended = []
    row = np.zeros(1, np.int64)
    for _ in range(depth - 1):
        nodes = _nodes(blocks, row)
        if not (nodes["kind"] == _INTERNAL).any():
            break
        ended.append(nodes[nodes["kind"] == _LEAF])
        row = nodes["index"][nodes["kind"] == _INTERNAL]
    found = _box(np.concatenate([*ended, _nodes(blocks, row)])) + np.asarray(asset.origin)
    if depth == 0:
        found = np.stack([found[:, 0].min(axis=0), found[:, 1].max(axis=0)])[None]
    return found


def _blocks(asset: tandem.Asset, level: int) -> NDArray[np.void]:
    table = sections_of(asset)
    wanted = asset.first_level + level
    section = table[(table["kind"] == _BLOCKS) & (table["level"] == wanted)][0]
    return np.frombuffer(asset.data, _BLOCK, int(section["count"]), int(section["offset"]))


_NODE = np.dtype([("centre", "<f4", 3), ("half_extent", "<f4", 3), ("index", "<u4"), ("kind", "<u4")])


def _nodes(blocks: NDArray[np.void], row: NDArray[Any]) -> NDArray[np.void]:
    """The nodes of some blocks that are not imaginary."""
    nodes = np.empty((len(row), 4), _NODE)
    for name in ("centre", "half_extent"):
        nodes[name] = blocks[name][row].transpose(0, 2, 1)
    for name in ("index", "kind"):
        nodes[name] = blocks[name][row]
    return nodes[nodes["kind"] <= _LEAF]


def _box(nodes: NDArray[np.void]) -> NDArray[np.float64]:
    centre, half = nodes["centre"].astype(np.float64), nodes["half_extent"].astype(np.float64)
    return np.stack([centre - half, centre + half], axis=1)
