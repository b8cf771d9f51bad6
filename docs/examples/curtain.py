"""A skinned character walks through a curtain: which triangles touch in each frame, though both bend."""
import sys

import numpy as np

import tandem
from shapes import about, box, joined, sheet, tube


def limb(x, y, top, length, radius):
    """A tube that hangs down, and how much each vertex follows the lower one of its two bones."""
    vertices, faces = tube([[x, y, top - length * share] for share in np.linspace(0, 1, 25)], radius, sides=16)
    return vertices, faces, np.clip((top - vertices[:, 2]) / length * 6 - 2.5, 0, 1)[:, None]


def skinned(vertices, lower, at_hip, at_knee):
    """Linear blend skinning by two bones, whose joints turn about the y axis."""
    hip = np.array([0, 0, vertices[:, 2].max()])
    knee = hip - [0, 0, np.ptp(vertices[:, 2]) / 2]
    upper_leg = vertices - hip
    lower_leg = (vertices - knee) @ about(1, at_knee).T + knee - hip
    return hip + ((1 - lower) * upper_leg + lower * lower_leg) @ about(1, at_hip).T


trunk = joined([box([0.18, 0.34, 0.55], centre=[0, 0, 1.15]), tube([[0, 0, 1.4], [0, 0, 1.62]], 0.08)])
limbs = [limb(0, y, top, length, radius) for y, top, length, radius in
         ((-0.1, 0.9, 0.8, 0.07), (0.1, 0.9, 0.8, 0.07), (-0.26, 1.4, 0.6, 0.05), (0.26, 1.4, 0.6, 0.05))]
vertices, faces = joined([trunk] + [part[:2] for part in limbs])
cloth, cloth_faces = sheet(1.2, 1.7, 40, 56)


def walking(time):
    """The character's vertices: it walks along x, its legs and arms against each other."""
    parts = [trunk[0]]
    for number, (points, _, lower) in enumerate(limbs):
        phase = 5 * time + np.pi * (number in (1, 2))
        bend = 25 + 25 * np.cos(phase)
        parts.append(skinned(points, lower, 30 * np.sin(phase), bend if number < 2 else -bend))
    return np.concatenate(parts) + [time - 1, 0, 0]


def carried(time):
    """The cloth's vertices: who passes carries it along, and it swings back."""
    way = 0.5 * np.exp(-6 * (time - 1.2) ** 2) * (1 - cloth[:, 2] / 1.7) * np.exp(-6 * cloth[:, 1] ** 2)
    return cloth + np.stack([way + 0.03 * np.sin(20 * cloth[:, 1] + 3 * time), *np.zeros((2, len(cloth)))], 1)


scene = tandem.Scene([tandem.build(vertices, faces), tandem.build(cloth, cloth_faces)], asset=[0, 1], translation=np.zeros((2, 3)))
times = np.linspace(0, 2.4, 121)
touching, loosest = [], 1
for time in times:
    scene.deform(0, walking(time))
    scene.deform(1, carried(time))
    touching.append(len(scene.contacts().contacts))
    loosest = max(loosest, scene.looseness(0), scene.looseness(1))
through = times[np.flatnonzero(touching)]
print(f"they touch from {through[0]:.2f} s to {through[-1]:.2f} s, in at most {max(touching)} pairs of triangles")
print(f"their trees became at most {loosest:.2f} times as loose")

if "--picture" in sys.argv:
    time = times[np.argmax(touching)]
    bodies = [tandem.build(walking(time), faces), tandem.build(carried(time), cloth_faces)]
    tandem.view(bodies, tandem.instances(asset=[0, 1], translation=np.zeros((2, 3))), picture="curtain.png", size=(640, 400), azimuth=35, elevation=10)
