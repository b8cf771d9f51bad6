"""The kernels of the peer Warp of scripts/python_peers and scripts/deform_peers."""
import warp as wp

SCALE = wp.constant(wp.float64(1.0e4))  # intersect_tri_tri() takes distances below 1e-6 for 0, whatever the size of the triangles


@wp.kernel
def find(mesh: wp.uint64, corners: wp.array(dtype=wp.vec3d), corners_of_mesh: wp.array(dtype=wp.vec3d), pairs: wp.array(dtype=wp.vec2i), rotation: wp.array(dtype=wp.mat33d),
         translation: wp.array(dtype=wp.vec3d), count: wp.array(dtype=int), found: wp.array(dtype=wp.vec4i)):
    pair, face = wp.tid()
    a, b = pairs[pair][0], pairs[pair][1]
    back = wp.transpose(rotation[b])
    p = back * (rotation[a] * corners[3 * face] + translation[a] - translation[b])
    q = back * (rotation[a] * corners[3 * face + 1] + translation[a] - translation[b])
    r = back * (rotation[a] * corners[3 * face + 2] + translation[a] - translation[b])
    lower, upper = wp.min(wp.min(p, q), r), wp.max(wp.max(p, q), r)
    # Boxes are float32: wider by more than rounding takes away.
    room = wp.float64(1.0e-6) * (wp.length(lower) + wp.length(upper) + wp.float64(1.0))
    wider = wp.vec3d(room, room, room)
    query = wp.mesh_query_aabb(mesh, wp.vec3(lower - wider), wp.vec3(upper + wider))
    other = int(0)
    while wp.mesh_query_aabb_next(query, other):
        u, v, w = SCALE * corners_of_mesh[3 * other], SCALE * corners_of_mesh[3 * other + 1], SCALE * corners_of_mesh[3 * other + 2]
        if wp.intersect_tri_tri(SCALE * p, SCALE * q, SCALE * r, u, v, w) != 0:
            place = wp.atomic_add(count, 0, 1)
            if place < found.shape[0]:
                found[place] = wp.vec4i(a, b, face, other)


@wp.kernel
def gather(points: wp.array(dtype=wp.vec3), indices: wp.array(dtype=int), corners: wp.array(dtype=wp.vec3d)):
    corner = wp.tid()
    corners[corner] = wp.vec3d(points[indices[corner]])
