"""A mug that falls on a hook with its handle, swings and comes to rest."""
import sys

import numpy as np

import tandem
from shapes import about, tube, turned

arc = np.linspace(-np.pi / 2, np.pi / 2, 25)
bend = 0.03 * np.stack([np.cos(arc), 0 * arc, np.sin(arc)], 1)
hook = tandem.build(*tube([[-0.08, 0, -0.03], *bend], radius=0.005))
cup = turned([(0, 0), (0.04, 0), (0.04, 0.1), (0.036, 0.1), (0.036, 0.004), (0, 0.004)], 48, closed=False)
handle = tube([0.038, 0, 0.05] + bend, radius=0.006)
mug = tandem.build(np.concatenate([cup[0], handle[0]]), np.concatenate([cup[1], len(cup[0]) + handle[1]]))
leans = about(1, -50)  # the hook goes through the middle of the handle at the start
world = tandem.World([hook, mug], asset=[0, 1], translation=[[0, 0, 0.03], [0, -0.03, 0] - leans @ [0.051, 0, 0.05]], rotation=[about(2, 90), leans],
                     filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]))
while not world.sleeping[1] and world.time < 30:
    world.step(1 / 240, 24)
x, y, z = world.bodies["centre"][1]
assert world.sleeping[1] and len(world.touching) == 1 and abs(x) < 0.01 and z < -0.05
print(f"the mug hangs by its handle, {-z:.2f} m below the hook, and rests")

if "--picture" in sys.argv:
    tandem.view([hook, mug], world.instances, picture="mug_on_hook.png", size=(640, 400), azimuth=150, elevation=10)
