"""How fine a mesh must be: levels of detail, what each tells wrong at worst, and what is certain all the same."""
import pathlib
import sys

import numpy as np

import tandem

try:
    mesh = tandem.read_mesh(pathlib.Path(__file__).parent / "../../assets/cow_24000.obj")
except ImportError:
    print("needs the mesh tools, which were not built")
    sys.exit(77)
cow = tandem.build(mesh.vertices, mesh.triangles, levels="auto")
diagonal = np.linalg.norm(cow.bounds[1] - cow.bounds[0])

# A herd: 60 cows at random places and stances.
random = np.random.default_rng(1)
quarter = np.linalg.qr(random.normal(size=(60, 3, 3)))[0]
rotation = quarter * np.linalg.det(quarter)[:, None, None]
translation = random.uniform(-1.9, 1.9, (60, 3))

finest = None
for number, level in enumerate(cow.levels):
    found = tandem.Scene([cow.levels_from(number, 1)], rotation=rotation, translation=translation).contacts()
    touching = set(map(tuple, found.touching.tolist()))
    finest = finest or touching
    print(f"level {number}: {level.triangle_count:6,} triangles, off by at most {100 * level.error_bound / diagonal:.2f} % of the diagonal: "
          f"{len(touching)} pairs touch, {len(touching ^ finest)} of them otherwise than at level 0")

# Whoever gives a tolerance gets answers about the finest surfaces, each from the coarsest levels that prove it.
tolerance = 0.01 * diagonal
told = tandem.Scene([cow], rotation=rotation, translation=translation).verdicts(tolerance=tolerance).verdicts
for verdict, meaning in ((tandem.APART, "surely apart"), (tandem.TOUCH, "surely touch"), (tandem.WITHIN_TOLERANCE, "at most 1 % of the diagonal apart")):
    rows = told[told["verdict"] == verdict]
    print(f"{len(rows):4} pairs {meaning}, of which {np.count_nonzero(rows['level_a'])} were decided at a coarser level")

if "--picture" in sys.argv:
    from tandem.viewer import View

    places = np.array([[1.6 * (k % 3), 0, -1.4 * (k // 3)] for k in range(len(cow.levels))])
    side_by_side = tandem.instances(np.zeros(len(places), int), translation=places)
    shown = View([cow], side_by_side, levels=np.arange(len(places)), color="asset", off_screen=True, size=(640, 420), azimuth=-90, elevation=5)
    told = [f"{level.triangle_count:,} triangles\n{100 * level.error_bound / diagonal:.2f} % off at most" for level in cow.levels]
    shown.plotter.add_point_labels(places - shown.origin + [0, 0, -0.1], told, font_size=15, bold=False, shape=None, show_points=False,
                                   always_visible=True, justification_horizontal="center", justification_vertical="top")
    shown.picture("how_fine.png")
