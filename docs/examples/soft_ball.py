"""A soft ball falls into a cup. The ball is anybody's simulation; Tandem says where it touches: points, triangles, weights of their corners, normals, depths."""
import sys

import numpy as np

import tandem
from shapes import turned

angles = np.linspace(-np.pi / 2, np.pi / 2, 13)
rest, faces = turned(0.1 * np.stack([np.cos(angles), np.sin(angles)], 1), 24, closed=False)
cup = tandem.build(*turned([(0, 0), (0.2, 0), (0.2, 0.16), (0.16, 0.16), (0.08, 0.06), (0, 0.06)], 48, closed=False))
scene = tandem.Scene([cup, tandem.build(rest, faces)], asset=[0, 1], translation=np.zeros((2, 3)))


def pulled_to_shape(places, stiffness):
    """Shape matching (Mueller et al. 2005): each vertex goes a part of the way to where the rest shape, moved as a whole, has it."""
    centre = places.mean(0)
    u, _, v = np.linalg.svd((places - centre).T @ (rest - rest.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    return places + stiffness * ((rest - rest.mean(0)) @ turn.T + centre - places)


def weights(corners, point):
    """Barycentric coordinates of points (n, 3) in triangles (n, 3, 3)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    of = [np.einsum("ij,ij->i", np.cross(q - p, point - p), normal) for p, q in ((b, c), (c, a), (a, b))]
    return np.stack(of, 1) / np.einsum("ij,ij->i", normal, normal)[:, None]


def pushed_out(places):
    """Dents the ball until its points of contact are out of the cup. Result: the vertices, the points, and the weights of their triangles' corners."""
    scene.deform(1, places.astype(np.float32))
    scene.contacts()
    points = scene.manifolds().points
    corners = faces[points["face_b"]]
    shares = weights(places[corners], points["in_b"])
    moved = places.copy()
    for three, share, point in zip(corners, shares, points):
        near = np.exp(-np.sum((places - point["in_b"]) ** 2, 1) / 0.04**2)
        still = point["depth"] - point["normal"] @ (share @ (moved - places)[three])  # others may have moved it
        moved += max(still, 0) / (share @ near[three]) * near[:, None] * point["normal"]
    return moved, points, shares


places, speeds, step = rest + [0.02, 0, 0.3], np.zeros_like(rest), 1 / 240
deepest = 0
for _ in range(720):
    before = places
    speeds = 0.98 * speeds + [0, 0, -9.81 * step]
    places = places + step * speeds
    for _ in range(4):
        places, points, shares = pushed_out(pulled_to_shape(places, stiffness=0.3))
        deepest = max([deepest, *points["depth"]])
    speeds = (places - before) / step
assert np.linalg.norm(speeds.mean(0)) < 0.01 and np.allclose(shares.sum(1), 1)
print(f"the ball lies in the cup on {len(points)} points, {np.ptp(places[:, 2]):.2f} m high instead of 0.20; it was never deeper than {np.ceil(1000 * deepest):.0f} mm")

if "--picture" in sys.argv:
    tandem.view([cup, tandem.build(places, faces)], scene.instances, picture="soft_ball.png", size=(640, 400), elevation=35)
