"""Rotations as 3x3 matrices, by scipy."""
import numpy as np
from scipy.spatial.transform import Rotation


def about(axis, angle):
    """The rotation by an angle, in radians, about an axis of any length."""
    return Rotation.from_rotvec(angle * np.asarray(axis) / np.linalg.norm(axis)).as_matrix()


def of_quaternions(quaternions):
    """[..., 3, 3] of [..., 4], in the order w, x, y, z and of any length."""
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1)).as_matrix()


def at_random(random, count=None):
    """A rotation that a numpy generator draws evenly from all; with a count, as many."""
    return of_quaternions(random.normal(size=4 if count is None else (count, 4)))
