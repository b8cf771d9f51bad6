"""Why a pose is refused, in words."""
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import Rows
from ._errors import Error

__all__ = ["explained"]

#: What the columns of a rotation may be off, as the library measures it (kRigidTolerance), and what numbers of few digits, such as float16's, are off at most.
_RIGID, _COARSE = 1e-6, 1e-2


def explained(error: Error, instances: Rows) -> Error:
    """The same error; where a pose is to blame, one that says what is wrong with it."""
    if error.name != "PoseNotRigid" or error.where is None or error.where >= len(instances):
        return error
    row = instances[error.where]
    return Error(f"{error}: {_defect(row['rotation'], row['translation'])}", error.status, error.name, error.subject, error.where)


def _defect(rotation: npt.NDArray[np.float64], translation: npt.NDArray[Any]) -> str:
    for name, array in (("rotation", rotation), ("translation", translation)):
        wrong = array[~np.isfinite(array)]
        if len(wrong):
            return f"its {name} is not finite (it has {wrong[0]})"
    scales = np.linalg.svd(rotation, compute_uv=False)
    off = _distance_from_rigid(rotation)
    is_uniform = scales[0] - scales[2] <= _RIGID * scales[0]
    if np.linalg.slogdet(rotation)[0] < 0:
        size = "" if off <= _COARSE else f", which also scales by {_span(scales, is_uniform)}"
        return f"its rotation is a reflection, with a determinant below 0{size}"
    if off <= _COARSE and not is_uniform:
        return f"its rotation is too coarse: it is {off:.2g} from orthonormal, where {_RIGID:g} is allowed (float16 is not enough, float32 is)"
    return f"its rotation is not orthonormal: it scales by {_span(scales, is_uniform)}"


def _span(scales: npt.NDArray[np.float64], is_uniform: bool) -> str:
    return f"{scales[0]:.8g}" if is_uniform else f"{scales[2]:.3g} to {scales[0]:.3g}, depending on the direction"


def _distance_from_rigid(rotation: npt.NDArray[np.float64]) -> float:
    with np.errstate(all="ignore"):
        return float(np.nan_to_num(np.abs(rotation.T @ rotation - np.eye(3)), nan=np.inf).max())
