"""A chain that hangs in MuJoCo, whose own contacts are those of convex hulls and throw its links apart."""
import sys

try:
    import mujoco
except ImportError:
    print("needs the package mujoco")
    sys.exit(77)

import numpy as np

import tandem.mujoco
from shapes import torus

LINKS = 5
vertices, triangles = torus(0.1, 0.02)
mesh = f"<mesh name='link' vertex='{' '.join(map(str, vertices.ravel()))}' face='{' '.join(map(str, triangles.ravel()))}'/>"
bodies = ""
for i in range(LINKS):  # each a quarter turn from the one before; the first is fixed
    bodies += f"<body name='link {i}' pos='0 0 {2 - 0.15 * i}' euler='90 {90 * (i % 2)} 0'>{'<freejoint/>' if i else ''}<geom type='mesh' mesh='link'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><asset>{mesh}</asset><worldbody>{bodies}</worldbody></mujoco>")

alone, data = mujoco.MjData(model), mujoco.MjData(model)
contacts = tandem.mujoco.MeshContacts(model)
while data.time < 2:
    mujoco.mj_step(model, alone)
    contacts.step(data)
    if alone.time < 0.1:
        thrown = alone.geom_xpos.copy(), alone.geom_xmat.reshape(-1, 3, 3).copy()

for i in range(1, LINKS):
    below, below_alone = (2 - state.body(f"link {i}").xpos[2] for state in (data, alone))
    print(f"link {i} hangs {below:.2f} m below the first" + (", alone MuJoCo has lost it" if below_alone > 5 else ""))

if "--picture" in sys.argv:
    from tandem.viewer import View

    both = np.concatenate([contacts.instances, contacts.instances])
    both["translation"][LINKS:], both["rotation"][LINKS:] = thrown[0] + [-0.35, 0.6, 0], thrown[1]
    shown = View(contacts.assets, both, contacts=True, off_screen=True, size=(640, 480), azimuth=30, elevation=10)
    shown.plotter.add_text("contacts of\nthe meshes,\nafter 2 s", position=(30, 360), font_size=11)
    shown.plotter.add_text("MuJoCo\nalone, after\n0.1 s", position=(490, 360), font_size=11)
    shown.picture("chain_in_mujoco.png")
