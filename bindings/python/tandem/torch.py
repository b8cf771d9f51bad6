"""Signed distances as a function that PyTorch differentiates (docs/gradients.md).

    distance, kind = tandem.torch.signed_distances(scene, pairs, bodies, transform=poses)
    torch.relu(0.01 - distance).sum().backward()            # poses.grad

Needs the package `torch`; tried with 2.15.
"""
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import torch  # type: ignore[import-not-found,unused-ignore]

from ._scene import Scene
from .gradients import PoseFunction, rotation_and_translation

__all__ = ["signed_distances"]


def signed_distances(scene: Scene, pairs: npt.ArrayLike, bodies: npt.ArrayLike, *, rotation: torch.Tensor | None = None,
                     translation: torch.Tensor | None = None, transform: torch.Tensor | None = None) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns the signed distances of pairs, (m,) of the poses' type and device, and their kinds, (m,) int64: those of `tandem.gradients.signed_distances`.

    The distances are differentiable by the poses once: `create_graph=True` raises RuntimeError. The CPU finds them, or the GPU of the scene; tensors are copied to and fro.

    Args:
        scene: whose bodies are moved there; it keeps these poses.
        pairs: (m, 2) or array of PAIR.
        bodies: (n,), the numbers of the bodies that have poses, each once. All others stand where they are.
        rotation, translation: (n, 3, 3) and (n, 3), or `transform`, (n, 4, 4), instead of both.

    Raises:
        Error, ValueError, TypeError: as `Scene.move` and `tandem.gradients.signed_distances` do.
    """
    matrices, translations = rotation_and_translation(rotation, translation, transform)
    function = PoseFunction(scene, pairs, bodies)
    distance, kind = _SignedDistances.apply(function, matrices, translations)  # type: ignore[no-untyped-call,unused-ignore]
    return distance, kind


class _SignedDistances(torch.autograd.Function):  # type: ignore[misc,unused-ignore]
    @staticmethod
    def forward(ctx: Any, function: PoseFunction, rotation: torch.Tensor, translation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        found = function.find(_numpy(rotation), _numpy(translation))
        ctx.function, ctx.found, ctx.like = function, found, (rotation, translation)
        kind = torch.from_numpy(found["kind"].astype(np.int64)).to(translation.device)
        ctx.mark_non_differentiable(kind)
        return _like(found["distance"], translation), kind

    @staticmethod
    def backward(ctx: Any, weights: torch.Tensor, _: torch.Tensor) -> tuple[None, torch.Tensor, torch.Tensor]:
        # PyTorch's once_differentiable lets second derivatives pass where the weights are constants, and leaves their part by the poses out.
        if torch.is_grad_enabled():
            raise RuntimeError("signed distances are differentiable once: create_graph=True is not offered")
        rotation, translation = ctx.function.pull_back(ctx.found, _numpy(weights))
        return None, _like(rotation, ctx.like[0]), _like(translation, ctx.like[1])


def _numpy(tensor: torch.Tensor) -> npt.NDArray[np.float64]:
    array: npt.NDArray[np.float64] = tensor.detach().to("cpu", torch.float64).numpy()
    return array


def _like(array: npt.NDArray[np.float64], tensor: torch.Tensor) -> torch.Tensor:
    """A tensor of an array, of the type and on the device of another tensor."""
    return torch.from_numpy(np.ascontiguousarray(array)).to(tensor.device, tensor.dtype)
