"""The table scenes.json as the Python tests of the doors read it: bodies, and comparison of what was found. contract_test.cpp has the same for C++ and C."""
import json
import math
from pathlib import Path

import numpy as np

TABLE = json.loads((Path(__file__).parent / "scenes.json").read_text(encoding="utf-8"))
SCENES = {scene["name"]: scene for scene in TABLE["scenes"]}


def scattered(scatter):
    """Bodies at random, by SplitMix64 and IEEE arithmetic alone, so that every door scatters the same."""
    state, least, bodies = scatter["seed"], scatter.get("at", 0), []

    def uniform():
        nonlocal state
        state = (state + 0x9E3779B97F4A7C15) % 2**64
        z = (state ^ state >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
        return ((z ^ z >> 31) >> 11) * 2.0**-53

    for _ in range(scatter["count"]):
        asset, q = int(uniform() * scatter["assets"]), [uniform() - 0.5 for _ in range(4)]
        length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        w, x, y, z = (part / length for part in q)
        rotation = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
        bodies.append({"asset": asset, "rotation": rotation, "at": [uniform() * scatter["size"] + least for _ in range(3)]})
    return bodies


def bodies_of(entry):
    """Asset (n,), rotation (n, 3, 3) and translation (n, 3) of a list of bodies of the table, or of a rule that makes one."""
    if "row" in entry:
        entry = [[entry["row"][1] * i, 0, 0] for i in range(entry["row"][0])]
    elif "grid" in entry:
        nx, ny, nz = entry["grid"]
        entry = [[i % nx, i // nx % ny, i // nx // ny] for i in range(nx * ny * nz)]
    elif "scatter" in entry:
        entry = scattered(entry["scatter"])
    bodies = [{"at": body} if isinstance(body, list) else body for body in entry]
    asset = np.array([body.get("asset", 0) for body in bodies], np.uint32)
    rotation = np.array([body.get("rotation", np.eye(3)) for body in bodies], np.float64).reshape(-1, 3, 3)
    return asset, rotation, np.array([body["at"] for body in bodies], np.float64).reshape(-1, 3)


def motions_of(entry, bodies):
    """Velocity, angular velocity and centre of each body, (n, 9)."""
    if entry == "none":
        return np.zeros((bodies, 9))
    return np.array([row + [0] * (9 - len(row)) for row in entry], np.float64).reshape(-1, 9)


def option(value):
    """A number that is a string in the table."""
    return float(value) if value in ("nan", "inf", "-inf") else value


def hash_of(pairs, contacts):
    """XXH64 of object pairs and of the faces of contacts, sorted, by the rule of docs/scenes.md; within a body the lower face comes first."""
    import xxhash

    face_a, face_b = contacts["face_a"].copy(), contacts["face_b"].copy()
    of = pairs[contacts["pair"]]
    swapped = (of["a"] == of["b"]) & (face_b < face_a)
    face_a[swapped], face_b[swapped] = face_b[swapped], face_a[swapped]
    order = np.lexsort((face_b, face_a, contacts["pair"]))
    words = [pairs.view("<u4"), contacts["pair"][order], face_a[order], face_b[order]]
    return xxhash.xxh64(np.concatenate(words).astype("<u4").tobytes()).hexdigest()


def expect_rows(columns, count, expected):
    """Compares `count` rows, whose columns are lists, with the "rows", "least_rows", "columns" and "ranges" of an expectation. Columns that the door does not
    have are returned."""
    assert count == expected.get("rows", count) and count >= expected.get("least_rows", 0)
    unknown = []
    for kind in ("columns", "ranges"):
        for name, values in expected.get(kind, {}).items():
            assert count == len(values), name
            if name not in columns:
                unknown.append(name)
            elif kind == "columns":
                assert columns[name] == [option(value) if isinstance(value, str) else value for value in values], name
            else:
                found, ranges = np.asarray(columns[name], float), np.asarray(values, float)
                assert ((ranges[..., 0] <= found) & (found <= ranges[..., 1])).all(), (name, found.tolist())
    return unknown
