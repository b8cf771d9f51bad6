"""Rows of arguments and results: NumPy dtypes that are, byte for byte, the structs of tandem.h."""
from __future__ import annotations

import numpy as np

__all__ = ["CONTACT", "CONTAINMENT", "DISTANCE", "FORMER", "IMPACT", "INSTANCE", "MANIFOLD", "MOTION", "NO_INDEX", "PAIR", "POINT", "VERDICT"]

#: What is not there: a triangle, a face, a former point.
NO_INDEX = 0xFFFFFFFF

_VECTOR = ("<f8", (3,))
# Without holes, so that NumPy keeps the dtype wherever it copies.

#: Where a body stands: world = rotation @ x + translation, x in the mesh file's coordinates.
INSTANCE = np.dtype([("asset", "<u4"), ("reserved", "<u4"), ("rotation", "<f8", (3, 3)), ("translation", *_VECTOR)])
#: Two instances.
PAIR = np.dtype([("a", "<u4"), ("b", "<u4")])
#: Two triangles that meet: `pair` is the row of the list of pairs.
CONTACT = np.dtype([("pair", "<u4"), ("triangle_a", "<u4"), ("triangle_b", "<u4"), ("face_a", "<u4"), ("face_b", "<u4")])
#: A connected region in which the surfaces of two bodies meet.
MANIFOLD = np.dtype([("normal", *_VECTOR), ("area_vector", *_VECTOR), ("centre", *_VECTOR), ("depth", "<f8"), ("pair", "<u4"), ("first_point", "<u4"),
                     ("point_count", "<u4"), ("flags", "<u4")])
#: A point of a manifold.
POINT = np.dtype([("position", *_VECTOR), ("in_a", *_VECTOR), ("in_b", *_VECTOR), ("depth", "<f8"), ("id", "<u8"), ("face_a", "<u4"), ("face_b", "<u4"),
                  ("previous", "<u4"), ("manifold", "<u4")])
#: A component of a body that meets nothing of another and lies within it.
CONTAINMENT = np.dtype([("pair", "<u4"), ("inner", "<u4"), ("component", "<u4"), ("flags", "<u4")])
#: How near two bodies are.
DISTANCE = np.dtype([("lower", "<f8"), ("upper", "<f8"), ("point_a", *_VECTOR), ("point_b", *_VECTOR), ("triangle_a", "<u4"), ("triangle_b", "<u4"),
                     ("face_a", "<u4"), ("face_b", "<u4")])
#: Triangles of a pair of instances that were nearest a step ago.
FORMER = np.dtype([("a", "<u4"), ("b", "<u4"), ("triangle_a", "<u4"), ("triangle_b", "<u4")])
#: How an instance moves: its centre straight ahead, and it turns about that. `center` is where the centre is in the world at the start, such as that of mass.
MOTION = np.dtype([("velocity", *_VECTOR), ("angular_velocity", *_VECTOR), ("center", *_VECTOR)])
#: Until when two bodies surely do not meet.
IMPACT = np.dtype([("t_safe", "<f8"), ("gap", "<f8"), ("point_a", *_VECTOR), ("point_b", *_VECTOR), ("triangle_a", "<u4"), ("triangle_b", "<u4"),
                   ("face_a", "<u4"), ("face_b", "<u4"), ("status", "u1"), ("reserved", "u1", (7,))])
#: Whether two bodies meet, and which of their levels it was asked of.
VERDICT = np.dtype([("verdict", "u1"), ("level_a", "u1"), ("level_b", "u1")])
