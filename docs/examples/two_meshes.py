"""The contacts of two meshes: two links of a chain, one turned by a quarter and hung into the other."""
import sys

import tandem
from shapes import about, torus

link = tandem.build(*torus(radius=1, thickness=0.25))
scene = tandem.Scene([link])
found = scene.place(rotation=[about(0, 0), about(0, 90)], translation=[[0, 0, 0], [1.6, 0, 0]]).contacts()
print(len(found.contacts), "pairs of triangles meet, the first are", found.contacts[["triangle_a", "triangle_b"]][0])

# The links hang in each other without a contact where their centres are from 0.5 to 1.5 apart, whatever their convex
# hulls do: nothing is made convex.
for apart in (1.0, 1.4, 1.49, 1.6):
    rotation, translation = [about(0, 0), about(0, 90)], [[0, 0, 0], [apart, 0, 0]]
    found = scene.place(rotation=rotation, translation=translation).contacts()
    nearest = scene.distances().distances[0]
    print(f"{apart} apart: {len(found.contacts)} contacts, distance {nearest['upper']:.4f}")

# Where they meet there is a region with a normal, an area and points with depths, which a solver of contacts takes.
for manifold in scene.manifolds().manifolds:
    print(f"region with normal {manifold['normal'].round(3) + 0.0}, depth {manifold['depth']:.3f}, {manifold['point_count']} points")

if "--picture" in sys.argv:
    instances = tandem.instances([0, 0], rotation=rotation, translation=translation)
    tandem.view([link], instances, contacts=True, manifolds=True, picture="two_meshes.png", size=(640, 400))
