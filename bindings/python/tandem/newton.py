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
from tandem import _shapes
from tandem._warp import Touch, Touches, rotation_of, write_pose

__all__ = ["CollisionPipeline"]

_Effort = Literal["default", "fast", "best"]
_MESH, _SHAPES = newton.GeoType.MESH, {newton.GeoType[name.upper()]: name for name in _shapes.PRIMITIVES}
# A CPU and a GPU are to round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

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
        self.assets, self._asset = _assets_of(model, self.shapes, _shapes.Shapes(tolerance), effort)  #: of these shapes, at their scales
        if len(self.shapes) == 0:
            return
        margin = values("shape_margin").astype(np.float64)[self.shapes]
        world = values("shape_world").astype(np.int64)[self.shapes]
        self._touches = Touches(self.assets, np.array(self._asset, np.uint32), np.searchsorted(self.shapes, np.sort(pairs[is_ours], axis=1)), kind[self.shapes] == _MESH,
                                np.where(world < 0, tandem.EVERY_WORLD, world), margin, threads=threads, most_points=most_points, device=model.device)
        transform = values("shape_transform").astype(np.float64)[self.shapes]
        inner = np.concatenate([tandem.rotations(xyzw=transform[:, 3:]).reshape(-1, 9), transform[:, :3]], axis=1)
        self._body, self._shape = (wp.array(of.astype(np.int32), dtype=int, device=model.device) for of in (values("shape_body")[self.shapes], self.shapes))
        self._inner, self._margin = (wp.array(of, dtype=wp.float64, device=model.device) for of in (inner, margin))
        self._first = wp.zeros(1, dtype=int, device=model.device)

    @property
    def instances(self) -> npt.NDArray[np.void]:
        """The shapes, posed as in the last call, array of tandem.INSTANCE."""
        made = np.zeros(len(self.shapes), tandem.INSTANCE)
        if len(self.shapes):
            pose = self._touches.pose.numpy()
            made["asset"], made["rotation"], made["translation"] = self._asset, pose[:, :9].reshape(-1, 3, 3), pose[:, 9:]
        return made

    def contacts(self) -> newton.Contacts:
        """Room for the contacts of collide()."""
        return self.others.contacts()

    def collide(self, state: newton.State, contacts: newton.Contacts, **options: Any) -> int | None:
        """Fills `contacts` with those of `state`; returns how many of them Tandem found, which come last, or None where a graph captures the call.

        In a graph the room is that of the last call before it, so make one with bodies that touch as much as they will. Where something has no room there, `check`
        says so, and `contacts` counts more than it has room for, as Newton's do, or has none of Tandem's.

        Args:
            options: others of newton.CollisionPipeline.collide().

        Raises:
            MemoryError: `contacts` has no room for all; it then has Newton's alone. Make the pipeline with a larger rigid_contact_max.
            tandem.Error: a body's pose is not a number.
        """
        self.others.collide(state, contacts, **options)
        if len(self.shapes) == 0:
            return 0
        touches, device = self._touches, self.model.device
        wp.launch(_write_poses, dim=len(self.shapes), inputs=[state.body_q, self._body, self._inner], outputs=[touches.pose], device=device)
        found = touches.find()
        if found is not None:
            before: Any = contacts.rigid_contact_count
            if found == 0:
                return 0
            if (end := int(before.numpy()[0]) + found) > contacts.rigid_contact_max:
                raise MemoryError(f"{end} contacts have no room: rigid_contact_max is {contacts.rigid_contact_max}")
        self._append(state, contacts, len(touches.touches) if found is None else found)
        return found

    def check(self) -> None:
        """Waits for a graph that captured collide(). Raises what was wrong in its last replay: tandem.Error, or tandem.cuda.TooLittleRoom."""
        if len(self.shapes):
            self._touches.check()

    @property
    def is_on_gpu(self) -> bool:
        """Says whether Tandem's contacts are found on the GPU, and nothing is copied to the CPU."""
        return len(self.shapes) > 0 and self._touches.is_on_gpu

    def _append(self, state: newton.State, contacts: newton.Contacts, most: int) -> None:
        touches, device = self._touches, self.model.device
        wp.launch(_take_room, dim=1, inputs=[touches.count], outputs=[contacts.rigid_contact_count, self._first], device=device)
        columns = [getattr(contacts, f"rigid_contact_{name}{side}") for name in ("shape", "point", "offset", "margin") for side in (0, 1)]
        wp.launch(_write_contacts, dim=most, device=device,
                  inputs=[touches.count, self._first, touches.touches, state.body_q, self._body, self._shape, self._margin, contacts.rigid_contact_max],
                  outputs=[*columns, contacts.rigid_contact_normal, contacts.rigid_contact_tids])
        for name in ("stiffness", "damping", "friction"):
            array = getattr(contacts, f"rigid_contact_{name}")
            if array is not None:  # the shapes' own
                wp.launch(_write_zeros, dim=most, inputs=[touches.count, self._first, contacts.rigid_contact_max], outputs=[array], device=device)


