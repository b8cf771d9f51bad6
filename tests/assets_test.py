#!/usr/bin/python3
"""Checks the meshes in assets/ without any code of the generator: counts, closedness, orientation, topology, extent.

Usage: assets_test.py [FOLDER]. Exit code 0 when every check holds, else 1.
"""
import pathlib
import sys
from collections import Counter

import numpy as np

CLOSED = {"cow_1500.obj": 1500, "cow.obj": 6000, "cow_24000.obj": 24000,
          "box_12.obj": 12, "box_48.obj": 48, "box_192.obj": 192}
SHEETS = {"ground.obj": 20000}
# Coarse to fine: each mesh is the midpoint subdivision of the one before it.
SUBDIVISIONS = [["cow_1500.obj", "cow.obj", "cow_24000.obj"], ["box_12.obj", "box_48.obj", "box_192.obj"]]
DECIMALS = 6
MAX_BYTES = 2_000_000

failures = 0


def check(holds, name, claim):
    global failures
    if not holds:
        failures += 1
        print(f"FAILED: {name}: {claim}")


def read_obj(path):
    points, triangles = [], []
    for line in path.read_text(encoding="ascii").splitlines():
        kind, *words = line.split()
        if kind == "v":
            # Whole micrometres: sums and comparisons below are then exact.
            points.append([round(float(word) * 10**DECIMALS) for word in words])
            check(all(len(w.partition(".")[2]) <= DECIMALS for w in words), path.name, f"six decimals: {line}")
        elif kind == "f":
            triangles.append([int(word) - 1 for word in words])
        else:
            check(kind == "#", path.name, f"unexpected line: {line}")
    return np.array(points, dtype=np.int64), np.array(triangles, dtype=np.int64)


def directed_edges(triangles):
    return Counter((t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3))


def components(vertex_count, triangles):
    root = list(range(vertex_count))

    def find(v):
        while root[v] != v:
            root[v] = root[root[v]]
            v = root[v]
        return v

    for a, b, c in triangles.tolist():
        root[find(a)] = root[find(b)] = find(c)
    return len({find(v) for v in range(vertex_count)})


def fans_per_vertex_are_single(triangles):
    """Whether the triangles around each vertex make one fan: following the opposite edges visits them all."""
    following = {}
    for a, b, c in triangles.tolist():
        for v, start, end in ((a, b, c), (b, c, a), (c, a, b)):
            following.setdefault(v, {})[start] = end
    for ring in following.values():
        start = at = next(iter(ring))
        steps = 0
        while at in ring and steps <= len(ring):
            at, steps = ring[at], steps + 1
            if at == start:
                break
        if steps != len(ring):
            return False
    return True


def areas_twice(points, triangles):
    a, b, c = (points[triangles[:, k]] / 10**DECIMALS for k in range(3))
    return np.cross(b - a, c - a)


def check_mesh(name, points, triangles, expected):
    check(triangles.shape == (expected, 3), name, f"{expected} triangles, has {triangles.shape}")
    check(triangles.min() >= 0 and triangles.max() < len(points), name, "indices in range")
    check(len(np.unique(triangles)) == len(points), name, "every vertex used")
    check(len(np.unique(points, axis=0)) == len(points), name, "no two vertices at one place")
    check((np.linalg.norm(areas_twice(points, triangles), axis=1) > 1e-9).all(), name, "no flat triangle")
    check(components(len(points), triangles) == 1, name, "one component")
    check(max(directed_edges(triangles).values()) == 1, name, "no directed edge twice")


def check_closed(name, points, triangles):
    edges = directed_edges(triangles)
    check(all(edges[(b, a)] == 1 for a, b in list(edges)), name, "each edge twice, in opposite directions")
    check(len(points) - len(edges) // 2 + len(triangles) == 2, name, "Euler characteristic 2")
    check(fans_per_vertex_are_single(triangles), name, "one fan of triangles around each vertex")
    a, b, c = (points[triangles[:, k]] / 10**DECIMALS for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    check(volume > 0, name, "oriented outwards")
    return volume


def check_sheet(name, points, triangles):
    edges = directed_edges(triangles)
    border = sum(1 for a, b in edges if (b, a) not in edges)
    undirected = (len(edges) + border) // 2
    check(border == 400, name, f"a border of 400 edges, has {border}")
    check(len(points) - undirected + len(triangles) == 1, name, "Euler characteristic 1")
    check((areas_twice(points, triangles)[:, 2] > 0).all(), name, "faces up")
    check((points.max(0) - points.min(0))[:2].tolist() == [60_000_000] * 2, name, "60 m x 60 m")
    check(abs(points[:, 2]).max() <= 1_000_000, name, "heights within 1 m")


def midpoint_subdivision(points, triangles):
    """The triangles, as a set of cyclically normalised corner coordinates; doubled, so that midpoints are whole."""
    corners = (points * 2)[triangles]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) // 2, (b + c) // 2, (c + a) // 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return normalised(np.concatenate([np.stack(part, axis=1) for part in parts]))


def normalised(corners):
    result = set()
    for triangle in corners.tolist():
        p, q, r = (tuple(corner) for corner in triangle)
        result.add(min((p, q, r), (q, r, p), (r, p, q)))
    return result


def check_extent(meshes):
    for name in SUBDIVISIONS[1]:
        points = meshes[name][0]
        check(points.min(0).tolist() == [-500_000] * 3 and points.max(0).tolist() == [500_000] * 3, name, "unit cube")
    for name in SUBDIVISIONS[0]:
        points = meshes[name][0]
        length, width, height = (points.max(0) - points.min(0)) / 10**DECIMALS
        check(1 < length < 1.6 and width < height < length, name, f"a cow's extent: {length} {width} {height}")
        check(abs(points[:, 2].min()) < 10_000, name, "stands on z = 0 to 1 cm")


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent / "assets"
    expected = {**CLOSED, **SHEETS}
    found = {path.name for path in folder.glob("*.obj")}
    check(found == set(expected), str(folder), f"the files {sorted(expected)}, found {sorted(found)}")
    meshes = {name: read_obj(folder / name) for name in sorted(found & set(expected))}
    for name, (points, triangles) in meshes.items():
        check((folder / name).stat().st_size < MAX_BYTES, name, f"below {MAX_BYTES} bytes")
        check_mesh(name, points, triangles, expected[name])
        if name in CLOSED:
            volume = check_closed(name, points, triangles)
            print(f"{name}: {len(points)} vertices, {len(triangles)} triangles, closed, chi 2, {volume:.6f} m3")
        else:
            check_sheet(name, points, triangles)
            print(f"{name}: {len(points)} vertices, {len(triangles)} triangles, chi 1, faces up")
    if found == set(expected):
        check_extent(meshes)
        for family in SUBDIVISIONS:
            for coarse, fine in zip(family, family[1:]):
                points, triangles = meshes[fine]
                same = midpoint_subdivision(*meshes[coarse]) == normalised((points * 2)[triangles])
                check(same, fine, f"the midpoint subdivision of {coarse}, exactly")
        print("subdivisions: each is the exact midpoint subdivision of the one before")
    print("all checks hold" if failures == 0 else f"{failures} checks failed")
    return 0 if failures == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
