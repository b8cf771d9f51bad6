"""Contacts of non-convex meshes in MuJoCo Warp, many worlds at once, whose own are those of the meshes' convex hulls.

    m, d = mujoco_warp.put_model(model), mujoco_warp.make_data(model, nworld=4096)
    contacts = tandem.mujoco_warp.MeshContacts(model, m, d)
    mujoco_warp.step(m, d)                   # as ever, also in a graph

Needs the package `mujoco_warp`; tried with 4.0 and Warp 1.19.
"""
from __future__ import annotations

from typing import Any, Literal

import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
import mujoco_warp  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np
import numpy.typing as npt
import warp as wp  # type: ignore[import-untyped,import-not-found,unused-ignore]
# There are no public names for the rules by which MuJoCo Warp combines what two geoms say of a contact, and writes its row.
from mujoco_warp._src.collision_core import contact_margin_gap, contact_material_params, write_contact  # type: ignore[import-untyped,import-not-found,unused-ignore]
from mujoco_warp._src.math import make_frame  # type: ignore[import-untyped,import-not-found,unused-ignore]
from mujoco_warp._src.types import vec5  # type: ignore[import-untyped,import-not-found,unused-ignore]

import tandem
from tandem import _shapes
from tandem._warp import Touch, Touches, write_pose
from tandem.mujoco import _pairs_that_may_collide, _shape_of, _solid_of

__all__ = ["MeshContacts"]

_Effort = Literal["default", "fast", "best"]
_Type = mujoco.mjtGeom
# A CPU and a GPU are to round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


class MeshContacts:
    """Finds the contacts of a model's mesh geoms by Tandem, in all worlds of `data`, and leaves the others to MuJoCo Warp.

    The meshes are those of the model, with all their faces. What they meet are meshes too: boxes and height fields as they are, and meshes of spheres, capsules,
    ellipsoids and cylinders whose faces lie between the shape scaled by 1 - tolerance and by 1 + tolerance. A pair of geoms has the points of its manifolds, as of
    tandem.mujoco. Pairs of a mesh and a plane stay MuJoCo Warp's, whose hull touches a plane where the mesh does; so do geoms of type sdf, and flexes.

    It takes these pairs from the lists of `m`, and adds its contacts in `m.callback.contactfilter`, which MuJoCo Warp calls at the end of its own collision; what stood
    there is called first. Their rows are made by MuJoCo Warp's functions: condim, friction, solref, solimp and adhesion, of <pair>s too, are as in `m` in each call.

    Args:
        model: that `m` was made of.
        m, d: of mujoco_warp, on one device. On a GPU nothing is copied to the CPU, if the package has tandem.cuda.
        tolerance: 1e-6 to 0.5, the error of round shapes as a part of their size.
        most_points: of a manifold, 1 to 7.
        threads: of a scene, on a CPU.
        effort: as of tandem.build().

    Raises:
        ValueError: no mesh geom of the model may collide; or the model has what cannot be taken: margins or gaps of geoms that Tandem looks at, surface velocities,
            sleeping, or other meshes or sizes in different worlds.
    """

    def __init__(self, model: mujoco.MjModel, m: Any, d: Any, *, tolerance: float = 0.002, most_points: int = 7, threads: int = 1, effort: _Effort = "default") -> None:
        if not 1 <= most_points <= 7:
            raise ValueError(f"most_points {most_points}: is not from 1 to 7")
        pairs, rows = _pairs_that_may_collide(model)
        is_ours = (model.geom_type[pairs] != _Type.mjGEOM_PLANE).all(axis=1)
        pairs, rows = pairs[is_ours], rows[is_ours]
        if len(pairs) == 0:
            raise ValueError("no mesh geom of the model may collide")
        geoms = np.unique(pairs)
        self.geoms = geoms[np.argsort(model.geom_type[geoms], kind="stable")]  #: those that Tandem looks at, by type and number, as contacts name them
        _refuse(model, m, self.geoms, rows)
        self.assets, asset = _assets_of(model, self.geoms, _shapes.Shapes(tolerance), effort)  #: of the shapes that these geoms have
        self._m, self._device = m, d.geom_xpos.device
        self._pair_ids = _take_pairs(model, m, pairs)
        count, worlds = len(self.geoms), d.nworld
        body_of = np.zeros(model.ngeom, np.intp)
        body_of[self.geoms] = np.arange(count)
        every = (np.sort(body_of[pairs], axis=1) + count * np.arange(worlds)[:, None, None]).reshape(-1, 2)
        self._touches = Touches(self.assets, np.tile(asset, worlds), every, np.tile(model.geom_type[self.geoms] == _Type.mjGEOM_MESH, worlds),
                                np.repeat(np.arange(worlds), count), np.zeros(count * worlds), threads=threads, most_points=most_points, device=self._device)
        self._geom: Any = wp.array(self.geoms.astype(np.int32), dtype=int, device=self._device)
        self._before = m.callback.contactfilter
        m.callback.contactfilter = self._add

    @property
    def is_on_gpu(self) -> bool:
        """Says whether Tandem's contacts are found on the GPU, and nothing is copied to the CPU."""
        return self._touches.is_on_gpu

    def check(self) -> None:
        """Waits for a graph that captured a step. Raises what was wrong in its last replay: tandem.Error, or tandem.cuda.TooLittleRoom. Where contacts have no room in
        `d`, d.nacon is more than d.naconmax, as ever."""
        self._touches.check()

    def _add(self, m: Any, d: Any) -> None:
        if self._before is not None:
            self._before(m, d)
        touches, device = self._touches, self._device
        wp.launch(_write_poses, dim=(d.nworld, len(self.geoms)), inputs=[d.geom_xpos, d.geom_xmat, self._geom], outputs=[touches.pose], device=device)
        found = touches.find()
        if found == 0:
            return
        of, c = m, d.contact
        wp.launch(
            _write_contacts, dim=len(touches.touches) if found is None else found, device=device,
            inputs=[touches.count, touches.touches, self._geom, self._pair_ids, m.ngeom, of.geom_condim, of.geom_priority, of.geom_solmix, of.geom_solref, of.geom_solimp,
                    of.geom_friction, of.geom_adhesion, of.geom_margin, of.geom_gap, of.pair_dim, of.pair_solref, of.pair_solreffriction, of.pair_solimp, of.pair_adhesion,
                    of.pair_friction, of.pair_margin, of.pair_gap, d.naconmax],
            outputs=[c.dist, c.pos, c.frame, c.includemargin, c.friction, c.solref, c.solreffriction, c.solimp, c.dim, c.geom, c.efc_address, c.worldid, c.type,
                     c.geomcollisionid, c.adhesion, d.nacon])


