"""Signed distances as a function that JAX differentiates (docs/gradients.md).

    distances = tandem.jax.signed_distances(scene, pairs, bodies)
    gradient = jax.grad(lambda poses: jax.nn.relu(0.01 - distances(transform=poses)[0]).sum())(poses)

Needs the package `jax`; tried with 0.10.
"""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax  # type: ignore[import-not-found,unused-ignore]
import jax.numpy as jnp  # type: ignore[import-not-found,unused-ignore]
import numpy as np
import numpy.typing as npt

from ._scene import Scene
from .gradients import SIGNED_DISTANCE, PoseFunction, rotation_and_translation

__all__ = ["signed_distances"]


def signed_distances(scene: Scene, pairs: npt.ArrayLike, bodies: npt.ArrayLike) -> Callable[..., tuple[jax.Array, jax.Array]]:
    """Makes a function of poses that returns the signed distances of pairs, (m,) of the poses' type, and their kinds, (m,) int32: those of
    `tandem.gradients.signed_distances`.

    It takes `rotation`, (n, 3, 3), and `translation`, (n, 3), or `transform`, (n, 4, 4), by name. Its distances are differentiable once, in reverse. It works under
    `jax.jit` and, one after the other, under `jax.vmap`. The host finds the distances (`jax.pure_callback`).

    Args:
        scene: whose bodies each call moves. It must not be asked anything else meanwhile.
        pairs: (m, 2) or array of PAIR.
        bodies: (n,), the numbers of the bodies that have poses, each once. All others stand where they are as the function runs.
    """
    differentiable = _differentiable(PoseFunction(scene, pairs, bodies))

    def of_poses(*, rotation: Any = None, translation: Any = None, transform: Any = None) -> tuple[jax.Array, jax.Array]:
        matrices, translations = rotation_and_translation(rotation, translation, transform)
        dtype = jnp.result_type(matrices, translations, jnp.float32)
        distance, kind = differentiable(jnp.asarray(matrices, dtype), jnp.asarray(translations, dtype))
        return distance, kind

    return of_poses


_struct: Any = jax.ShapeDtypeStruct
_POINTS = ("direction", "in_a", "in_b")


def _differentiable(function: PoseFunction) -> Any:
    def find(rotation: Any, translation: Any) -> tuple[Any, ...]:
        """On the host: distances, kinds, and what the derivative needs."""
        found = function.find(np.asarray(rotation, np.float64), np.asarray(translation, np.float64))
        kind = np.asarray(translation).dtype
        return found["distance"].astype(kind), found["kind"].astype(np.int32), *(found[name].astype(kind) for name in _POINTS)

    def pull_back(weights: Any, *points: Any) -> tuple[Any, ...]:
        found = np.zeros(function.pair_count, SIGNED_DISTANCE)
        for name, array in zip(_POINTS, points):
            found[name] = array
        rotation, translation = function.pull_back(found, np.asarray(weights, np.float64))
        kind = np.asarray(weights).dtype
        return rotation.astype(kind), translation.astype(kind)

    def called(rotation: Any, translation: Any) -> Any:
        shapes = [(function.pair_count,), (function.pair_count,)] + [(function.pair_count, 3)] * len(_POINTS)
        kinds = [translation.dtype, np.int32] + [translation.dtype] * len(_POINTS)
        wanted = tuple(map(_struct, shapes, kinds))
        return jax.pure_callback(find, wanted, rotation, translation, vmap_method="sequential")

    def forward(rotation: Any, translation: Any) -> tuple[Any, Any]:
        distance, kind, *points = called(rotation, translation)
        return (distance, kind), points

    def backward(points: Any, weights: Any) -> Any:
        shapes = (function.body_count, 3, 3), (function.body_count, 3)
        return jax.pure_callback(pull_back, tuple(_struct(shape, points[0].dtype) for shape in shapes), weights[0], *points, vmap_method="sequential")

    distances = jax.custom_vjp(lambda rotation, translation: tuple(called(rotation, translation)[:2]))
    distances.defvjp(forward, backward)
    return distances
