"""The builder, in memory."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy.typing as npt

from . import _tandem
from ._arrays import floats, whole_numbers
from ._asset import Asset, _choice

__all__ = ["BuildReport", "build"]


class BuildReport(NamedTuple):
    """What became of the triangles."""

    #: Left out, each under the first cause that holds.
    index_out_of_range: int
    not_finite: int
    too_large: int
    #: The corners lie on one line.
    degenerate: int
    #: Kept: the three places of an earlier one.
    duplicate: int
    #: Of these, wound otherwise.
    duplicate_reversed: int
    #: On one line only once rounded to float32.
    flattened: int
    #: Named by no triangle.
    vertices_unreferenced: int
    #: At the place of an earlier one.
    vertices_welded: int


def build(vertices: npt.ArrayLike, faces: npt.ArrayLike, *, effort: Literal["default", "fast", "best"] = "default", threads: int = 0,
          gpu_blocks: bool = True, topology: bool = True, imaginary_share: float = 0.0, face_ids: npt.ArrayLike | None = None,
          parts: Sequence[tuple[str, str, int]] | None = None, provenance: str | None = None, progress: Callable[[float], object] | None = None,
          return_report: bool = False) -> Any:
    """Builds an asset of triangles: the bytes that bvhbuild writes for them.

    Args:
        vertices: (n, 3), float64.
        faces: (m, 3), three vertices for each triangle.
        effort: "fast", "default", or "best", which takes minutes for 100,000 triangles.
        threads: at most; 0: as many as the machine has. The bytes do not depend on it.
        gpu_blocks: with the blocks that exact queries on a GPU walk.
        topology: with what manifolds and contained bodies need.
        imaginary_share: padding nodes: 0, the proven fewest, to 1, as many as a free tree has.
        face_ids: (m,), the face that each triangle is a piece of; its own number where not given.
        parts: name, path and number of faces of each run of faces with a name.
        provenance: JSON that the file says of its making.
        progress: called now and then with the share of the optimisation that is done. What it raises ends the build, as Ctrl-C does, and is raised here.
        return_report: return (asset, BuildReport) instead of the asset.

    Raises:
        Error: no triangle can be used; a face is in no part.
        ValueError, TypeError: which name the argument.
    """
    points = floats(vertices, "vertices", 3)
    if points.ndim != 2:
        raise ValueError(f"vertices has shape {points.shape} where (n, 3) is wanted")
    corners = _triangles(faces)
    ids = None
    if face_ids is not None:
        ids = whole_numbers(face_ids, "face_ids")
        if ids.shape != (len(corners),):
            raise ValueError(f"face_ids has shape {ids.shape} where ({len(corners)},) is wanted")
    if not 0 <= imaginary_share <= 1:
        raise ValueError(f"imaginary_share is {imaginary_share} where 0 to 1 is wanted")
    core, report = _tandem.build(points, corners, ids, [tuple(part) for part in parts or ()], _choice("effort", effort, ("default", "fast", "best")), gpu_blocks,
                                 topology, threads, imaginary_share, provenance, progress)
    asset = Asset._of(core)
    return (asset, BuildReport(**report)) if return_report else asset


def _triangles(faces: npt.ArrayLike) -> npt.NDArray[Any]:
    corners = whole_numbers(faces, "faces")
    if corners.size == 0:
        return corners.reshape(0, 3)
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise ValueError(f"faces has shape {corners.shape} where (m, 3) is wanted")
    return corners
