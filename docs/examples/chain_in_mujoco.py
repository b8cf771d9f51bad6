"""A chain that hangs in MuJoCo, whose own contacts are those of convex hulls and throw its links apart."""
import sys

try:
    import mujoco
except ImportError:
    print("needs the package mujoco")
    sys.exit(77)

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

for i in range(1, LINKS):
    below, below_alone = (2 - state.body(f"link {i}").xpos[2] for state in (data, alone))
    print(f"link {i} hangs {below:.2f} m below the first" + (", alone MuJoCo has lost it" if below_alone > 5 else ""))

if "--picture" in sys.argv:
    tandem.view(contacts.assets, contacts.instances, contacts=True, picture="chain_in_mujoco.png", size=(640, 400), azimuth=30, elevation=10)
