"""Tables of what `bvhbench compare` measured, from rows as `scripts/plot_compare --csv` prints them."""

from common import tabular
from common.tabular import markdown, size, three_digits, whole

TEXT = ("scene", "peer")
KINDS = ["stack", "pile", "slide"]


def read(path):
    """[row, ...]: numbers as float, None where there is none."""
    return [{name: value if name in TEXT else float(value) if value else None for name, value in row.items()} for row in tabular.read(path)]


def natural_order(scene):
    """pile_6000 comes before pile_24000, and stacks come first."""
    kind, _, triangles = scene.rpartition("_")
    return (KINDS.index(kind) if kind in KINDS else len(KINDS), kind, int(triangles) if triangles.isdigit() else 0, scene)


def is_ordinary(scene):
    return natural_order(scene)[0] < len(KINDS)


def peer_table(rows, cell):
    """A row for each scene, a column for each peer."""
    peers = list(dict.fromkeys(row["peer"] for row in rows))
    cells = {(row["scene"], row["peer"]): cell(row) for row in rows}
    scenes = sorted({row["scene"] for row in rows}, key=natural_order)
    return markdown(["scene", *peers], [[scene.replace("_", " "), *(cells.get((scene, peer), "–") for peer in peers)] for scene in scenes])


def query(rows):
    return peer_table(rows, lambda row: three_digits(row["query_ms_best"]))


def ratio(rows):
    exact = {row["scene"]: row["query_ms_best"] for row in rows if row["peer"] == "Tandem exact"}
    return peer_table(rows, lambda row: three_digits(row["query_ms_best"] / exact[row["scene"]]))


def contacts(rows):
    return peer_table(rows, lambda row: whole(row["contacts"]))


def wrong_cell(row):
    if row["missed"] is None:
        return "–"
    return "0" if row["missed"] + row["invented"] == 0 else f"{whole(row['missed'])} / {whole(row['invented'])}"


def wrong(rows):
    return peer_table(rows, wrong_cell)


# A part of a scene's name tells what makes the scene hard.
HARD = {"exact": "faces coincide", "coincident": "bodies coincide", "_at_": "far from the origin"}


def group_of(scene):
    return next((words for part, words in HARD.items() if part in scene), "ordinary")


def wrong_by_group(rows):
    """A row for each group of scenes, a column for each peer that is judged by CGAL: the most contact pairs of a scene, and the most that are missed and invented."""
    told = [row for row in rows if row["missed"] is not None]
    peers = [peer for peer in dict.fromkeys(row["peer"] for row in told) if peer != "CGAL"]
    lines = []
    for group in ("ordinary", *HARD.values()):
        some = [row for row in told if group_of(row["scene"]) == group]
        most = [{name: max(row[name] for row in some if row["peer"] == peer) for name in ("missed", "invented")} for peer in peers]
        contact_pairs = max(row["contacts"] for row in some if row["peer"] == "CGAL")
        lines.append([group, whole(contact_pairs), *map(wrong_cell, most)])
    return markdown(["scenes", "contacts", *peers], lines)


def frame_costs(rows, scene):
    """A row for each peer: its update in every frame and its memory in a scene. Tandem has one, as its modes do not differ in them."""
    some = [row for row in rows if row["scene"] == scene and row["peer"] not in ("Tandem fast", "Tandem boxes")]
    return markdown(["peer", "update, ms", "memory"], [[row["peer"], three_digits(row["update_ms"]), size(row["memory_bytes"])] for row in some])


def update(rows):
    return peer_table(rows, lambda row: three_digits(row["update_ms"]))


def memory(rows):
    return peer_table(rows, lambda row: size(row["memory_bytes"]))
