"""The second extension, where CGAL and assimp were found: what bvhbuild has, for the package's own files."""
from collections.abc import Callable, Sequence
from typing import Any

import numpy.typing as npt
from typing_extensions import Buffer

_Rows = Buffer | npt.NDArray[Any]  # whose types, before NumPy 2, do not say that they are buffers

# A mesh: points, corners of triangles, the face of each, parts, remarks; or None and why there is none.
def read(path: bytes, own_readers: bool, outside_files: bool, /) -> tuple[Any, ...]: ...
def build(points: _Rows, corners: _Rows, face_begin: _Rows, face_of: _Rows | None, parts: Sequence[tuple[str, str, int]], effort: int, gpu_blocks: bool,
          topology: bool, refit: bool, threads: int, imaginary_share: float, levels: str, provenance: str | None, progress: Callable[[float], object] | None,
          /) -> tuple[bytes | None, tuple[int, ...]]: ...
