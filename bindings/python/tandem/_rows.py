"""Rows of arguments and results: NumPy dtypes that are, byte for byte, the structs of tandem.h. They have no holes, so that NumPy keeps them
wherever it copies. Written by scripts/write_interface from it. Do not edit it."""
import numpy as np

__all__ = ["BODY_AT", "BODY_MOTION", "CLOSEST_POINT", "CONFIGURATION_PAIR", "CONTACT", "CONTAINMENT", "DISTANCE", "FORMER", "IMPACT", "INSTANCE", "JOINT", "MANIFOLD", "MOTION", "NO_INDEX", "PAIR", "POINT", "RAY_HIT", "VERDICT", "WORLD_CONTACT", "WORLD_JOINT", "WORLD_TOUCH"]

#: What is not there: a triangle, a face, a former point, the asset of a removed body.
NO_INDEX = 0xFFFFFFFF
#: An asset as a body. The place of a body: world = rotation x + translation, x in the mesh file's coordinates; rows of the rotation are consecutive.
#: Rigid to 1e-6, else TANDEM_POSE_NOT_RIGID.
INSTANCE = np.dtype([("asset", "<u4"), ("reserved", "<u4"), ("rotation", "<f8", (3, 3)), ("translation", "<f8", (3,))])
#: Two bodies.
PAIR = np.dtype([("a", "<u4"), ("b", "<u4")])
#: Two triangles that meet: triangle_a belongs to body a of the object pair, triangle_b to b.
CONTACT = np.dtype([("pair", "<u4"), ("triangle_a", "<u4"), ("triangle_b", "<u4"), ("face_a", "<u4"), ("face_b", "<u4")])
#: A connected region in which the surfaces of two bodies meet (docs/contacts.md).
MANIFOLD = np.dtype([("normal", "<f8", (3,)), ("area_vector", "<f8", (3,)), ("centre", "<f8", (3,)), ("depth", "<f8"), ("pair", "<u4"),
        ("first_point", "<u4"), ("point_count", "<u4"), ("flags", "<u4")])
#: A point of a manifold.
POINT = np.dtype([("position", "<f8", (3,)), ("in_a", "<f8", (3,)), ("in_b", "<f8", (3,)), ("normal", "<f8", (3,)), ("depth", "<f8"), ("id", "<u8"),
        ("face_a", "<u4"), ("face_b", "<u4"), ("previous", "<u4"), ("manifold", "<u4")])
#: A component of a body that meets nothing of another and lies within it.
CONTAINMENT = np.dtype([("pair", "<u4"), ("inner", "<u4"), ("component", "<u4"), ("flags", "<u4")])
#: The distance of the surfaces of two bodies (docs/distance.md).
DISTANCE = np.dtype([("lower", "<f8"), ("upper", "<f8"), ("point_a", "<f8", (3,)), ("point_b", "<f8", (3,)), ("triangle_a", "<u4"), ("triangle_b",
        "<u4"), ("face_a", "<u4"), ("face_b", "<u4")])
#: Triangles of a pair of bodies that were nearest a step ago.
FORMER = np.dtype([("a", "<u4"), ("b", "<u4"), ("triangle_a", "<u4"), ("triangle_b", "<u4")])
#: The centre goes straight ahead and the body turns about it, both at constant speed.
MOTION = np.dtype([("velocity", "<f8", (3,)), ("angular_velocity", "<f8", (3,)), ("centre", "<f8", (3,))])
#: Says until when two moving bodies surely do not meet (docs/impact.md).
IMPACT = np.dtype([("t_safe", "<f8"), ("gap", "<f8"), ("point_a", "<f8", (3,)), ("point_b", "<f8", (3,)), ("triangle_a", "<u4"), ("triangle_b",
        "<u4"), ("face_a", "<u4"), ("face_b", "<u4"), ("status", "u1"), ("reserved", "u1", (7,))])
#: Says whether two bodies meet (docs/levels.md).
VERDICT = np.dtype([("verdict", "u1"), ("level_a", "u1"), ("level_b", "u1")])
#: A body whose world box contains a point.
BODY_AT = np.dtype([("point", "<u4"), ("body", "<u4")])
#: Two bodies of a configuration, a < b, and bounds of their distance.
CONFIGURATION_PAIR = np.dtype([("configuration", "<u8"), ("a", "<u4"), ("b", "<u4"), ("lower", "<f8"), ("upper", "<f8")])
#: The closest point of the bodies of a scene (docs/points_and_rays.md).
CLOSEST_POINT = np.dtype([("lower", "<f8"), ("upper", "<f8"), ("position", "<f8", (3,)), ("body", "<u4"), ("triangle", "<u4"), ("face", "<u4"),
        ("within", "<u4"), ("winding", "<i4"), ("reserved", "<u4")])
#: A place where a ray meets a triangle of a body (docs/points_and_rays.md).
RAY_HIT = np.dtype([("t", "<f8"), ("weight", "<f8", (2,)), ("ray", "<u4"), ("body", "<u4"), ("triangle", "<u4"), ("face", "<u4")])
#: Where a body is, and how it moves. The place of a body: world = rotation x + translation, x in the mesh file's coordinates; rows of the rotation
#: are consecutive. Rigid to 1e-6, else TANDEM_POSE_NOT_RIGID.
BODY_MOTION = np.dtype([("rotation", "<f8", (3, 3)), ("translation", "<f8", (3,)), ("centre", "<f8", (3,)), ("velocity", "<f8", (3,)),
        ("angular_velocity", "<f8", (3,)), ("sleeps", "u1"), ("reserved", "u1", (7,))])
#: A point where two bodies touch, or nearly so, and what they did there in the last step.
WORLD_CONTACT = np.dtype([("a", "<u4"), ("b", "<u4"), ("position", "<f8", (3,)), ("normal", "<f8", (3,)), ("depth", "<f8"), ("impulse", "<f8", (3,))])
#: Two bodies that touch, and how hard.
WORLD_TOUCH = np.dtype([("a", "<u4"), ("b", "<u4"), ("impulse", "<f8"), ("speed", "<f8"), ("position", "<f8", (3,))])
#: Two bodies, of which at least one moves, joined as they are placed. Anchors and axis are those of the world at that time, and the bodies carry them
#: along.
JOINT = np.dtype([("kind", "<u4"), ("a", "<u4"), ("b", "<u4"), ("has_limits", "u1"), ("may_touch", "u1"), ("reserved", "u1", (2,)), ("anchor", "<f8",
        (3,)), ("anchor_b", "<f8", (3,)), ("axis", "<f8", (3,)), ("least", "<f8"), ("most", "<f8"), ("speed", "<f8"), ("most_effort", "<f8"),
        ("breaking_force", "<f8"), ("breaking_torque", "<f8")])
#: What a joint did in the last step, and where it is.
WORLD_JOINT = np.dtype([("position", "<f8"), ("speed", "<f8"), ("impulse", "<f8", (3,)), ("turning", "<f8", (3,)), ("motor_effort", "<f8"), ("holds",
        "u1"), ("reserved", "u1", (7,))])