@wp.kernel
def _write_poses(body_q: wp.array[wp.transform], body: wp.array[int], inner: wp.array2d[wp.float64], pose: wp.array2d[wp.float64]):
    """Writes the poses of shapes: of the body, -1 for none, and of the shape in it."""
    i = wp.tid()
    of_shape = inner[i]
    rotation = wp.mat33d(of_shape[0], of_shape[1], of_shape[2], of_shape[3], of_shape[4], of_shape[5], of_shape[6], of_shape[7], of_shape[8])
    translation = wp.vec3d(of_shape[9], of_shape[10], of_shape[11])
    if body[i] >= 0:
        of_body = body_q[body[i]]
        turn = rotation_of(wp.transform_get_rotation(of_body))
        place = wp.transform_get_translation(of_body)
        rotation = turn * rotation
        translation = turn * translation + wp.vec3d(wp.float64(place[0]), wp.float64(place[1]), wp.float64(place[2]))
    write_pose(pose[i], rotation, translation)


@wp.kernel
def _take_room(count: wp.array[int], of_contacts: wp.array[int], first: wp.array[int]):
    """Puts the number of contacts that there are into `first`, and adds those that follow."""
    first[0] = of_contacts[0]
    of_contacts[0] = of_contacts[0] + count[0]


@wp.func
def _single(v: wp.vec3d):
    return wp.vec3(wp.float32(v[0]), wp.float32(v[1]), wp.float32(v[2]))


@wp.func
def _write_side(row: int, shape: int, body: int, body_q: wp.array[wp.transform], surface: wp.vec3d, out: wp.vec3d, margin: wp.float64, shapes: wp.array[int],
                points: wp.array[wp.vec3], offsets: wp.array[wp.vec3], margins: wp.array[float]):
    """Writes one side of a contact: surface: its place in the world, out: the normal away from the body."""
    point = surface
    offset = margin * out
    if body >= 0:
        of_body = body_q[body]
        back = wp.transpose(rotation_of(wp.transform_get_rotation(of_body)))
        place = wp.transform_get_translation(of_body)
        point = back * (surface - wp.vec3d(wp.float64(place[0]), wp.float64(place[1]), wp.float64(place[2])))
        offset = back * offset
    shapes[row] = shape
    points[row] = _single(point)
    offsets[row] = _single(offset)
    margins[row] = wp.float32(margin)


@wp.kernel
def _write_contacts(count: wp.array[int], first: wp.array[int], touches: wp.array[Touch], body_q: wp.array[wp.transform], body: wp.array[int], shape: wp.array[int],
                    margin: wp.array[wp.float64], most: int, shape0: wp.array[int], shape1: wp.array[int], point0: wp.array[wp.vec3], point1: wp.array[wp.vec3],
                    offset0: wp.array[wp.vec3], offset1: wp.array[wp.vec3], margin0: wp.array[float], margin1: wp.array[float], normal: wp.array[wp.vec3],
                    tids: wp.array[int]):
    k = wp.tid()
    row = first[0] + k
    if k >= count[0] or row >= most:
        return
    touch = touches[k]
    a = int(touch.a)
    b = int(touch.b)
    half = wp.float64(0.5) * touch.gap * touch.normal
    _write_side(row, shape[a], body[a], body_q, touch.position - half, touch.normal, margin[a], shape0, point0, offset0, margin0)
    _write_side(row, shape[b], body[b], body_q, touch.position + half, -touch.normal, margin[b], shape1, point1, offset1, margin1)
    normal[row] = _single(touch.normal)
    tids[row] = 0


@wp.kernel
def _write_zeros(count: wp.array[int], first: wp.array[int], most: int, values: wp.array[float]):
    k = wp.tid()
    if k < count[0] and first[0] + k < most:
        values[first[0] + k] = 0.0


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
