"""Meshes, ready to be asked about."""
from __future__ import annotations

import contextlib
import json
import math
import os
import sys
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _tandem
from ._arrays import NotNumbers, Rows, number, whole_number
from ._errors import Error, with_path

if TYPE_CHECKING:
    from ._scene import Scene

__all__ = ["Asset", "Level", "Part"]

_MOST = 0xFFFFFFFF
# The section table of a .bvh file, version 1 (formats/FORMAT.md).
_SECTION = np.dtype([("kind", "<u4"), ("level", "<u4"), ("offset", "<u8"), ("bytes", "<u8"), ("count", "<u8")])
_SECTION_COUNT, _SECTION_TABLE = 96, 128
_SECTION_KINDS = ("levels", "blocks", "triangles", "parts", "strings", "provenance", "oriented_blocks", "topology", "components", "source_vertices")
_CORNER = np.dtype([("position", "<f4", 3), ("w", "<u4")])  # of tandem.h
# The figures of statistics(), in the order of the extension's numbers.
_TREE = ("triangles", "nodes", "leaf_nodes", "internal_nodes", "imaginary_nodes", "imaginary_minimum", "imaginary_fraction", "leaf_blocks", "internal_blocks",
         "partial_leaf_blocks", "depth", "leaf_fill", "sah_cost", "leaf_blocks_at_depth", "blocks_with_fill")
_SURFACE = ("vertices", "components", "closed_components", "turned_triangles", "boundary_edges", "sides_at_edges_of_many")
_WORK = ("expected_block_pairs", "expected_candidates", "expected_oriented_block_pairs", "expected_oriented_candidates")


class Level(NamedTuple):
    """A level of detail of an asset; level 0 is the finest."""

    triangle_count: int
    block_count: int
    leaf_block_count: int
    #: The depth of the tree, in blocks.
    depth: int
    #: No point of this surface or of the file's finest is farther from the other.
    error_bound: float
    #: Exact queries on a GPU walk them.
    has_oriented_blocks: bool
    #: Manifolds and contained bodies need it.
    has_topology: bool
    #: Different positions of corners; this and the next two are 0 and False without topology.
    vertex_count: int
    #: Triangles that edges join.
    component_count: int
    #: Says whether all components are closed.
    closed: bool


class Info(NamedTuple):
    """The facts that Asset tells about itself."""

    level_count: int
    first_level: int
    part_count: int
    file_bytes: int
    hash: int
    source_faces: int
    source_vertices: int
    origin: tuple[float, float, float]
    rounding_error: float
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


class Part(NamedTuple):
    """A run of faces that the mesh file gives a name."""

    name: str
    #: The names of scene nodes, joined by "/".
    path: str
    first_face: int
    face_count: int


