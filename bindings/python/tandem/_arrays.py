"""Arguments to arrays: each function names the argument, and the row, that is wrong."""
from __future__ import annotations

import operator
import sys
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ._rows import INSTANCE, PAIR

__all__ = ["Rows", "instances", "rotations"]

#: An array of rows, such as INSTANCE.
Rows = npt.NDArray[np.void]


class AsMatrix(Protocol):
    """A rotation, or a stack of them, of a library that has a class for these, such as scipy's Rotation."""

    def as_matrix(self) -> Any: ...


#: What `rotation` takes.
Rotations = npt.ArrayLike | AsMatrix

#: The largest distance that questions take, as coordinates, and the largest number.
FARTHEST, FINITE = 1e300, sys.float_info.max
_MOST = 0xFFFFFFFF
_IDENTITY, _ORIGIN = np.eye(3), np.zeros(3)
_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


class NotNumbers:
    """Base of a class whose objects lend their bytes as a buffer, which NumPy would read as an array of numbers."""

    __slots__ = ()


def _array(value: Any, name: str, wanted: str) -> npt.NDArray[Any]:
    """What NumPy makes of an argument, but for what is no array of anything."""
    for given in (value, *value[:1]) if isinstance(value, (list, tuple)) else (value,):
        if isinstance(given, NotNumbers):
            raise TypeError(f"{name}: {type(given).__name__} is given where {wanted} are wanted")
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} is no array: {error}") from None


def number(value: Any, name: str) -> float:
    """A float64."""
    if type(value) is float:
        return value
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {type(value).__name__} where a number is wanted") from None
    except OverflowError:
        raise ValueError(f"{name} is {value} where a float64 is wanted") from None


def flag(value: Any, name: str) -> bool:
    """True or False, Python's or NumPy's: whatever else has a truth value, such as "no", is refused."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise TypeError(f"{name} is {type(value).__name__} where True or False is wanted")


def amount(value: Any, name: str, most: float) -> float:
    """A float64 from 0 to `most`."""
    found = number(value, name)
    if not 0 <= found <= most:
        raise ValueError(f"{name} is {found} where 0 to {most} is wanted")
    return found


def whole_number(value: Any, name: str, least: int, most: int) -> int:
    """A whole number from `least` to `most`."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {type(value).__name__} where a whole number is wanted") from None
    if not least <= found <= most:
        raise ValueError(f"{name} is {found} where {least} to {most} is wanted")
    return found


def floats(value: npt.ArrayLike, name: str, *tail: int) -> npt.NDArray[np.float64]:
    """A contiguous float64 array of shape `tail` or (n, *tail)."""
    array = _array(value, name, "numbers")
    if array.dtype.kind not in "fiu" and array.size:
        raise TypeError(f"{name} has {array.dtype} where numbers are wanted")
    array = np.ascontiguousarray(array, dtype=np.float64) if array.ndim else array.astype(np.float64)
    if array.ndim == 1 and not array.size and tail:
        return array.reshape(0, *tail)
    if array.shape != tail and array.shape[1:] != tail:
        raise ValueError(f"{name} has shape {array.shape} where {tail} or (n, {str(tail)[1:].replace(',)', ')')} is wanted")
    return array


def any_whole_numbers(value: npt.ArrayLike, name: str, wanted: str = "whole numbers") -> npt.NDArray[Any]:
    """An array of whole numbers of any size; of any type where it is empty."""
    array = _array(value, name, wanted)
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(f"{name} has {array.dtype} where whole numbers are wanted")
    return array


def whole_numbers(value: npt.ArrayLike, name: str, most: int = _MOST, dtype: npt.DTypeLike = np.uint32, wanted: str = "whole numbers") -> npt.NDArray[Any]:
    """A contiguous array of whole numbers from 0 to `most`."""
    array = any_whole_numbers(value, name, wanted)
    if array.size and array.dtype != dtype:
        bad = array > most if array.dtype.kind == "u" else (array < 0) | (array > most)
        if bad.any():
            row = int(np.flatnonzero(bad.reshape(len(bad), -1).any(axis=1) if bad.ndim else bad)[0])
            raise ValueError(f"{name}: row {row} is not from 0 to {most}: {array[row] if array.ndim else array}")
    return np.asarray(array, dtype=dtype, order="C")