def _refuse(model: mujoco.MjModel, m: Any, geoms: npt.NDArray[np.intp], rows: npt.NDArray[np.intp]) -> None:
    """Raises where a model has what cannot be taken."""
    for name in ("margin", "gap"):
        for kind, of in (("geom", geoms), ("pair", rows[rows >= 0])):
            if len(of) and getattr(m, f"{kind}_{name}").numpy()[:, of].any():
                raise ValueError(f"{kind}_{name} is not 0: points of bodies that are apart are not found here")
    if m.flg_surfacevel:
        raise ValueError("geoms have surface velocities, which MuJoCo Warp gives to contacts before it calls contactfilter")
    if m.opt.enableflags & mujoco_warp.EnableBit.SLEEP:
        raise ValueError("sleeping is enabled, for which MuJoCo Warp looks for contacts twice in a step")
    if m.geom_dataid.shape[0] > 1 or (m.geom_size.shape[0] > 1 and np.ptp(m.geom_size.numpy()[:, geoms], axis=0).any()):
        raise ValueError("worlds have other meshes or sizes of geoms")


def _assets_of(model: mujoco.MjModel, geoms: npt.NDArray[np.intp], solids: _shapes.Shapes, effort: _Effort) -> tuple[list[tandem.Asset], npt.NDArray[np.uint32]]:
    """Returns an asset for each shape that geoms have, and for each geom which asset it has."""
    places: dict[tuple[float, ...], int] = {}
    assets: list[tandem.Asset] = []
    for geom in geoms:
        shape = _shape_of(model, geom)
        if shape not in places:
            places[shape] = len(assets)
            assets.append(tandem.build(*_solid_of(model, solids, shape), effort=effort))
    return assets, np.array([places[_shape_of(model, geom)] for geom in geoms], np.uint32)


def _take_pairs(model: mujoco.MjModel, m: Any, pairs: npt.NDArray[np.intp]) -> Any:
    """Takes pairs of geoms from the lists that MuJoCo Warp looks at, but for its sensors. Returns the ids of all pairs as they were."""
    before: Any = m.nxn_pairid
    ours = np.zeros((model.ngeom, model.ngeom), bool)
    ours[tuple(np.sort(pairs, axis=1).T)] = True
    geom_pairs, ids = m.nxn_geom_pair.numpy(), before.numpy().copy()
    is_ours = ours[geom_pairs[:, 0], geom_pairs[:, 1]]
    ids[is_ours, 0] = -2  # no contact
    kept = (ids[:, 0] > -2) | (ids[:, 1] >= 0)

    def on_device(rows: npt.NDArray[Any]) -> Any:
        return wp.array(np.ascontiguousarray(rows, np.int32), dtype=wp.vec2i, device=before.device)

    m.nxn_pairid, m.nxn_pairid_filtered, m.nxn_geom_pair_filtered = on_device(ids), on_device(ids[kept]), on_device(geom_pairs[kept])
    return before