class Asset(NotNumbers):
    """The checked contents of one .bvh file: a mesh and its trees, at one or more levels of detail.

    It never changes, and threads may share it. Made by `Asset.load`, `Asset.from_bytes` and `tandem.build`. It pickles, as its bytes.
    """

    __slots__ = ("_core", "_info", "_scene", "__weakref__")
    _core: _tandem.Asset
    _info: Info
    _scene: Scene

    def __init__(self) -> None:
        raise TypeError("Asset.load, Asset.from_bytes and tandem.build make assets")

    @classmethod
    def _of(cls, core: _tandem.Asset) -> Asset:
        made = cls.__new__(cls)
        made._core = core
        made._info = Info(*core.info())
        return made

    @staticmethod
    def load(path: str | os.PathLike[str], *, access: Literal["map", "read"] = "map", check: Literal["full", "quick"] = "full") -> Asset:
        """Opens and checks a .bvh file.

        Args:
            path: of the file.
            access: "map" maps its pages, and nobody may write to it or cut it short meanwhile (replacing it by a rename is safe); "read" copies it.
            check: "quick" believes what oriented boxes hold and what topology says; nothing is read out of bounds.

        Raises:
            FileError: it cannot be found or read.
            Error: it is no .bvh file, or a defect of it.
        """
        read, quick = _choice("access", access, ("map", "read")), _choice("check", check, ("full", "quick"))
        name = os.fsencode(path)
        if b"\0" in name:
            raise ValueError("path has a zero byte")
        try:
            return Asset._of(_tandem.open(name, bool(read), bool(quick)))
        except Error as error:
            raise with_path(error, os.fsdecode(path)) from None

    @staticmethod
    def from_bytes(data: Any, *, check: Literal["full", "quick"] = "full") -> Asset:
        """Checks the bytes of a .bvh file, any contiguous buffer, and copies them. Errors and `check`: as of `load`."""
        return Asset._of(_tandem.from_bytes(data, bool(_choice("check", check, ("full", "quick")))))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file: whole, or not at all (into a temporary file beside it, which then gets its name).

        Raises:
            PermissionError: on Windows, too, where an asset maps the file that is to be replaced.
        """
        import tempfile  # here, and not for every import of the package
        path = os.path.realpath(path)  # a link stays one
        try:
            descriptor, aside = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=os.path.dirname(path))
        except OSError as error:
            raise type(error)(error.errno, error.strerror, path) from None
        try:
            with open(descriptor, "wb") as file:
                file.write(self.data)
                if sys.platform != "win32":  # There, the folder decides who may read the file.
                    mask = os.umask(0)
                    os.umask(mask)
                    os.fchmod(file.fileno(), 0o666 & ~mask)
            os.replace(aside, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(aside)
            raise

    @property
    def data(self) -> memoryview:
        """The bytes of the file, without a copy; they live as long as the view."""
        return memoryview(self._core)

    def __bytes__(self) -> bytes:
        return bytes(self.data)

    def __buffer__(self, flags: int) -> memoryview:
        return self.data

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (bytes(self), self._info.first_level, self._info.level_count)

    def __repr__(self) -> str:
        return f"<tandem.Asset of {self.levels[0].triangle_count} triangles, {self._info.level_count} levels>"

    def levels_from(self, first: int, count: int = 0) -> Asset:
        """An asset that shows `count` levels of this one from level `first` on; 0: all. Questions are about the first that an asset shows. The bytes are shared.

        Raises:
            Error: there is no level `first`.

        >>> box.levels_from(1)
        Traceback (most recent call last):
        tandem._errors.Error: the asset has no such level or part
        """
        return Asset._of(self._core.levels_from(whole_number(first, "first", 0, _MOST), whole_number(count, "count", 0, _MOST)))

    def closest(self, points: npt.ArrayLike, *, threads: int = 1, **options: Any) -> Rows:
        """Finds the closest point of the mesh to each of the points, in the mesh file's coordinates: as `Scene.closest` of a scene that has only this body.

        >>> box.closest([[0.5, 0.5, 0.75], [2.0, 0.5, 0.5]], sides=True)["winding"].tolist()
        [1, 0]
        """
        return self._alone(threads).closest(points, **options)

    def rays(self, origins: npt.ArrayLike, directions: npt.ArrayLike, *, threads: int = 1, **options: Any) -> Rows:
        """Finds where rays meet the mesh, in the mesh file's coordinates: as `Scene.rays` of a scene that has only this body.

        >>> box.rays([-2, 0.25, 0.5], [1, 0, 0], hits="all")["t"].tolist()
        [2.0, 3.0]
        """
        return self._alone(threads).rays(origins, directions, **options)

    def _alone(self, threads: int) -> Scene:
        """The scene that has only this body, made when it is first asked."""
        from ._scene import Scene

        if not hasattr(self, "_scene"):
            self._scene = Scene([self], translation=[0, 0, 0])
        self._scene.threads = threads
        return self._scene

    def coarsest_level(self, tolerance: float) -> int:
        """The coarsest level whose error_bound is at most `tolerance`, in the mesh's unit; 0 where none is."""
        return self._core.coarsest_level(number(tolerance, "tolerance"))

    @property
    def levels(self) -> list[Level]:
        """The levels of detail that the asset shows, the finest first."""
        return [Level(*self._core.level(level)) for level in range(self._info.level_count)]

    @property
    def first_level(self) -> int:
        """The file's number of the finest level that the asset shows."""
        return self._info.first_level

    def triangles(self, level: int = 0) -> npt.NDArray[np.float64]:
        """Corners of a level's triangles, (n, 3, 3), in the mesh file's coordinates; triangles as contacts number them."""
        return self._corners(level)["position"] + self.origin

    def faces(self, level: int = 0) -> npt.NDArray[np.uint32]:
        """Returns for each triangle of a level the face of the mesh file that it comes from, (n,).

        >>> box.triangles().shape, sorted(box.faces().tolist()) == list(range(12))
        ((12, 3, 3), True)
        """
        return np.ascontiguousarray(self._corners(level)["w"][:, 0])

    def _corners(self, level: int) -> npt.NDArray[np.void]:
        return np.frombuffer(self._core.triangles(whole_number(level, "level", 0, _MOST)), _CORNER).reshape(-1, 3)

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """The lower and the upper corner of all levels, (2, 3), in the mesh file's coordinates."""
        return np.array([self._info.lower, self._info.upper]) + self.origin

    @property
    def origin(self) -> npt.NDArray[np.float64]:
        """The point that is added to stored coordinates, (3,)."""
        return np.array(self._info.origin)

    @property
    def rounding_error(self) -> float:
        """The most that a stored coordinate differs from that of the mesh file."""
        return self._info.rounding_error

    @property
    def hash(self) -> str:
        """The hash of the content, as bvhinfo prints it."""
        return f"{self._info.hash:016x}"

    @property
    def file_bytes(self) -> int:
        """The size of the file, with all levels."""
        return self._info.file_bytes

    @property
    def source_faces(self) -> int:
        """Faces of the mesh file."""
        return self._info.source_faces

    @property
    def source_vertices(self) -> int:
        """Vertices of the mesh file, of which each has a row in `Scene.deform`; 0: the asset cannot be deformed."""
        return self._info.source_vertices

    @property
    def parts(self) -> list[Part]:
        """The objects, groups or scene nodes that the mesh file names."""
        found = (self._core.part(part) for part in range(self._info.part_count))
        return [Part(name.decode(errors="replace"), path.decode(errors="replace"), first, count) for name, path, first, count in found]

    @property
    def provenance(self) -> Any:
        """The file's JSON on how it was made, None where it is no JSON."""
        try:
            return json.loads(self._core.provenance())
        except (ValueError, RecursionError):
            return None

    def statistics(self) -> dict[str, Any]:
        """Returns what `bvhinfo --json` tells, under its keys (docs/json.md), but for "file": figures of the trees, and the work that queries are expected to
        do, which is sampled and takes a while."""
        (major, minor), tree, measured, surface = self._core.statistics()
        lower, upper = self._info.lower, self._info.upper
        diagonal = math.sqrt(sum((high - low) * (high - low) for low, high in zip(lower, upper)))
        levels = [{"triangles": level.triangle_count, "blocks": level.block_count, "depth": level.depth, "bytes": size, "error_bound": level.error_bound,
                   "error_bound_relative": level.error_bound / diagonal if diagonal else None, "closed": level.closed if level.has_topology else None,
                   **dict(zip(_WORK, work))} for level, (size, work) in zip(self.levels, measured)]
        sections = [dict(zip(("kind", *(_SECTION.names or ())[1:]), (_SECTION_KINDS[kind - 1], *rest))) for kind, *rest in sections_of(self).tolist()]
        return {"version": f"{major}.{minor}", "hash": self.hash, "bytes": self.file_bytes, **dict(zip(_TREE, tree)), **dict(zip(_WORK, measured[0][1])),
                "surface": None if surface is None else dict(zip(_SURFACE, surface)),
                "bounds": {"lower": list(lower), "upper": list(upper)}, "origin": list(self._info.origin), "rounding_error": self.rounding_error,
                "source_faces": self.source_faces, "source_vertices": self.source_vertices or None, "source": self.provenance, "parts": [part._asdict() for part in self.parts], "levels": levels,
                "sections": sections}


def sections_of(asset: Asset) -> npt.NDArray[np.void]:
    """The table of a file's sections: kind, level, offset, bytes and count of each."""
    count = int(np.frombuffer(asset.data, "<u4", 1, _SECTION_COUNT)[0])
    return np.frombuffer(asset.data, _SECTION, count, _SECTION_TABLE)


def _restore(data: bytes, first_level: int, level_count: int) -> Asset:
    whole = Asset.from_bytes(data)
    if (first_level, level_count) == (0, whole._info.level_count):
        return whole
    return whole.levels_from(first_level, level_count)


def _choice(name: str, given: str, choices: tuple[str, ...]) -> int:
    try:
        return choices.index(given)
    except ValueError:
        raise ValueError(f"{name} is {given!r} where one of {', '.join(map(repr, choices))} is wanted") from None
