"""A reader of .bvh files, version 1, that shares no code with the project: what the tests hold the tools against."""
import dataclasses
import json
import struct
from fractions import Fraction

import numpy as np

MAGIC = b"\x89BVH\r\n\x1a\n"
HEADER = struct.Struct("<8sQIHHQ3d3f3fQdIIQ16s")
SECTION = struct.Struct("<IIQQQ")
LEVEL = np.dtype([("triangles", "<u4"), ("blocks", "<u4"), ("leaf_blocks", "<u4"), ("depth", "<u4"),
                  ("error_bound", "<f8"), ("vertices", "<u4"), ("flags", "<u4")])
BLOCK = np.dtype([("centre", "<f4", (3, 4)), ("half_extent", "<f4", (3, 4)), ("index", "<u4", 4), ("kind", "<u4", 4)])
TRIANGLE = np.dtype([("corner", [("position", "<f4", 3), ("w", "<u4")], 3)])
PART = np.dtype([("name_offset", "<u4"), ("name_bytes", "<u4"), ("path_offset", "<u4"), ("path_bytes", "<u4"),
                 ("first_face", "<u8"), ("face_count", "<u8")])
ORIENTED_BLOCK = np.dtype([("centre", "<f4", (3, 4)), ("half_extent", "<f4", (3, 4)), ("first_below", "<u4"),
                           ("size", "<f4"), ("quaternion", "<u2", 4)])
TOPOLOGY = np.dtype([("vertex", "<u4", 3), ("flags", "<u4")])
COMPONENT = np.dtype([("first_triangle", "<u4"), ("triangles", "<u4"), ("flags", "<u4"), ("reserved", "<u4")])
KINDS = {1: ("levels", LEVEL), 2: ("blocks", BLOCK), 3: ("triangles", TRIANGLE), 4: ("parts", PART),
         5: ("strings", np.dtype("u1")), 6: ("provenance", np.dtype("u1")), 7: ("oriented_blocks", ORIENTED_BLOCK),
         8: ("topology", TOPOLOGY), 9: ("components", COMPONENT),
         10: ("source_vertices", np.dtype("<u4"))}
OF_A_LEVEL = ("blocks", "triangles", "oriented_blocks", "topology", "components", "source_vertices")
INTERNAL, LEAF, IMAGINARY = 0, 1, 2
NO_INDEX = 0xFFFFFFFF
LEAF_BLOCK = 1 << 31

assert HEADER.size == 128 and SECTION.size == 32 and LEVEL.itemsize == 32
assert BLOCK.itemsize == 128 and TRIANGLE.itemsize == 48 and PART.itemsize == 32
assert ORIENTED_BLOCK.itemsize == 112 and TOPOLOGY.itemsize == COMPONENT.itemsize == 16


@dataclasses.dataclass
class BvhFile:
    """One file, as seen at one of its levels. Corner positions are relative to `origin`."""
    raw: bytes
    level: int
    hash: int
    origin: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    source_faces: int
    rounding_error: float
    levels: np.ndarray
    blocks: np.ndarray
    triangles: np.ndarray
    oriented_blocks: np.ndarray | None
    topology: np.ndarray | None
    components: np.ndarray | None
    source_vertex_count: int
    source_vertices: np.ndarray | None
    parts: list
    provenance: dict

    @property
    def corners(self):
        """float32[triangles, 3 corners, 3]."""
        return self.triangles["corner"]["position"]

    @property
    def world(self):
        """float64[triangles, 3 corners, 3]: the file's coordinates."""
        return self.corners.astype(np.float64) + self.origin

    @property
    def source_face(self):
        return self.triangles["corner"]["w"][:, 0]

    @property
    def part(self):
        return self.triangles["corner"]["w"][:, 1]


def read(path, level=0):
    with open(path, "rb") as file:
        return parse(file.read(), level)