@wp.kernel
def _write_poses(xpos: wp.array2d[wp.vec3], xmat: wp.array2d[wp.mat33], geom: wp.array[int], pose: wp.array2d[wp.float64]):
    world, i = wp.tid()
    r = xmat[world, geom[i]]
    p = xpos[world, geom[i]]
    rotation = wp.mat33d(wp.float64(r[0, 0]), wp.float64(r[0, 1]), wp.float64(r[0, 2]), wp.float64(r[1, 0]), wp.float64(r[1, 1]), wp.float64(r[1, 2]),
                         wp.float64(r[2, 0]), wp.float64(r[2, 1]), wp.float64(r[2, 2]))
    write_pose(pose[world * geom.shape[0] + i], rotation, wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2])))


@wp.kernel
def _write_contacts(count: wp.array[int], touches: wp.array[Touch], geom: wp.array[int], pair_ids: wp.array[wp.vec2i], ngeom: int, geom_condim: wp.array[int],
                    geom_priority: wp.array[int], geom_solmix: wp.array2d[float], geom_solref: wp.array2d[wp.vec2], geom_solimp: wp.array2d[vec5],
                    geom_friction: wp.array2d[wp.vec3], geom_adhesion: wp.array2d[float], geom_margin: wp.array2d[float], geom_gap: wp.array2d[float],
                    pair_dim: wp.array[int], pair_solref: wp.array2d[wp.vec2], pair_solreffriction: wp.array2d[wp.vec2], pair_solimp: wp.array2d[vec5],
                    pair_adhesion: wp.array2d[float], pair_friction: wp.array2d[vec5], pair_margin: wp.array2d[float], pair_gap: wp.array2d[float], naconmax: int,
                    dist: wp.array[float], pos: wp.array[wp.vec3], frame: wp.array[wp.mat33], includemargin: wp.array[float], friction: wp.array[vec5],
                    solref: wp.array[wp.vec2], solreffriction: wp.array[wp.vec2], solimp: wp.array[vec5], dim: wp.array[int], of_geoms: wp.array[wp.vec2i],
                    efc_address: wp.array2d[int], worldid: wp.array[int], kind: wp.array[int], collisionid: wp.array[int], adhesion: wp.array[float],
                    nacon: wp.array[int]):
    k = wp.tid()
    if k >= count[0]:
        return
    touch = touches[k]
    bodies = geom.shape[0]
    world = int(touch.a) / bodies
    first = geom[int(touch.a) - world * bodies]
    second = geom[int(touch.b) - world * bodies]
    # The place of a pair i < j in the list of all, as numpy.triu_indices() orders them.
    low = wp.min(first, second)
    pair_id = pair_ids[(low * (2 * ngeom - low - 3)) / 2 + wp.max(first, second) - 1]
    geoms = wp.vec2i(first, second)
    normal = wp.vec3(float(touch.normal[0]), float(touch.normal[1]), float(touch.normal[2]))
    place = wp.vec3(float(touch.position[0]), float(touch.position[1]), float(touch.position[2]))
    margin, gap = contact_margin_gap(geom_margin, geom_gap, pair_margin, pair_gap, geoms, pair_id[0], world)
    condim, mixed_friction, mixed_solref, mixed_solreffriction, mixed_solimp, mixed_adhesion = contact_material_params(
        geom_condim, geom_priority, geom_solmix, geom_solref, geom_solimp, geom_friction, geom_adhesion, pair_dim, pair_solref, pair_solreffriction, pair_solimp,
        pair_adhesion, pair_friction, geoms, pair_id[0], world)
    # This counts the points of the pair that come before this one.
    place_in_pair = int(0)
    while place_in_pair < k and touches[k - place_in_pair - 1].a == touch.a and touches[k - place_in_pair - 1].b == touch.b:
        place_in_pair += 1
    write_contact(naconmax, place_in_pair, float(touch.gap), place, make_frame(normal), margin, gap, condim, mixed_friction, mixed_solref, mixed_solreffriction,
                  mixed_solimp, mixed_adhesion, geoms, wp.vec2i(pair_id[0], -1), world, dist, pos, frame, includemargin, friction, solref, solreffriction, solimp, dim,
                  of_geoms, efc_address, worldid, kind, collisionid, adhesion, nacon)
