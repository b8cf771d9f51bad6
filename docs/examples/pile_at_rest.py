"""A pile that comes to rest: 50 rings fall into a cup."""
import sys

import numpy as np

import tandem
from shapes import torus, turned

ring = tandem.build(*torus(radius=0.07, thickness=0.02, sides=24, around=12))
cup = tandem.build(*turned([(0, 0), (0.4, 0), (0.55, 0.6), (0.5, 0.6), (0.37, 0.05), (0, 0.05)], 48, closed=False))
numbers = np.random.default_rng(0)
translation = np.stack([*numbers.uniform(-0.2, 0.2, (2, 50)), 0.3 + 0.1 * np.arange(50)], 1)
rotation = tandem.rotations(xyzw=numbers.normal(size=(50, 4)))
motion = tandem.Filter(motion=[tandem.FIXED] + 50 * [tandem.MOVING])
world = tandem.World([cup, ring], asset=[0] + 50 * [1], translation=[np.zeros(3), *translation],
                     rotation=[np.eye(3), *rotation], filter=motion, continuous=True)
while not world.sleeping[1:].all() and world.time < 30:
    world.step(1 / 60, 60)
inside = np.linalg.norm(world.translation[1:, :2], axis=1) < 0.5
print(f"{world.sleeping.sum()} rings are at rest, {inside.sum()} of them in the cup")

if "--picture" in sys.argv:
    tandem.view([cup, ring], world.instances, picture="pile_at_rest.png", size=(640, 400), elevation=50)
