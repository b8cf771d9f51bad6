"""What pictures of triangles have to show, found by brute force: the tests of all that draws compare with it."""
import numpy as np


def rasterise(corners, size):
    """Triangles, [n,3,3]: x and y in pixels from the upper left corner, z linear on the screen and greater where nearer.

    Returns, [height, width] each, the greatest z at the pixels' middles (-inf: none) and the triangle that has it (-1: none).
    """
    depth, nearest = np.full(size[::-1], -np.inf), np.full(size[::-1], -1)
    for i, triangle in enumerate(corners):
        low = np.clip(np.floor(triangle[:, :2].min(axis=0)), 0, size).astype(int)
        high = np.clip(np.ceil(triangle[:, :2].max(axis=0)), 0, size).astype(int)
        system = np.vstack([triangle[:, :2].T, np.ones(3)])
        if (low >= high).any() or np.linalg.matrix_rank(system) < 3:
            continue
        here = slice(low[1], high[1]), slice(low[0], high[0])
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        weights = np.tensordot(np.linalg.inv(system), np.stack([x, y, np.ones_like(x)]), 1)
        z = np.tensordot(triangle[:, 2], weights, 1)
        nearer = (weights.min(axis=0) >= 0) & (z > depth[here])
        depth[here][nearer] = z[nearer]
        nearest[here][nearer] = i
    return depth, nearest