def parse(raw, wanted=0):
    (magic, content_hash, order, major, minor, size, ox, oy, oz, *rest) = HEADER.unpack_from(raw)
    lower, upper = rest[0:3], rest[3:6]
    source_faces, rounding_error, section_count, level_count, source_vertex_count, reserved = rest[6:]
    assert magic == MAGIC and order == 0x01020304 and (major, minor) == (1, 0)
    assert size == len(raw) and reserved == bytes(16) and wanted < level_count <= 32
    found = {}
    end = HEADER.size + section_count * SECTION.size
    for i in range(section_count):
        kind, level, offset, length, count = SECTION.unpack_from(raw, HEADER.size + i * SECTION.size)
        name, dtype = KINDS[kind]
        assert level < level_count and offset % 256 == 0 and offset >= end and length == count * dtype.itemsize
        assert not any(raw[end:offset]), "gaps are zero"
        end = offset + length
        if level != wanted and name in OF_A_LEVEL:
            continue
        assert name not in found
        found[name] = np.frombuffer(raw, dtype, count, offset)
    assert not any(raw[end:])
    strings = found["strings"].tobytes() if "strings" in found else b""

    def text(offset, length):
        return strings[offset:offset + length].decode()

    parts = [(text(p["name_offset"], p["name_bytes"]), text(p["path_offset"], p["path_bytes"]),
              int(p["first_face"]), int(p["face_count"])) for p in found["parts"]]
    assert len(found["levels"]) == level_count
    return BvhFile(raw, wanted, content_hash, np.array([ox, oy, oz]), np.array(lower, np.float32), np.array(upper, np.float32),
                   source_faces, rounding_error, found["levels"], found["blocks"], found["triangles"],
                   found.get("oriented_blocks"), found.get("topology"), found.get("components"), source_vertex_count,
                   found.get("source_vertices"), parts,
                   json.loads(found["provenance"].tobytes()))


