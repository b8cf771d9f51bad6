"""Tables of what `scripts/gpu_bench` measured."""

from common import tabular
from common.tabular import markdown, three_digits, whole

LARGE = {"million": "a million cows of 24,000 triangles, `pile --neighbours 1`",
         "distinct": "1,042 cows of 96,000 triangles, each bent in another way, lattice of 0.70"}
LEFT_OUT = ("stack_48", "pile_6000", "slide_6000", "coincident_1500", "pile_1500_far_1e4")  # much like scenes that are shown
SCENES = {"lattice_46_070": "lattice 46³ 0.70", "lattice_46_086": "lattice 46³ 0.86", "lattice_10_070": "lattice 10³ 0.70"}


def read(path):
    """{scene: [row, ...]}, rows of mode exact as dictionaries of text."""
    scenes = {}
    for row in tabular.read(path):
        if row["mode"] == "exact":
            scenes.setdefault(row["scene"], []).append(row)
    return scenes


def find(rows, backend, engine="tandem", options="", threads=None):
    """The row of a scene that was measured so, or one without figures."""
    for row in rows:
        if (row["backend"], row["engine"], row["options"]) == (backend, engine, options) and threads in (None, row["threads"]):
            return row
    return {}


def value(row, name):
    return float(row[name]) if row.get(name) else None


def shown(milliseconds):
    return "" if milliseconds is None else three_digits(milliseconds)


def figures(rows):
    """Cells that both tables have, by the head of their column."""
    exact = find(rows, "cuda")
    cells = {head: whole(value(exact, head.replace(" ", "_"))) for head in ("instances", "object pairs", "contacts")}
    times = {"query": "contacts", "whole": "whole"}
    cells |= {head: shown(value(exact, f"{name}_median_ms")) for head, name in times.items()}
    for head, options in (("grouping", "grouped"), ("sorting", "sorted")):
        ordered = value(find(rows, "cuda", options=options), "contacts_median_ms")
        cells[head] = "" if ordered is None else shown(ordered - value(exact, "contacts_median_ms"))
    cells["16 CPU threads"] = shown(value(find(rows, "cpu", threads="16"), "whole_median_ms"))
    return cells


def scene_cells(scene, rows):
    cells = figures(rows) | {"scene": SCENES.get(scene, scene.replace("_", " "))}
    cells["first contacts alone"] = shown(value(find(rows, "cuda", options="first_contact"), "contacts_median_ms"))
    cells["the paper's scheme, whole"] = shown(value(find(rows, "cuda", "paper"), "whole_median_ms"))
    cells["one CPU core"] = shown(value(find(rows, "cpu", threads="1"), "whole_median_ms"))
    return cells


def scenes(results):
    heads = ["scene", "object pairs", "contacts", "query", "whole", "grouping", "sorting", "first contacts alone", "the paper's scheme, whole",
             "one CPU core", "16 CPU threads"]
    rows = [scene_cells(scene, rows) for scene, rows in results.items() if scene not in LEFT_OUT]
    return markdown(heads, [[cells[head] for head in heads] for cells in rows])


def chosen(results):
    """The few scenes and columns that docs/gpu.md shows."""
    heads = ["scene", "contacts", "whole", "one CPU core", "16 CPU threads"]
    rows = [scene_cells(scene, results[scene]) for scene in ("pile_24000", "pile_1500_x100000", "lattice_46_070")]
    return markdown(heads, [[cells[head] for head in heads] for cells in rows])


def large_cells(scene, rows):
    exact = find(rows, "cuda")
    cells = figures(rows) | {"scene": LARGE[scene]}
    # Bodies of one asset share its triangles; else each body has triangles of its own.
    shared = int(exact["instances"]) if exact["assets"] == "1" else 1
    cells["distinct triangles"] = whole(int(exact["triangles"]) / shared)
    cells["upload, s"] = three_digits(value(exact, "upload_ms") / 1e3)
    cells["memory"] = " / ".join(f"{int(exact[name]) / 1e9:.2f}" for name in ("gpu_bytes", "gpu_bytes_bound", "gpu_bytes_taken"))
    return cells


def large(results):
    heads = ["scene", "instances", "distinct triangles", "object pairs", "contacts", "whole", "sorting", "upload, s", "16 CPU threads", "memory"]
    rows = [[cells[head] for head in heads] for cells in (large_cells(*item) for item in results.items())]
    return markdown(heads, rows, "l" + "r" * (len(heads) - 2) + "l")
