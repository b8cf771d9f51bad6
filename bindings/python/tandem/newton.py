"""Contacts of meshes for Newton's solvers, as they are: neither hulls nor distance grids.

    pipeline = tandem.newton.CollisionPipeline(model)       # instead of newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    pipeline.collide(state, contacts)
    solver.step(state, next_state, control, contacts, dt)

Needs the package `newton`; tried with 1.8 and Warp 1.19.
"""
from __future__ import annotations

from typing import Any, Literal

import newton  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np
import numpy.typing as npt
import warp as wp  # type: ignore[import-untyped,import-not-found,unused-ignore]

import tandem
from tandem._solver_pairs import Touches, asked_pairs

__all__ = ["CollisionPipeline"]

_Array = npt.NDArray[np.float64]
_Effort = Literal["default", "fast", "best"]
_NOT_TAKEN = {"broad_phase": "which pairs there are is decided here", "shape_pairs_filtered": "which pairs there are is decided here",
              "contact_matching": "points of meshes have no match", "contact_report": "points of meshes have no match",
              "body_pair_reduction": "points of meshes are few", "speculative_contact_gap_max": "points of meshes are where surfaces are now"}


class CollisionPipeline:
    """Newton's collision pipeline, but that Tandem finds the contacts between meshes.

    Pairs of mesh shapes have the points of their manifolds, each with the manifold's normal and the points of both surfaces; where shapes have margins
    and the surfaces are apart by less than both, the points that are, found along the way from one to the other. Gaps, by which Newton looks for
    contacts before there are any, play no part between meshes: collide in every substep. All other pairs, particles and soft contacts are Newton's.
    Which pairs may collide is told by model.shape_contact_pairs, as it is when this is made. Meshes of a model on a GPU are looked at by the CPU, and
    collide() waits for the GPU.

    A mesh that is wholly within another does not touch it.

    Args:
        model: of any number of worlds.
        most_points: of a manifold, 1 to 7.
        threads: of a scene.
        effort: as of tandem.build().
        options: of newton.CollisionPipeline, such as rigid_contact_max, the room for contacts, of which Newton has an estimate.
    """

    def __init__(self, model: newton.Model, *, most_points: int = 7, threads: int = 1, effort: _Effort = "default", **options: Any):
        for name in options.keys() & _NOT_TAKEN.keys():
            raise ValueError(f"{name} is not taken: {_NOT_TAKEN[name]}")
        self.model, self.most_points = model, most_points

        def values(name: str) -> npt.NDArray[Any]:
            return np.asarray(getattr(model, name).numpy())

        pairs = values("shape_contact_pairs").reshape(-1, 2).astype(np.intp)
        is_ours = (values("shape_type")[pairs] == newton.GeoType.MESH).all(axis=1)
        others: Any = wp.array(pairs[~is_ours].astype(np.int32), dtype=wp.vec2i, device=model.device)
        self.others = newton.CollisionPipeline(model, broad_phase="explicit", shape_pairs_filtered=others, **options)
        self.shapes = np.unique(pairs[is_ours])  #: the mesh shapes that Tandem looks at, ascending
        body = values("shape_body")[self.shapes]
        self._body, self._is_static = np.maximum(body, 0), body < 0
        transform = values("shape_transform").astype(np.float64)[self.shapes]
        self._in_body = tandem.rotations(xyzw=transform[:, 3:]), transform[:, :3]
        self._margin = values("shape_margin").astype(np.float64)[self.shapes]
        self.assets, asset = _assets_of(model, self.shapes, effort)  #: of the meshes that these shapes have, at their scales
        self.instances = np.zeros(len(self.shapes), tandem.INSTANCE)  #: the shapes, posed as in the last call
        self.instances["asset"] = asset
        if len(self.shapes):
            self._asked = asked_pairs(len(self.shapes), np.searchsorted(self.shapes, np.sort(pairs[is_ours], axis=1)))
            self._scene = tandem.Scene(self.assets, threads=threads)

    def contacts(self) -> newton.Contacts:
        """Room for the contacts of collide()."""
        return self.others.contacts()

    def collide(self, state: newton.State, contacts: newton.Contacts, **options: Any) -> int:
        """Fills `contacts` with those of `state`; returns how many of them Tandem found, which come last.

        Args:
            options: others of newton.CollisionPipeline.collide().

        Raises:
            MemoryError: `contacts` has no room for all; it then has Newton's alone. Make the pipeline with a larger rigid_contact_max.
            tandem.Error: a body's pose is not a number.
        """
        self.others.collide(state, contacts, **options)
        if len(self.shapes) == 0:
            return 0
        poses: Any = state.body_q
        body = poses.numpy().astype(np.float64)[self._body]
        body[self._is_static] = 0, 0, 0, 0, 0, 0, 1
        rotation, inner = tandem.rotations(xyzw=body[:, 3:]), self._in_body
        self.instances["rotation"] = rotation @ inner[0]
        self.instances["translation"] = np.einsum("nij,nj->ni", rotation, inner[1]) + body[:, :3]
        touches = Touches(self._scene, self.instances, self.most_points, self._asked)
        if self._margin.max() > 0:
            touches.add_near(lambda a, b: self._margin[a] + self._margin[b], 2 * float(self._margin.max()))
        margins = self._margin[touches.a], self._margin[touches.b]
        near = touches.gap <= margins[0] + margins[1]
        sides = []
        for i, place, margin, sign in ((touches.a, touches.in_a, margins[0], 1.0), (touches.b, touches.in_b, margins[1], -1.0)):
            point = np.einsum("nij,nj->ni", inner[0][i], place) + inner[1][i]
            offset = np.einsum("nji,nj->ni", rotation[i], (sign * margin)[:, None] * touches.normal)
            sides.append((self.shapes[i][near], point[near], offset[near], margin[near]))
        _append(contacts, sides, touches.normal[near])
        return int(near.sum())


