"""Which parts of an assembly clash: a gearbox as CAD programs write it, one file with named parts, in millimetres."""
import pathlib
import sys
import tempfile

import numpy as np

import tandem
from shapes import about, box, ring, rod


def write_gearbox(path):
    along_x, along_y = about(1, 90), about(0, -90)
    parts = {"base": box((200, 120, 10), (0, 0, -5)), "lost nut": box((5, 5, 3), (60, 30, -5)),
             "bracket left": box((15, 40, 25), (-82.5, 0, 12.5)), "bracket right": box((15, 40, 25), (82.5, 0, 12.5))}
    turned = {"bearing left": (ring(20, 10.05, 15), along_x, (-90, 0, 45)), "bearing right": (ring(20, 10.05, 15), along_x, (75, 0, 45)),
              "shaft": (rod(10, 200), along_x, (-100, 0, 45)), "gear": (ring(40, 10.05, 15, 64), along_x, (0, 0, 45)),
              "oil pipe": (rod(4, 110), along_y, (7, -55, 86))}
    for name, ((vertices, triangles), rotation, translation) in turned.items():
        parts[name] = vertices @ rotation.T + translation, triangles
    first = 1
    with open(path, "w") as file:
        for name, (vertices, triangles) in parts.items():
            file.write(f"o {name}\n")
            file.writelines(f"v {x} {y} {z}\n" for x, y, z in vertices)
            file.writelines(f"f {a} {b} {c}\n" for a, b, c in triangles + first)
            first += len(vertices)


with tempfile.TemporaryDirectory() as folder:
    write_gearbox(pathlib.Path(folder, "gearbox.obj"))
    try:
        mesh = tandem.read_mesh(pathlib.Path(folder, "gearbox.obj"))
    except ImportError:
        print("needs the mesh tools, which were not built")
        sys.exit(77)

names = [part.name for part in mesh.parts]
assets = []
for part in mesh.parts:
    of_part = (mesh.face_ids >= part.first_face) & (mesh.face_ids < part.first_face + part.face_count)
    assets.append(tandem.build(mesh.vertices, mesh.triangles[of_part]))
everything = tandem.instances(np.arange(len(assets)))
scene = tandem.Scene(assets, everything)
found = scene.contacts()
manifolds = scene.manifolds()

# Parts that touch face to face meet as well; the depth tells a joint from a clash. The shaft turns freely in its bearings, whose
# facets come within 0.002 mm of its own: decisions are exact, so there is no tolerance to choose.
clashes = []
for row in np.unique(found.contacts["pair"]):
    a, b = found.pairs[row]
    depth = manifolds.manifolds["depth"][manifolds.manifolds["pair"] == row].max()
    clashes += [row] if depth > 0.001 else []
    print(f"{names[a]} and {names[b]}", f"CLASH, {depth:.2f} mm deep" if depth > 0.001 else "touch")
# A part that lies wholly within another meets nothing of it; that is another question.
contained = scene.contained()
for row in contained.contained:
    a, b = contained.pairs[row["pair"]]
    print("{0} lies WITHIN {1}".format(*(names[a], names[b]) if row["inner"] == 0 else (names[b], names[a])))

if "--picture" in sys.argv:
    of_clashes = found._replace(contacts=found.contacts[np.isin(found.contacts["pair"], clashes)])
    tandem.view(assets, everything, contacts=of_clashes, picture="assembly_clashes.png", size=(640, 400), azimuth=-50)
