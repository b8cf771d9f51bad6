"""A four-bar linkage: a motor turns its crank, and its rocker swings."""
import sys

import numpy as np

import tandem
from shapes import about, box

corners = np.array([[0, 0, 0], [0, 0, 1], [2, 0, 1.5], [2, 0, 0]])  # where its hinges are
sides = np.diff(corners, axis=0)  # the crank, the coupler, the rocker
bars = [tandem.build(*box([np.linalg.norm(side), 0.05, 0.1])) for side in sides]
angle = np.degrees(np.arctan2(sides[:, 2], sides[:, 0]))
middle = (corners[:-1] + corners[1:]) / 2 + [[0, 0, 0], [0, 0.06, 0], [0, 0, 0]]
bodies = [None, 0, 1, 2, None]  # None: the world
joints = [tandem.Joint("hinge", a, b, anchor=corner, axis=[0, 1, 0], speed=2 * np.pi, most_effort=1e4 if a is None else 0)
          for a, b, corner in zip(bodies, bodies[1:], corners)]
world = tandem.World(bars, asset=[0, 1, 2], translation=middle, rotation=[about(1, -turned) for turned in angle], joints=joints)
swing = []
while world.time < 10 - 1e-9:
    world.step(1 / 60)
    swing.append(np.degrees(world.joints["position"][3]))
end, start = (world.rotation[i] @ [x, 0, 0] + world.translation[i] for i, x in ((1, np.linalg.norm(sides[1]) / 2), (2, -np.linalg.norm(sides[2]) / 2)))
apart = abs(np.linalg.norm(end - start) - 0.06)  # of the coupler, which lies beside the rocker
print(f"the crank has turned {world.joints['position'][0] / (2 * np.pi):.1f} times, the rocker swung through {np.ptp(swing):.0f} degrees")
print(f"their loop is closed to {max(apart, 1e-9):.0e} m")

if "--picture" in sys.argv:
    tandem.view(bars, world.instances, picture="linkage.png", size=(640, 400), elevation=10)
