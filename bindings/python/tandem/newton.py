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
from tandem import _shapes, _tandem
from tandem._poses import explained
from tandem._scene import cores_of
from tandem._solver_pairs import asked_pairs

__all__ = ["CollisionPipeline"]

_Array = npt.NDArray[np.float64]
_Effort = Literal["default", "fast", "best"]
_MESH, _SHAPES = newton.GeoType.MESH, {newton.GeoType[name.upper()]: name for name in _shapes.PRIMITIVES}
_TOUCH = np.dtype([("a", "<u4"), ("b", "<u4"), ("normal", "<f8", (3,)), ("position", "<f8", (3,)), ("gap", "<f8")])  # struct Touch of the extension
_NOT_TAKEN = {"broad_phase": "which pairs there are is decided here", "shape_pairs_filtered": "which pairs there are is decided here",
              "contact_matching": "points of meshes have no match", "contact_report": "points of meshes have no match",
              "body_pair_reduction": "points of meshes are few", "speculative_contact_gap_max": "points of meshes are where surfaces are now"}


class CollisionPipeline:
    """Newton's collision pipeline, but that Tandem finds the contacts of meshes with meshes, boxes and round shapes.

    These pairs have the points of their manifolds, each with its normal and the places of both surfaces along it; the deepest, where it alone is
    deep, acts through the manifold's centre. Where shapes have margins and the surfaces are apart by less than both, they have the points that are, found along
    the way from one to the other. Boxes are meshes as they are. So are spheres,
    capsules, ellipsoids, cylinders and cones, with faces between the shape scaled by 1 - tolerance and by 1 + tolerance. Gaps, by which Newton looks for
    contacts before there are any, play no part here: collide in every substep. All other pairs, such as those with planes and height fields, particles and
    soft contacts are Newton's. Which pairs may collide is told by model.shape_contact_pairs; it and the shapes are as they are when this is made. Shapes of a
    model on a GPU are looked at by the CPU, and collide() waits for the GPU.

    A shape that is wholly within another does not touch it.

    Args:
        model: of any number of worlds.
        tolerance: 1e-6 to 0.5, the error of round shapes as a part of their size.
        most_points: of a manifold, 1 to 7.
        threads: of a scene.
        effort: as of tandem.build().
        options: of newton.CollisionPipeline, such as rigid_contact_max, the room for contacts, of which Newton has an estimate.
    """

    def __init__(self, model: newton.Model, *, tolerance: float = 0.002, most_points: int = 7, threads: int = 1, effort: _Effort = "default", **options: Any):
        for name in options.keys() & _NOT_TAKEN.keys():
            raise ValueError(f"{name} is not taken: {_NOT_TAKEN[name]}")
        if not 1 <= most_points <= 7:
            raise ValueError(f"most_points {most_points}: is not from 1 to 7")
        self.model, self.tolerance, self.most_points = model, tolerance, most_points

        def values(name: str) -> npt.NDArray[Any]:
            return np.asarray(getattr(model, name).numpy())

        pairs, kind = values("shape_contact_pairs").reshape(-1, 2).astype(np.intp), values("shape_type")
        is_barrel = (kind == newton.GeoType.CYLINDER) & (values("shape_scale")[:, 2] != 0)
        is_known = np.isin(kind, [_MESH, *_SHAPES]) & ~is_barrel
        is_ours = (kind[pairs] == _MESH).any(axis=1) & is_known[pairs].all(axis=1)
        others: Any = wp.array(pairs[~is_ours].astype(np.int32), dtype=wp.vec2i, device=model.device)
        self.others = newton.CollisionPipeline(model, broad_phase="explicit", shape_pairs_filtered=others, **options)
        self.shapes = np.unique(pairs[is_ours])  #: those that Tandem looks at, ascending
        body = values("shape_body")[self.shapes]
        self._body, self._is_static = np.maximum(body, 0), body < 0
        transform = values("shape_transform").astype(np.float64)[self.shapes]
        self._in_body = tandem.rotations(xyzw=transform[:, 3:]), transform[:, :3]
        self._margin = values("shape_margin").astype(np.float64)[self.shapes]
        self.assets, asset = _assets_of(model, self.shapes, _shapes.Shapes(tolerance), effort)  #: of these shapes, at their scales
        self.instances = np.zeros(len(self.shapes), tandem.INSTANCE)  #: the shapes, posed as in the last call
        self.instances["asset"] = asset
        if len(self.shapes):
            asked, filter = asked_pairs(np.searchsorted(self.shapes, np.sort(pairs[is_ours], axis=1)), kind[self.shapes] == _MESH)
            self._touches = _tandem.Touches(cores_of(self.assets), np.array(asset, np.uint32), asked, filter, self._margin, threads, most_points)

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
        try:
            touches = np.frombuffer(self._touches.find(self.instances), _TOUCH)
        except tandem.Error as error:
            raise explained(error, self.instances) from None
        touches = touches[touches["gap"] <= self._margin[touches["a"]] + self._margin[touches["b"]]]
        sides = []
        for name, sign in (("a", 1.0), ("b", -1.0)):
            i, out = touches[name], sign * touches["normal"]
            place = touches["position"] - 0.5 * touches["gap"][:, None] * out - body[i, :3]  # on the surface
            margin = self._margin[i]
            point, offset = (np.einsum("nji,nj->ni", rotation[i], vector) for vector in (place, margin[:, None] * out))
            sides.append((self.shapes[i], point, offset, margin))
        _append(contacts, sides, touches["normal"])
        return len(touches)


def _assets_of(model: newton.Model, shapes: npt.NDArray[np.intp], solids: _shapes.Shapes, effort: _Effort) -> tuple[list[tandem.Asset], list[int]]:
    """Returns an asset for each mesh or type, and scale, that the shapes have, and for each shape which asset it has."""
    kind_of: Any = model.shape_type
    scale_of: Any = model.shape_scale
    kinds, scales = kind_of.numpy()[shapes], scale_of.numpy().astype(np.float64)[shapes]
    places: dict[tuple[int, ...], int] = {}
    assets: list[tandem.Asset] = []
    asset: list[int] = []
    for shape, kind, scale in zip(shapes, kinds, scales):
        mesh: Any = model.shape_source[shape]
        key = (kind, id(mesh) if kind == _MESH else 0, *scale.view(np.int64))
        if key not in places:
            places[key] = len(assets)
            vertices, faces = solids.of(_SHAPES[kind], *scale) if kind != _MESH else (
                np.asarray(mesh.vertices, np.float64).reshape(-1, 3) * scale, np.asarray(mesh.indices).reshape(-1, 3))
            assets.append(tandem.build(vertices, faces, effort=effort))
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