def _assets_of(model: newton.Model, shapes: npt.NDArray[np.intp], effort: _Effort) -> tuple[list[tandem.Asset], list[int]]:
    """Returns an asset for each mesh and scale that the shapes have, and for each shape which asset it has."""
    scale_of: Any = model.shape_scale
    scales = scale_of.numpy().astype(np.float64)[shapes]
    places: dict[tuple[int, ...], int] = {}
    assets: list[tandem.Asset] = []
    asset: list[int] = []
    for shape, scale in zip(shapes, scales):
        mesh: Any = model.shape_source[shape]
        key = (id(mesh), *scale.view(np.int64))
        if key not in places:
            places[key] = len(assets)
            assets.append(tandem.build(np.asarray(mesh.vertices, np.float64).reshape(-1, 3) * scale, np.asarray(mesh.indices).reshape(-1, 3), effort=effort))
        asset.append(places[key])
    return assets, asset


def _append(contacts: newton.Contacts, sides: list[Any], normal: _Array) -> None:
    count = int(contacts.rigid_contact_count.numpy()[0])
    end = count + len(normal)
    if len(normal) == 0:
        return
    if end > contacts.rigid_contact_max:
        raise MemoryError(f"{end} contacts have no room: rigid_contact_max is {contacts.rigid_contact_max}")

    def put(name: str, values: npt.NDArray[Any]) -> None:
        array = getattr(contacts, f"rigid_contact_{name}")
        if array is not None:
            array[count:end].assign(np.ascontiguousarray(values, np.int32 if values.dtype.kind == "i" else np.float32))

    for side, (shape, point, offset, margin) in enumerate(sides):
        put(f"shape{side}", shape)
        put(f"point{side}", point)
        put(f"offset{side}", offset)
        put(f"margin{side}", margin)
    put("normal", normal)
    for name in ("stiffness", "damping", "friction"):
        put(name, np.zeros(len(normal)))  # the shapes' own
    put("tids", np.zeros(len(normal), int))
    contacts.rigid_contact_count.assign(np.array([end], np.int32))
