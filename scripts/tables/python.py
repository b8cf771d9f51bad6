"""Tables of docs/python_trimesh.md and docs/results/python_tables.md: what `compare_python_fcl` and `python_peers` measured."""
from common.tabular import markdown, three_digits, whole


def errors(rows):
    """One row for each kind of scenes, and their sum."""
    heads = ["scenes", "bodies that collide", "Tandem errs", "python-fcl misses", "invents", "triangle pairs of those not convex", "Tandem errs", "python-fcl misses", "invents"]
    columns = [("colliding",), ("tandem_missed", "tandem_invented"), ("fcl_missed",), ("fcl_invented",), ("triangle_pairs",),
               ("tandem_triangles_missed", "tandem_triangles_invented"), ("fcl_triangles_missed",), ("fcl_triangles_invented",)]
    counts = [[sum(int(row[name]) for name in names) for names in columns] for row in rows]
    lines = [[row["kind"], *map(whole, line)] for row, line in zip(rows, counts)] + [["all", *map(whole, map(sum, zip(*counts)))]]
    return markdown(heads, lines)


def managers(rows):
    """One row for each pile: milliseconds of a frame by both collision managers."""
    peers = {"tandem.trimesh, names": "`tandem.trimesh`, names", "trimesh + python-fcl, names": "python-fcl, names",
             "tandem.trimesh, data": "`tandem.trimesh`, data", "trimesh + python-fcl, data": "python-fcl, data"}
    found = {(int(row["bodies"]), row["peer"]): float(row["frame_ms"]) for row in rows}
    lines = [[whole(bodies), *(three_digits(found[bodies, peer]) for peer in peers)] for bodies in dict.fromkeys(bodies for bodies, _ in found)]
    return markdown(["cows", *peers.values()], lines, "r")


def speed(rows):
    """One row for each peer, three columns for each scene."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    found = {(row["scene"], row["peer"]): row for row in rows}
    heads = ["peer"] + [head for scene in scenes for head in (f"{scene}: set up", "frame", "wrong")]
    lines = []
    for peer in dict.fromkeys(row["peer"] for row in rows):
        cells = [found[scene, peer] for scene in scenes]
        lines.append([peer] + [text for row in cells for text in (three_digits(float(row["set_up_ms"])), three_digits(float(row["frame_ms"])),
                                                                  whole(int(row["missed"]) + int(row["invented"])))])
    return markdown(heads, lines)