def imaginary_minimum(triangles):
    """((-N) mod 4) + ((1 - L) mod 3), with L = ceil(N / 4) leaf blocks."""
    return -triangles % 4 + (1 - (triangles + 3) // 4) % 3


def xxh64(data, seed=0):
    """XXH64 after its specification."""
    mask = (1 << 64) - 1
    p1, p2, p3, p4, p5 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63,
                          0x27D4EB2F165667C5)

    def rotl(x, bits):
        return (x << bits | x >> (64 - bits)) & mask

    def step(lane, word):
        return rotl((lane + word * p2) & mask, 31) * p1 & mask

    at = 0
    if len(data) >= 32:
        lanes = [(seed + p1 + p2) & mask, (seed + p2) & mask, seed, (seed - p1) & mask]
        for words in struct.iter_unpack("<4Q", data[:len(data) // 32 * 32]):
            lanes = [step(lane, word) for lane, word in zip(lanes, words)]
        at = len(data) // 32 * 32
        result = sum(rotl(lane, bits) for lane, bits in zip(lanes, (1, 7, 12, 18))) & mask
        for lane in lanes:
            result = ((result ^ step(0, lane)) * p1 + p4) & mask
    else:
        result = (seed + p5) & mask
    result = (result + len(data)) & mask
    for (word,) in struct.iter_unpack("<Q", data[at:at + (len(data) - at) // 8 * 8]):
        result = (rotl(result ^ step(0, word), 27) * p1 + p4) & mask
        at += 8
    if len(data) - at >= 4:
        result = (rotl(result ^ struct.unpack_from("<I", data, at)[0] * p1 & mask, 23) * p2 + p3) & mask
        at += 4
    for byte in data[at:]:
        result = rotl(result ^ byte * p5 & mask, 11) * p1 & mask
    result = (result ^ result >> 33) * p2 & mask
    result = (result ^ result >> 29) * p3 & mask
    return result ^ result >> 32


def interval(block, node, axis):
    centre, half = (Fraction(float(block[key][axis, node])) for key in ("centre", "half_extent"))
    return centre - half, centre + half


def walk(file):
    """Follows the tree depth first and yields (block index, depth, block); a block that comes twice is an error."""
    seen = set()
    pending = [(0, 1)]
    while pending:
        index, depth = pending.pop()
        assert index not in seen, f"block {index} has two parents"
        seen.add(index)
        block = file.blocks[index]
        yield index, depth, block
        children = [int(child) for child, kind in zip(block["index"], block["kind"]) if kind == INTERNAL]
        pending += [(child, depth + 1) for child in reversed(children)]


def defects_of_tree(file):
    """Sentences about everything that is wrong with the tree but for the boxes."""
    defects, reached, depths, visited = [], [], [], 0
    for index, depth, block in walk(file):
        if index != visited:
            defects.append(f"block {index} does not lie in depth-first order")
        visited += 1
        depths.append(depth)
        kinds = block["kind"].tolist()
        real = [kind for kind in kinds if kind != IMAGINARY]
        if len(set(real)) != 1 or not set(real) <= {INTERNAL, LEAF}:
            defects.append(f"block {index} is not pure: {kinds}")
        if kinds != sorted(kinds):
            defects.append(f"block {index}: imaginary nodes come last: {kinds}")
        for node, kind in enumerate(kinds):
            if kind == LEAF:
                reached.append(int(block["index"][node]))
            empty = (block["half_extent"][:, node] == -np.inf).all() and (block["centre"][:, node] == 0).all()
            if (kind == IMAGINARY) != bool(empty and block["index"][node] == NO_INDEX):
                defects.append(f"block {index}, node {node}: an imaginary node and the empty box go together")
    if reached != list(range(len(file.triangles))):
        defects.append("the leaves do not name the triangles one after the other")
    if visited != len(file.blocks):
        defects.append("not every block is reached")
    if max(depths) != file.levels[file.level]["depth"]:
        defects.append("the depth is not what the level says")
    return defects


def defects_of_boxes(file):
    """Sentences about every box that does not contain what lies below it, in exact arithmetic. Slow: small files."""
    defects = []
    for index, _, block in walk(file):
        for node, kind in enumerate(block["kind"]):
            below = int(block["index"][node])
            for axis in range(3):
                if kind == LEAF:
                    inner = [(Fraction(float(x)),) * 2 for x in file.corners[below, :, axis]]
                elif kind == INTERNAL:
                    child = file.blocks[below]
                    inner = [interval(child, i, axis) for i in range(4) if child["kind"][i] != IMAGINARY]
                else:
                    continue
                lower, upper = interval(block, node, axis)
                if any(low < lower or high > upper for low, high in inner):
                    defects.append(f"block {index}, node {node}, axis {axis}: the box does not contain what is below")
    return defects


def whole(values):
    """float32 numbers as whole multiples of 2^-149, exactly."""
    return [int(Fraction(float(x)) * (1 << 149)) for x in values]


def rotation_of(oriented):
    """The matrix that the quaternion stands for, times its squared length, and that length: whole numbers."""
    w, x, y, z = (int(part) - 2048 for part in oriented["quaternion"])
    return [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]], w * w + x * x + y * y + z * z


def oriented_size(oriented):
    """By FORMAT.md: the squares, sums and the root of float64 numbers, and the result rounded to float32."""
    x, y, z = oriented["half_extent"].astype(np.float64)
    real = x >= 0
    surface = ((x * y + y * z) + z * x)[real]
    return np.float32(np.sqrt(surface.max() / 3))


def holds(oriented, node, points, farthest):
    """Whether an oriented box holds the points, whole multiples of 2^-149, and reaches no farther than it may, which is
    `farthest`, squared, of the points' distances from the origin, and a 2^20th more along each axis."""
    rotation, length = rotation_of(oriented)
    centre, half = (whole(oriented[key][:, node]) for key in ("centre", "half_extent"))
    sound = all((abs(c) + h) ** 2 << 40 <= farthest * (((1 << 20) + 1) ** 2 + 1) for c, h in zip(centre, half))
    for axis in range(3):
        a, b, c = (rotation[i][axis] for i in range(3))
        along = [a * x + b * y + c * z for x, y, z in points]
        sound = sound and length * (centre[axis] - half[axis]) <= min(along)
        sound = sound and max(along) <= length * (centre[axis] + half[axis])
    return sound


def defects_of_oriented_blocks(file):
    """Sentences about everything that is wrong with the oriented blocks, in exact arithmetic. Slow: small files."""
    defects, number, next_number, end = [], {0: 0}, 1, {}
    points = [whole(point) for point in file.corners.reshape(-1, 3)]
    reach = [max(abs(x) for node in range(4) if file.blocks[0]["kind"][node] != IMAGINARY
                 for x in interval(file.blocks[0], node, axis)) * (1 << 149) for axis in range(3)]
    farthest = int(sum(x * x for x in reach))
    blocks = list(walk(file))
    for index, _, block in reversed(blocks):
        below = [int(at) for at, kind in zip(block["index"], block["kind"]) if kind != IMAGINARY]
        end[index] = below[-1] + 1 if block["kind"][0] == LEAF else end[below[-1]]
    first = 0  # triangle of the nodes to come
    for index, _, block in blocks:
        oriented = file.oriented_blocks[number[index]]
        leaf_block = block["kind"][0] == LEAF
        expected = LEAF_BLOCK | int(block["index"][0]) if leaf_block else next_number
        if oriented["first_below"] != expected:
            defects.append(f"oriented block of block {index}: names {oriented['first_below']}, not {expected}")
        parts = oriented["quaternion"].astype(int) - 2048
        if not parts.any() or abs(parts).max() > 2047:
            defects.append(f"oriented block of block {index}: no rotation: {parts}")
        if oriented["size"] != oriented_size(oriented):
            defects.append(f"oriented block of block {index}: size {oriented['size']}")
        begin = int(block["index"][0]) if leaf_block else first
        for node, kind in enumerate(block["kind"]):
            below = int(block["index"][node])
            if kind == IMAGINARY:
                box = oriented["centre"][:, node].tobytes(), oriented["half_extent"][:, node]
                if box[0] != bytes(12) or not (box[1] == -np.inf).all():
                    defects.append(f"oriented block of block {index}, node {node}: imaginary and empty go together")
                continue
            if kind == INTERNAL:
                number[below] = next_number
                next_number += 1
            past = below + 1 if kind == LEAF else end[below]
            if not holds(oriented, node, points[3 * begin:3 * past], farthest):
                defects.append(f"oriented block of block {index}, node {node}: the box does not hold what is below")
            begin = past
        if leaf_block:
            first = begin
    if next_number != len(file.oriented_blocks):
        defects.append("there are other oriented blocks than blocks")
    return defects


def _numbered(keys):
    """The number of each row, by first appearance."""
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse.ravel()]


def _groups(count, pairs):
    """The lowest member of the group of each of `count` things, which pairs join."""
    lowest = np.arange(count)
    while True:
        least = np.minimum(lowest[pairs[:, 0]], lowest[pairs[:, 1]])
        joined = lowest.copy()
        np.minimum.at(joined, lowest[pairs].ravel(), np.repeat(least, 2))
        joined = joined[joined]
        if (joined == lowest).all():
            return lowest
        lowest = joined


def defects_of_topology(file):
    """Sentences about everything that is wrong with the topology, but for which side is outside."""
    defects, n = _defects_of_source_vertices(file), len(file.triangles)
    places = file.corners.reshape(-1, 3) + np.float32(0)
    if file.source_vertices is not None:  # tells vertices at one position apart
        apart = file.source_vertices[file.topology["vertex"].ravel()]
        places = np.column_stack([places.astype(np.float64), apart])
    vertex = _numbered(places).reshape(n, 3)
    if (file.topology["vertex"] != vertex).any():
        defects.append("vertices are not the positions, numbered as they appear")
    if file.levels[file.level]["vertices"] != vertex.max() + 1:
        defects.append("the level says another number of vertices")
    start, end = vertex.ravel(), np.roll(vertex, -1, axis=1).ravel()
    side = np.flatnonzero(start != end)
    edge = _numbered(np.sort(np.stack([start, end], 1)[side], axis=1)) if len(side) else side
    sides = np.bincount(edge)
    flags = np.zeros(3 * n, np.int64)
    flags[side] = np.where(sides[edge] == 1, 2, np.where(sides[edge] > 2, 16, 0)) << side % 3
    if ((file.topology["flags"] & ~np.uint32(1)) != flags.reshape(n, 3).sum(1)).any():
        defects.append("flags do not count the sides of edges")
    turned = (file.topology["flags"] & 1).astype(bool)
    up = (start < end)[side]
    balance = np.bincount(edge, np.where(up != turned[side // 3], 1, -1), len(sides))
    first_side = np.zeros(len(sides), np.int64)
    first_side[edge[::-1]] = side[::-1]
    pairs = np.stack([first_side[edge] // 3, side // 3], 1)
    component = _groups(n, pairs)
    first = np.unique(component)
    count = np.bincount(component, minlength=n)[first]
    open_ones = np.unique(component[first_side[balance != 0] // 3])
    closed = ~np.isin(first, open_ones)
    wanted = np.stack([first, count, closed, np.zeros_like(first)], 1)
    if file.components.view("<u4").reshape(-1, 4).tolist() != wanted.tolist():
        defects.append("components are not what edges join, closed where each is run along both ways")
    if file.levels[file.level]["flags"] != closed.all():
        defects.append("the level is closed where all components are, and says otherwise")
    if (2 * np.bincount(component, turned, n)[first] > count)[~closed].any():
        defects.append("more than half of an open component is turned")
    return defects + _defects_of_windings(n, turned, side, edge, sides, up)


def _defects_of_source_vertices(file):
    if file.source_vertices is None:
        return []
    source = file.source_vertices
    sound = len(source) == file.levels[file.level]["vertices"] and source.max() < file.source_vertex_count
    return [] if sound and len(np.unique(source)) == len(source) else ["source vertices are in range, each once"]


def _defects_of_windings(n, turned, side, edge, sides, up):
    """Each triangle twice, as it is and the other way round: a patch cannot be oriented where both are one group."""
    order = np.argsort(edge, kind="stable")
    order = order[sides[edge[order]] == 2].reshape(-1, 2)
    pair, differ = side[order] // 3, up[order[:, 0]] == up[order[:, 1]]
    both = np.concatenate([np.stack([pair[:, 0], pair[:, 1] + n * differ], 1),
                           np.stack([pair[:, 0] + n, pair[:, 1] + n * ~differ], 1)])
    group = _groups(2 * n, both)
    orientable = group[:n] != group[n:]
    wrong = (turned[pair[:, 0]] != turned[pair[:, 1]]) != differ
    return ["windings disagree where they could agree"] if (wrong & orientable[pair[:, 0]]).any() else []
