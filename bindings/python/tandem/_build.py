"""The builder, in memory, and the readers of mesh files."""
from __future__ import annotations

import marshal
import os
import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, Literal, NamedTuple, Protocol, overload

import numpy as np
import numpy.typing as npt

from . import _tandem
from ._arrays import any_whole_numbers, flag, floats, number, whole_number, whole_numbers
from ._asset import Asset, Part, _choice
from ._errors import Error, FileError, with_path

__all__ = ["BuildReport", "Mesh", "build", "read_mesh"]

_MOST_COORDINATE = float.fromhex("0x1.fffp127")  # kMaxCoordinate of the builder


class BuildReport(NamedTuple):
    """Counts what became of the triangles."""

    #: Left out, each under the first cause that holds.
    not_finite: int
    too_large: int
    #: Left out: the corners lie on one line.
    degenerate: int
    #: Kept: the three places of an earlier one.
    duplicate: int
    #: Those of the duplicates that are wound otherwise.
    duplicate_reversed: int
    #: Triangles whose corners are on one line only once they are rounded to float32.
    flattened: int
    #: Named by no triangle.
    vertices_unreferenced: int
    #: Vertices at the place of an earlier one.
    vertices_welded: int


class Mesh(NamedTuple):
    """The contents of a mesh file: `tandem.build(mesh.vertices, mesh.triangles, face_ids=mesh.face_ids, parts=mesh.parts)` is what bvhbuild makes of it."""

    #: (n, 3), as the file has them.
    vertices: npt.NDArray[np.float64]
    #: (m, 3): the file's faces, split into triangles.
    triangles: npt.NDArray[np.uint32]
    #: (m,): the face of the file that each triangle is a piece of.
    face_ids: npt.NDArray[np.uint32]
    #: Objects, groups or scene nodes.
    parts: list[Part]
    #: Oddities, for people.
    remarks: list[str]


