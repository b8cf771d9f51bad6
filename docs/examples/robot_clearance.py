"""How near a robot comes to its cell: an arm of two links that turns over a table past a post, in metres."""
import sys

import numpy as np

import tandem
from shapes import about, box, rod

UPPER_ARM, FOREARM = 0.6, 0.5
names = ["table", "post", "shelf", "base", "upper arm", "forearm", "gripper"]
assets = [tandem.build(*mesh) for mesh in (
    box((1.7, 1.7, 0.1), (0, 0, -0.05)), rod(0.04, 0.62), box((0.5, 0.3, 0.03)), rod(0.12, 0.3),
    box((UPPER_ARM, 0.1, 0.1), (UPPER_ARM / 2, 0, 0)), box((FOREARM, 0.07, 0.07), (FOREARM / 2, 0, 0)), rod(0.05, 0.12, 32))]
cell_at = [[0, 0, 0], [0.55, 0.55, 0], [-0.15, 0.8, 0.75]]


def poses(turn, shoulder, elbow):
    """Rotations and places of all bodies; angles in degrees, arms forward from the joint before."""
    base = about(2, turn)
    upper = base @ about(1, -shoulder)
    fore = upper @ about(1, elbow)
    joint = np.array([0, 0, 0.35])
    wrist = joint + upper @ [UPPER_ARM, 0, 0] + fore @ [FOREARM, 0, 0]
    places = [*cell_at, [0, 0, 0], joint, joint + upper @ [UPPER_ARM, 0, 0], wrist]
    return [np.eye(3)] * 3 + [base, upper, fore, fore @ about(1, 90)], places


# The cell stands still, and links that a joint joins are not asked about.
joined = [("table", "base"), ("base", "upper arm"), ("upper arm", "forearm"), ("forearm", "gripper")]
asked = tandem.Filter(motion=[tandem.FIXED] * 3 + [tandem.MOVING] * 4, excluded=[[names.index(a), names.index(b)] for a, b in joined])
scene = tandem.Scene(assets)


def tightest(lift):
    """The nearest that anything comes while the robot turns over the table: how near, what to what, where, and all that was found."""
    nearest = None
    for turn in range(0, 121, 5):
        rotation, translation = poses(turn, lift, 55)
        instances = tandem.instances(np.arange(len(assets)), rotation=rotation, translation=translation)
        found = scene.place(instances, filter=asked).distances(reach=0.5)
        row = found.distances["lower"].argmin()  # no two points are nearer than that: it is proved, not estimated
        if nearest is None or found.distances["lower"][row] < nearest[0] - 1e-6:
            nearest = found.distances["lower"][row], found.pairs[row], turn, instances, found
    return nearest


for lift in range(30, 71, 5):
    distance, (a, b), turn, instances, found = tightest(lift)
    safe = distance > 0.02
    print(f"lifted by {lift} degrees: {distance:.4f} m between {names[a]} and {names[b]}, turned by {turn}:", "safe" if safe else "too near")
    if safe:
        break

if "--picture" in sys.argv:
    tandem.view(assets, instances, distances=found, picture="robot_clearance.png", size=(640, 400), azimuth=-20, elevation=30, opacity=0.6)