def rows(value: Rows, name: str, dtype: np.dtype[Any]) -> Rows:
    """A contiguous one-dimensional array of rows of this very dtype."""
    if not isinstance(value, np.ndarray) or value.dtype != dtype:
        kind = f"an array of {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
        raise TypeError(f"{name} is {kind} where an array of rows {dtype.names} (dtype tandem.{_name_of(dtype)}) is wanted")
    if value.ndim != 1:
        raise ValueError(f"{name} has shape {value.shape} where (n,) is wanted")
    return value if value.flags.c_contiguous else np.ascontiguousarray(value)


def _name_of(dtype: np.dtype[Any]) -> str:
    from . import _rows
    return next(name for name in _rows.__all__ if getattr(_rows, name) is dtype)


def pairs_of(value: npt.ArrayLike | Rows | None, name: str = "pairs") -> Rows | None:
    """Object pairs: None, an array of PAIR, or whole numbers of shape (m, 2)."""
    if value is None:
        return None
    if isinstance(value, np.ndarray) and value.dtype == PAIR:
        return rows(value, name, PAIR)
    array = whole_numbers(value, name)
    if array.size == 0:
        return np.empty(0, PAIR)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{name} has shape {array.shape} where (m, 2) is wanted")
    return array.view(PAIR).reshape(-1)


def rotations(*, xyzw: npt.ArrayLike | None = None, wxyz: npt.ArrayLike | None = None) -> npt.NDArray[np.float64]:
    """Rotation matrices of quaternions, whose length does not matter. Libraries order their four numbers in two ways, so the call says which.

    Args:
        xyzw: (4,) or (n, 4), the real part last, as in SciPy, ROS, glTF, Bullet and Newton.
        wxyz: (4,) or (n, 4), the real part first, as in MuJoCo, Eigen's constructor and trimesh. One of the two is given.

    Returns:
        (3, 3) or (n, 3, 3), as `rotation` takes them.

    Raises:
        ValueError: a quaternion that is zero or not finite.

    >>> tandem.rotations(xyzw=[0, 0, 1, 1]).round(9).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    if (xyzw is None) == (wxyz is None):
        raise TypeError("quaternions are given as xyzw or as wxyz")
    name, value = ("xyzw", xyzw) if wxyz is None else ("wxyz", wxyz)
    given = floats(np.empty(0) if value is None else value, name, 4)
    largest = np.abs(given).max(axis=-1, keepdims=True, initial=0)  # first, so that no square overflows
    bad = ~np.isfinite(given).all(axis=-1) | (largest[..., 0] == 0)
    if bad.any():
        where = f"row {int(np.flatnonzero(bad)[0])}" if bad.ndim else "it"
        raise ValueError(f"{name}: {where} is no rotation: zero, or not finite")
    scaled = (given if wxyz is None else given[..., [1, 2, 3, 0]]) / largest
    x, y, z, w = np.moveaxis(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True), -1, 0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def instances(asset: npt.ArrayLike = 0, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None,
              transform: npt.ArrayLike | None = None) -> Rows:
    """Bodies, posed: one for each row of the longest argument; an argument without rows, or with one, is that of all.

    Args:
        asset: place in the scene's list of assets, () or (n,).
        rotation: (3, 3) or (n, 3, 3), or what gives that by `as_matrix()`, such as scipy's Rotation; the identity where it is not given. `tandem.rotations`
            makes it of quaternions.
        translation: (3,) or (n, 3), in the assets' unit; 0 where it is not given.
        transform: (4, 4) or (n, 4, 4) instead of both; the last row is 0, 0, 0, 1.

    Returns:
        An array of INSTANCE, (n,).

    Raises:
        ValueError, TypeError: which name the argument and the row. Whether rotations are rigid is looked at by scenes.

    >>> tandem.instances(translation=[[0, 0, 0], [2, 0, 0]])["translation"][1]
    array([2., 0., 0.])
    """
    if transform is not None:
        if rotation is not None or translation is not None:
            raise TypeError("transform stands instead of rotation and translation, not beside them")
        matrices, translations = _parts_of(transform)
    else:
        as_matrix = getattr(rotation, "as_matrix", None)
        given: Any = as_matrix() if callable(as_matrix) else rotation
        if given is not None and (shape := _array(given, "rotation", "numbers").shape)[-1:] == (4,):
            raise ValueError(f"rotation has shape {shape} where (3, 3) or (n, 3, 3) is wanted; tandem.rotations makes these of quaternions")
        matrices = _IDENTITY if given is None else floats(given, "rotation", 3, 3)
        translations = _ORIGIN if translation is None else floats(translation, "translation", 3)
    numbers = whole_numbers(asset, "asset", wanted="places in the scene's list of assets, whole numbers,")
    if numbers.ndim > 1:
        raise ValueError(f"asset has shape {numbers.shape} where () or (n,) is wanted")
    counts = {name: len(array) for name, array, one in
              (("asset", numbers, 0), ("transform" if transform is not None else "rotation", matrices, 2), ("translation", translations, 1))
              if array.ndim > one and len(array) != 1}
    if len(set(counts.values())) > 1:
        raise ValueError("different numbers of rows: " + ", ".join(f"{name} {count}" for name, count in counts.items()))
    made = np.zeros(next(iter(counts.values()), 1), INSTANCE)
    made["asset"] = numbers
    made["rotation"] = matrices
    made["translation"] = translations
    return made


def _parts_of(transform: npt.ArrayLike) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The rotations and translations of matrices, (4, 4) or (n, 4, 4)."""
    matrices = floats(transform, "transform", 4, 4)
    last = matrices[..., 3, :]
    if not (last == _LAST_ROW).all():
        wrong = ~(np.abs(last - _LAST_ROW).max(axis=-1) <= 1e-6)
        if wrong.any():
            raise ValueError(f"transform: the last row of matrix {int(np.flatnonzero(wrong)[0])} is not 0, 0, 0, 1")
    return matrices[..., :3, :3], matrices[..., :3, 3]


