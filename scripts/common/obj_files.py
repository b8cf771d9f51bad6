"""Reads OBJ files. Needs numpy."""
import re

import numpy as np

from common import tools


def read(path):
    """Vertices (n, 3) and triangles (m, 3) of an OBJ file, whose faces become fans. Ends the script where the file cannot be read."""
    vertices, corners = [], []
    with tools.reading(path):
        for line in path.read_text().splitlines():
            what, *words = line.split() or [""]
            if what == "v":
                vertices.append([float(word) for word in words[:3]])
            elif what == "f":
                face = [int(re.match(r"\d+", word)[0]) - 1 for word in words]
                corners += [(face[0], *edge) for edge in zip(face[1:], face[2:])]
    return np.array(vertices), np.array(corners)


def text(vertices, triangles):
    """What an OBJ file of such vertices and triangles says."""
    return "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()) + "".join(f"f {i} {j} {k}\n" for i, j, k in (triangles + 1).tolist())
