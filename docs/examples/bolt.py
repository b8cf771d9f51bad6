"""A bolt that screws itself down: it turns in a fixed nut by its weight, without friction."""
import sys

import numpy as np

import tandem
from shapes import around, lofted, thread

lead, length = 0.5, 1.5  # metres; the lead is the way of a turn
heights = np.arange(0, length + 1e-9, lead / 96)
shaft = thread(heights, lead, radius=0.1, depth=0.02)
bore = thread(heights[heights < 0.3], lead, radius=0.1005, depth=0.02)


def hexagon(loop, height):
    angles = np.arctan2(loop[:, 1], loop[:, 0])
    return around(angles, 0.2 * np.cos(np.pi / 6) / np.cos(angles % (np.pi / 3) - np.pi / 6), height)


head, top = hexagon(shaft[-1], length), hexagon(shaft[-1], length + 0.15)
outside = [hexagon(loop, loop[0, 2]) for loop in bore]
bolt = tandem.build(*lofted([0 * shaft[0], *shaft, head, top, 0 * top + [0, 0, top[0, 2]]]))
nut = tandem.build(*lofted([*outside, *bore[::-1], outside[0]]))
world = tandem.World([nut, bolt], asset=[0, 1], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]), friction=0, rolling_resistance=0)
turns = 0.0
while turns < 2 and world.time < 5:
    before = world.rotation[1]
    world.step(1 / 60)
    turn = world.rotation[1] @ before.T
    turns += np.arctan2(turn[0, 1], turn[0, 0]) / (2 * np.pi)
way = -world.translation[1, 2]
assert abs(way / turns / lead - 1) < 0.02
print(f"the bolt has turned {turns:.1f} times and sunk by {way:.1f} m, {way / turns:.2f} m a turn")

if "--picture" in sys.argv:
    tandem.view([nut, bolt], world.instances, picture="bolt.png", size=(640, 400), elevation=20)
