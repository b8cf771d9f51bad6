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


def update(rows):
    return peer_table(rows, lambda row: three_digits(row["update_ms"]))


def memory(rows):
    return peer_table(rows, lambda row: size(row["memory_bytes"]))