class MeshLike(Protocol):
    """A mesh of another library, such as a trimesh.Trimesh."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


Vertices = npt.ArrayLike | MeshLike
Faces = npt.ArrayLike | Sequence[Sequence[int]] | None
Effort = Literal["default", "fast", "best"]
Levels = Literal["auto"] | Sequence[float | str]
#: Name, path and, last, number of faces of each.
Parts = Sequence[Part] | Sequence[tuple[str, str, int]]
Progress = Callable[[float], object]


@overload
def build(vertices: Vertices, faces: Faces = ..., *, effort: Effort = ..., levels: Levels | None = ..., threads: int = ...,
          gpu_blocks: bool = ..., topology: bool = ..., refit: bool = ..., imaginary_share: float = ..., face_ids: npt.ArrayLike | None = ..., parts: Parts | None = ..., poses: npt.ArrayLike | None = ...,
          provenance: str | None = ..., progress: Progress | None = ..., return_report: Literal[False] = ...) -> Asset: ...


@overload
def build(vertices: Vertices, faces: Faces = ..., *, effort: Effort = ..., levels: Levels | None = ..., threads: int = ...,
          gpu_blocks: bool = ..., topology: bool = ..., refit: bool = ..., imaginary_share: float = ..., face_ids: npt.ArrayLike | None = ..., parts: Parts | None = ..., poses: npt.ArrayLike | None = ...,
          provenance: str | None = ..., progress: Progress | None = ..., return_report: Literal[True]) -> tuple[Asset, BuildReport]: ...


def build(vertices: Vertices, faces: Faces = None, *, effort: Effort = "default", levels: Levels | None = None, threads: int = 0,
          gpu_blocks: bool = True, topology: bool = True, refit: bool = True, imaginary_share: float = 0.0, face_ids: npt.ArrayLike | None = None, parts: Parts | None = None, poses: npt.ArrayLike | None = None,
          provenance: str | None = None, progress: Progress | None = None, return_report: bool = False) -> Asset | tuple[Asset, BuildReport]:
    """Builds an asset: the bytes that bvhbuild writes for these faces, but for what they say of their making.

    Args:
        vertices: (n, 3), float64; or, without faces, a mesh that has `vertices` and `faces`, such as a trimesh.Trimesh.
        faces: (m, 3), the numbers of each triangle's vertices, from 0; or polygons, (m, k) or a list of lists, which need the mesh tools.
        effort: "fast", "default", or "best", which takes minutes for 100,000 triangles.
        levels: coarser levels of the mesh, each proved to be at most so far from the finest: lengths, or shares of the diagonal such as "1%", ascending; "auto"
            is 0.1 %, 0.3 %, 1 % and 3 %. Needs the mesh tools.
        threads: at most; 0: as many as the machine has. The bytes do not depend on it.
        gpu_blocks: with the blocks that exact queries on a GPU walk.
        topology: with what manifolds and contained bodies need.
        refit: with what refitting the tree to a bent mesh needs, which is left out without topology.
        imaginary_share: padding nodes: 0, the proven fewest, to 1, as many as a free tree has.
        face_ids: (m,), the face of the caller's mesh that each one is a piece of; its own number where not given.
        parts: of each run of faces with a name: name, path and number of faces, or what `read_mesh` says.
        poses: (k, n, 3), the vertices in k other shapes that the mesh takes: the tree is made for the mean over all of them, for `Scene.deform`. Triangles alone,
            without levels.
        provenance: JSON that the file says of its making.
        progress: called now and then, in this thread, with the share of the optimisation that is done; effort "fast" has none. What it raises ends the build
            before the next step, as Ctrl-C does: within seconds for a million triangles.
        return_report: return (asset, BuildReport) instead of the asset.

    Raises:
        Error: no triangle can be used; faces are in no part.
        ValueError, TypeError: which name the argument and the row, such as the first face with a vertex that there is not.
        ImportError: the mesh tools are needed and not installed.

    >>> tetrahedron = tandem.build([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> tetrahedron.levels[0].triangle_count, tetrahedron.levels[0].closed
    (4, True)
    """
    mesh: Any = vertices
    if faces is None:
        try:
            mesh, faces = mesh.vertices, mesh.faces
        except AttributeError:
            raise TypeError(f"faces is missing, or {type(mesh).__name__} has no vertices and faces of its own") from None
    points = floats(mesh, "vertices", 3)
    if points.ndim != 2:
        raise ValueError(f"vertices has shape {points.shape} where (n, 3) is wanted")
    corners, face_begin = _polygons(faces, len(points))
    count = len(corners) // 3 if face_begin is None else len(face_begin) - 1
    ids = None if face_ids is None else whole_numbers(face_ids, "face_ids", 0xFFFFFFFD)
    if ids is not None and ids.shape != (count,):
        raise ValueError(f"face_ids has shape {ids.shape} where ({count},) is wanted")
    posed = _poses(poses, len(points))
    if len(posed) and (levels is not None or face_begin is not None):
        raise ValueError("poses are for triangles without levels")
    share = number(imaginary_share, "imaginary_share")
    if not 0 <= share <= 1:
        raise ValueError(f"imaginary_share is {share} where 0 to 1 is wanted")
    workers = whole_number(threads, "threads", 0, 4096)
    named = _named_parts(parts)
    if provenance is not None:
        _text(provenance, "provenance")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress is {type(progress).__name__} where a function is wanted")
    gpu, topological, bends = flag(gpu_blocks, "gpu_blocks"), flag(topology, "topology"), flag(refit, "refit")
    reported = flag(return_report, "return_report")
    strength = _choice("effort", effort, ("default", "fast", "best"))
    if levels is None and face_begin is None:
        core, report = _tandem.build(points, posed, corners, ids, named, strength, gpu, topological, bends, workers, share, provenance, progress)
        asset = Asset._of(core)
    else:
        if face_begin is None:
            face_begin = np.arange(0, 3 * count + 1, 3, dtype=np.uint32)
        data, report = _mesh_tools().build(points, corners, face_begin, ids, named, strength, gpu, topological, bends, workers, share,
                                           _words(levels), provenance, progress)
        if data is None:
            raise _no_triangle()
        asset = Asset.from_bytes(data)
    return (asset, BuildReport(*report[1:])) if reported else asset


def read_mesh(path: str | os.PathLike[str], *, outside_files: bool = False) -> Mesh:
    """Reads a mesh file as bvhbuild does: OBJ, PLY, STL, OFF, glTF and GLB by its own readers, whatever else assimp reads in a child process.

    Args:
        outside_files: lets a glTF file name buffers elsewhere than in its folder or below it.

    Raises:
        FileError: it cannot be read; the text says why, with the line where there is one. It is a FileNotFoundError, PermissionError or IsADirectoryError too
            where open() raises that.
        ImportError: the mesh tools are not installed, and it is no OBJ, PLY, STL or OFF file of triangles and quads.
    """
    name = os.fsencode(path)
    if b"\0" in name:
        raise ValueError("path has a zero byte")
    outside = flag(outside_files, "outside_files")
    tools = None
    try:
        tools = _mesh_tools()
    except ImportError as error:
        read = _tandem.read(name)
        if read[0] is None and read[2]:
            raise ImportError(f"{os.fsdecode(path)}: {read[1].decode(errors='replace')}, and {error}") from None
    if tools is not None:
        read = tools.read(name, True, outside)
    if tools is not None and read[0] is None:
        # assimp is run by a fork, which a process with threads must not do: a fresh interpreter can.
        import subprocess  # here, and not for every import of the package
        script = ("import importlib.util, marshal, sys; spec = importlib.util.spec_from_file_location('_bvhbuild', sys.argv[1]); "
                  "tools = importlib.util.module_from_spec(spec); spec.loader.exec_module(tools); "
                  "marshal.dump(tools.read(sys.argv[2].encode('utf-8', 'surrogateescape'), False, sys.argv[3] == 'True'), sys.stdout.buffer)")
        done = subprocess.run([sys.executable, "-I", "-S", "-X", "utf8", "-c", script, str(tools.__file__), name, str(outside)], capture_output=True)
        if done.returncode != 0:
            raise with_path(FileError(f"the reader's process failed: {done.stderr.decode(errors='replace')}"), os.fsdecode(path))
        read = marshal.loads(done.stdout)
    if read[0] is None:
        raise with_path(FileError(read[1].decode(errors="replace")), os.fsdecode(path))
    points, triangles, faces, parts, remarks = read
    return Mesh(np.frombuffer(bytearray(points), np.float64).reshape(-1, 3), np.frombuffer(bytearray(triangles), np.uint32).reshape(-1, 3),
                np.frombuffer(bytearray(faces), np.uint32), [Part(name.decode(errors="replace"), path.decode(errors="replace"), first, count)
                                                             for name, path, first, count in parts],
                [remark.decode(errors="replace") for remark in remarks])


def _poses(poses: npt.ArrayLike | None, vertex_count: int) -> npt.NDArray[np.float64]:
    """Poses of a mesh with so many vertices, checked; (0, n, 3) where there are none."""
    if poses is None or vertex_count == 0:
        return np.empty((0, vertex_count, 3))
    posed = floats(poses, "poses", vertex_count, 3).reshape(-1, vertex_count, 3)
    bad = ~(np.abs(posed) <= _MOST_COORDINATE)
    if bad.any():
        pose, vertex, _ = np.argwhere(bad)[0]
        raise ValueError(f"poses: vertex {vertex} of pose {pose} is not finite or too large")
    return posed


def _polygons(faces: Any, vertex_count: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32] | None]:
    """Vertices of all faces, one after the other, and where each begins; None for triangles."""
    if not isinstance(faces, np.ndarray) and hasattr(faces, "__len__"):
        lengths = {len(face) for face in faces if hasattr(face, "__len__")}
        if len(lengths) > 1:
            rows = [_vertices_of(any_whole_numbers(face, f"faces: row {row}"), vertex_count, row) for row, face in enumerate(faces)]
            begin = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
            return np.concatenate(rows), begin.astype(np.uint32)
    corners = any_whole_numbers(faces, "faces")
    if corners.size == 0:
        return np.empty(0, np.uint32), None
    if corners.ndim != 2:
        raise ValueError(f"faces has shape {corners.shape} where (m, 3) is wanted")
    corners = _vertices_of(corners, vertex_count)
    if corners.shape[1] == 3:
        return corners.reshape(-1), None
    return corners.reshape(-1), np.arange(0, corners.size + 1, corners.shape[1], dtype=np.uint32)


def _vertices_of(faces: npt.NDArray[Any], count: int, first_row: int = 0) -> npt.NDArray[np.uint32]:
    """Faces whose vertices are there, one, or (m, k) from row `first_row` on."""
    bad = (faces < 0) | (faces >= count)
    if bad.any():
        first = np.argwhere(bad)[0]
        row = first_row + (int(first[0]) if faces.ndim > 1 else 0)
        raise ValueError(f"faces: row {row} has vertex {faces[tuple(first)]} where 0 to {count - 1} is wanted" if count else f"faces: row {row}: there are no vertices")
    return np.asarray(faces, np.uint32, order="C")


def _words(levels: Levels | None) -> str:
    """Errors of levels as bvhbuild takes them."""
    if levels is None or isinstance(levels, str):
        return levels or ""
    try:
        entries = list(levels)
    except TypeError:
        raise TypeError(f"levels is {type(levels).__name__} where \"auto\" or a list is wanted") from None
    words = ",".join(entry if isinstance(entry, str) else repr(number(entry, "levels")) for entry in entries)
    return _text(words, "levels")


def _named_parts(parts: Parts | None) -> list[tuple[str, str, int]]:
    named: list[tuple[str, str, int]] = []
    next_face = 0
    for row, part in enumerate(parts or ()):
        if not isinstance(part, tuple) or len(part) not in (3, 4):
            raise TypeError(f"parts: row {row} is not (name, path, number of faces)")
        if len(part) == 4 and part[2] != next_face:
            raise ValueError(f"parts: row {row} begins at face {part[2]} where {next_face} is wanted: parts follow each other")
        named.append((_text(part[0], f"parts: row {row}: name"), _text(part[1], f"parts: row {row}: path"),
                      whole_number(part[-1], f"parts: row {row}: number of faces", 0, 0xFFFFFFFF)))
        next_face += named[-1][2]
    if next_face >= 0xFFFFFFFF:
        raise ValueError("parts have 2^32 - 1 faces or more together")
    return named


def _text(text: Any, name: str) -> str:
    if not isinstance(text, str):
        raise TypeError(f"{name} is {type(text).__name__} where a string is wanted")
    if "\0" in text:
        raise ValueError(f"{name} has a zero character")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{name} is no UTF-8: {error}") from None
    return text


def _mesh_tools() -> ModuleType:
    try:
        from . import _bvhbuild
    except ImportError as error:
        raise ImportError("this tandem was built without its mesh tools (readers, polygons, levels of detail), which need CGAL and assimp: docs/python.md") from error
    return _bvhbuild


def _no_triangle() -> Error:
    from ._errors import from_status
    status = _tandem.NO_TRIANGLE
    error = from_status(status, *_tandem.status_words(status), 0)
    assert isinstance(error, Error)
    return error
