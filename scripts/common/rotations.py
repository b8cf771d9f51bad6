"""Rotations as matrices and as unit quaternions w x y z."""
import numpy as np


def matrices(quaternion):
    """Matrices (..., 3, 3) of quaternions (..., 4), whose lengths do not matter."""
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                     2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1).reshape(*w.shape, 3, 3)


def quaternion(matrix):
    """The unit quaternion of a matrix (3, 3)."""
    r = matrix
    largest = np.array([1 + np.trace(r), 1 + r[0, 0] - r[1, 1] - r[2, 2], 1 - r[0, 0] + r[1, 1] - r[2, 2], 1 - r[0, 0] - r[1, 1] + r[2, 2]])
    outer = np.array([[largest[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]], [r[2, 1] - r[1, 2], largest[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
                      [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], largest[2], r[1, 2] + r[2, 1]], [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], largest[3]]])
    row = outer[largest.argmax()]  # 4 q q^T has this row; it is the longest
    return row / np.linalg.norm(row)