def poses_of(pose: Any, rotation: Any, translation: Any, transform: Any) -> npt.NDArray[np.float64]:
    """The poses of a call, (n, 4, 3): the rows of the rotation, then the translation, as the extension takes them. A float64 array `pose`, (n, 4, 3) or (n, 12), is
    that already."""
    if pose is not None:
        if rotation is not None or translation is not None or transform is not None:
            raise TypeError("pose stands instead of rotation, translation and transform, not beside them")
        given = _array(pose, "pose", "numbers")
        return floats(given.reshape(-1, 4, 3) if given.shape[1:] == (12,) else given, "pose", 4, 3)
    if transform is not None and rotation is None and translation is None:
        matrices, translations = _parts_of(transform)
    else:
        rows = instances_of(None, None, rotation, translation, transform)
        matrices, translations = rows["rotation"], rows["translation"]
    made = np.empty((*matrices.shape[:-2], 4, 3))
    made[..., :3, :] = matrices
    made[..., 3, :] = translations
    return made


def instances_of(given: Rows | None, asset: Any, rotation: Any, translation: Any, transform: Any) -> Rows:
    """The instances of a call: rows, or what to make them of."""
    if given is None:
        if asset is None and rotation is None and translation is None and transform is None:
            raise TypeError("instances is missing, or asset, rotation, translation or transform")
        return instances(0 if asset is None else asset, rotation, translation, transform)
    if asset is not None or rotation is not None or translation is not None or transform is not None:
        raise TypeError("instances stand instead of asset, rotation, translation and transform, not beside them")
    if type(given) is np.ndarray and given.dtype is INSTANCE and given.ndim == 1 and given.flags.c_contiguous:
        return given
    return rows(given, "instances", INSTANCE)
