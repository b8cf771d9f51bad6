"""Contacts of non-convex meshes in MuJoCo, whose own are those of the meshes' convex hulls.

    model = mujoco.MjModel.from_xml_path("scene.xml")
    data = mujoco.MjData(model)
    contacts = tandem.mujoco.MeshContacts(model)
    while data.time < 1:
        contacts.step(data)                  # instead of mujoco.mj_step(model, data)

Needs the package `mujoco`; tried with 3.17 and 4.0.
"""

from __future__ import annotations

import functools
from typing import Any, Literal

import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np
from numpy.typing import NDArray

import tandem
from tandem import _shapes, _tandem
from tandem._poses import explained
from tandem._scene import cores_of
from tandem._solver_pairs import asked_pairs

__all__ = ["MeshContacts"]

_Effort = Literal["default", "fast", "best"]
_Type = mujoco.mjtGeom
_PRIMITIVES = {_Type.mjGEOM_SPHERE: "sphere", _Type.mjGEOM_CAPSULE: "capsule", _Type.mjGEOM_ELLIPSOID: "ellipsoid", _Type.mjGEOM_CYLINDER: "cylinder",
               _Type.mjGEOM_BOX: "box"}
_SHAPES = [_Type.mjGEOM_PLANE, _Type.mjGEOM_HFIELD, *_PRIMITIVES, _Type.mjGEOM_MESH]  # in the order in which a contact names its two geoms
_INTEGRATORS_THAT_COLLIDE = {mujoco.mjtIntegrator.mjINT_RK4: "RK4", mujoco.mjtIntegrator.mjINT_DISCRETE: "discrete"}
_FLAGS_THAT_COLLIDE = {flag: name for name in ("sleep", "speculative") if (flag := mujoco.mjtEnableBit.__members__.get(f"mjENBL_{name.upper()}"))}
_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
_OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
_SLABS = 16  # widths of a plane's slab, each four times that of the one before: the last is 10^9 times as wide as a mesh


class MeshContacts:
    """Finds the contacts of a model's mesh geoms by Tandem, and leaves those of two other geoms to MuJoCo.

    The meshes are those of the model, with all their faces; their hulls play no part. What they meet are meshes too: boxes and height fields as they are, planes
    as slabs that reach beyond all that could touch them, and meshes of spheres, capsules, ellipsoids and cylinders whose faces lie between the shape scaled by
    1 - tolerance and by 1 + tolerance. A pair of geoms has the points of its manifolds, each with its normal and depth; the deepest, where it
    alone is deep, acts through the manifold's centre. Where a pair is apart by less than its margin and gap, it has the points that are, found along the way from
    one to the other. Which pairs may collide is MuJoCo's rule (contype and conaffinity,
    weld and parent bodies, <exclude>, <pair>); it, meshes, sizes and height fields are taken from the model when this is made, and the callback
    mjcb_contactfilter is not asked. Margin, gap, condim, friction, solref, solimp and what else a contact has are combined as MuJoCo does, from the model as it is
    in each call. A geom that is wholly within another does not touch it; a mesh wholly below a plane has MuJoCo's contacts. Geoms of type sdf, and flexes, are
    MuJoCo's.

    One call at a time; for threads that each have an MjData, make one for each.

    Args:
        model: not changed.
        tolerance: 1e-6 to 0.5, the error of round shapes as a part of their size.
        most_points: of a manifold, 1 to 7.
        threads: of a scene.
        effort: as of tandem.build().

    Raises:
        ValueError: no mesh geom of the model may collide, or tolerance or most_points is out of range.
    """

    def __init__(self, model: mujoco.MjModel, *, tolerance: float = 0.002, most_points: int = 7, threads: int = 1, effort: _Effort = "default") -> None:
        if not 1 <= most_points <= 7:
            raise ValueError(f"most_points {most_points}: is not from 1 to 7")
        shapes = _shapes.Shapes(tolerance)
        self.model, self.tolerance, self.most_points, self.threads = model, tolerance, most_points, threads
        self._option = model.opt
        geom_pairs, explicit = _pairs_that_may_collide(model)
        if len(geom_pairs) == 0:
            raise ValueError("no mesh geom of the model may collide")
        geoms = np.unique(geom_pairs)
        kind = model.geom_type[geoms]
        self.geoms = geoms[np.argsort(kind, kind="stable")]  #: those that Tandem looks at, by type and number
        body_of = np.zeros(model.ngeom, np.intp)
        body_of[self.geoms] = np.arange(len(self.geoms))
        pairs = np.sort(body_of[geom_pairs], axis=1)
        is_mesh, is_plane = (np.sort(kind) == shape for shape in (_Type.mjGEOM_MESH, _Type.mjGEOM_PLANE))
        radius = np.zeros(len(self.geoms))
        asset = np.zeros(len(self.geoms), np.uint32)
        places: dict[tuple[float, ...], tuple[int, float]] = {}  # of each shape, its asset and its radius
        self.assets: list[tandem.Asset] = []  #: of the shapes that these geoms have
        for body in np.flatnonzero(~is_plane):
            shape = _shape_of(model, self.geoms[body])
            if shape not in places:
                vertices, faces = _solid_of(model, shapes, shape)
                places[shape] = len(self.assets), float(np.linalg.norm(vertices, axis=1).max())
                self.assets.append(tandem.build(vertices, faces, effort=effort))
            asset[body], radius[body] = places[shape]
        width = 2.0 ** np.ceil(np.log2(4 * radius[is_mesh].max()))
        slabs = len(self.assets), _SLABS, width
        if is_plane.any():
            self.assets += [tandem.build(*_shapes.slab(width * 4.0**k), effort="fast") for k in range(_SLABS)]
        explicit_pairs = np.column_stack([pairs, explicit])[explicit >= 0]
        asked, columns = asked_pairs(pairs, is_mesh)
        self._native = _tandem.MujocoContacts(
            cores_of(self.assets), asset, asked, None if columns is None else tandem.Filter(**columns)._core, threads, most_points, model, self.geoms.astype(np.uint32), radius,
            _sorted_rows(explicit_pairs), _sorted_rows(pairs[is_plane[pairs[:, 0]]]), slabs, _contact_layout())

    @property
    def instances(self) -> NDArray[np.void]:
        """The geoms, posed as in the last call, array of tandem.INSTANCE."""
        return np.frombuffer(self._native.instances(), tandem.INSTANCE)

    def step(self, data: mujoco.MjData, count: int = 1) -> None:
        """Does what mj_step(model, data, count) does, with Tandem's contacts.

        Raises:
            ValueError: the integrator is RK4 or discrete, or sleeping or speculative contacts are enabled: these look for contacts at places that
                MuJoCo does not open to others.
            MemoryError, tandem.Error: as of collide().
        """
        model, option = self.model, self._option
        if option.integrator in _INTEGRATORS_THAT_COLLIDE:
            raise ValueError(f"the integrator {_INTEGRATORS_THAT_COLLIDE[option.integrator]} looks for contacts by itself; "
                             "take Euler, implicit or implicitfast")
        for _ in range(count):
            mujoco.mj_checkPos(model, data)
            mujoco.mj_checkVel(model, data)
            self.forward(data)
            mujoco.mj_checkAcc(model, data)
            if option.enableflags & mujoco.mjtEnableBit.mjENBL_FWDINV:
                mujoco.mj_compareFwdInv(model, data)
            if option.integrator == mujoco.mjtIntegrator.mjINT_EULER:
                mujoco.mj_Euler(model, data)
            else:
                mujoco.mj_implicit(model, data)

    def forward(self, data: mujoco.MjData) -> None:
        """Does what mj_forward(model, data) does, with Tandem's contacts. Raises what step() raises, whatever the integrator."""
        model, flags = self.model, self._option.enableflags
        for flag, name in _FLAGS_THAT_COLLIDE.items():
            if flags & flag:
                raise ValueError(f"the flag {name} looks for contacts by itself; disable it")
        data.flg_energypos = 0  # what was found at the positions before
        mujoco.mj_fwdKinematics(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_factorM(model, data)
        self.collide(data)
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_transmission(model, data)
        mujoco.mj_sensorPos(model, data)
        if flags & mujoco.mjtEnableBit.mjENBL_ENERGY:
            mujoco.mj_energyPos(model, data)
        mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_POS, 0)

    def collide(self, data: mujoco.MjData) -> int:
        """Does what mj_collision(model, data) does, with Tandem's contacts, which come last in data.contact; returns how many they are.

        For programs that call the stages of a step by themselves: after mj_fwdKinematics(), before mj_makeConstraint().

        Raises:
            MemoryError: data has no room for all contacts (<size memory="..."/>); data.contact then has MuJoCo's other contacts alone.
            tandem.Error: a geom's pose is not a number.
        """
        model, option = self.model, self._option
        mujoco.mj_collision(model, data)
        if option.disableflags & _NO_CONTACTS:
            return 0
        try:
            count = self._native.find(data.geom_xpos, data.geom_xmat, option.o_margin if option.enableflags & _OVERRIDE else None)
        except tandem.Error as error:
            raise explained(error, self.instances) from None
        before = data.ncon
        kept = self._native.drop_hulls(data.contact.dist) if before else 0
        for _ in range(kept + count - before):
            if mujoco.mj_addContact(model, data, _BLANK):
                data.ncon = kept
                raise MemoryError(f"{count} contacts of meshes have no room in MjData: give the model <size memory=\"...\"/> more")
        data.ncon = kept + count
        if count:
            self._native.write(data.contact.dist)
        return int(count)


_BLANK = mujoco.MjContact()


@functools.cache
def _contact_layout() -> dict[str, int]:
    """Returns where mjContact has its members, in bytes from `dist` on, and its `size`."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    for _ in range(2):
        mujoco.mj_addContact(model, data, _BLANK)
    contact = data.contact
    places = {name: getattr(contact, name).__array_interface__["data"][0] for name in dir(contact) if not name.startswith("_")}
    return {name: place - places["dist"] for name, place in places.items()} | {"size": contact.dist.strides[0]}


def _sorted_rows(rows: NDArray[np.intp]) -> NDArray[np.uint32]:
    return np.unique(rows.astype(np.uint32), axis=0)


def _shape_of(model: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    """Returns the type of a geom, and its mesh, its height field or its size: the same for the same shape."""
    kind = int(model.geom_type[geom])
    if kind in (_Type.mjGEOM_MESH, _Type.mjGEOM_HFIELD):
        return kind, int(model.geom_dataid[geom])
    return kind, *model.geom_size[geom].tolist()


def _solid_of(model: mujoco.MjModel, shapes: _shapes.Shapes, shape: tuple[float, ...]) -> _shapes.Solid:
    kind, (x, y, z) = shape[0], (*shape[1:], 0, 0)[:3]
    if kind in _PRIMITIVES:
        return shapes.of(_PRIMITIVES[kind], x, y, z)
    place = int(shape[1])
    if kind == _Type.mjGEOM_HFIELD:
        (x, y, z, base), rows, columns, first = (values[place] for values in (model.hfield_size, model.hfield_nrow, model.hfield_ncol, model.hfield_adr))
        heights = model.hfield_data[first:first + rows * columns].reshape(rows, columns).astype(float)
        return _shapes.height_field(x, y, base, z * heights)
    vertex, face = model.mesh_vertadr[place], model.mesh_faceadr[place]
    vertices = model.mesh_vert[vertex:vertex + model.mesh_vertnum[place]].astype(np.float64)
    return vertices, model.mesh_face[face:face + model.mesh_facenum[place]]


def _pairs_that_may_collide(model: mujoco.MjModel) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of geoms, a mesh among them, (m, 2), the lower one first, and of each its row among the model's <pair>s, or -1."""
    is_mesh, is_ours = model.geom_type == _Type.mjGEOM_MESH, np.isin(model.geom_type, _SHAPES)

    def has_mesh(i: NDArray[np.intp], j: NDArray[np.intp]) -> NDArray[np.bool_]:
        return np.asarray((is_mesh[i] | is_mesh[j]) & is_ours[i] & is_ours[j])

    rows = np.flatnonzero(has_mesh(model.pair_geom1, model.pair_geom2)) if model.npair else np.empty(0, np.intp)
    named = np.sort(np.stack([model.pair_geom1[rows], model.pair_geom2[rows]], axis=1).astype(np.intp), axis=1).reshape(-1, 2)
    geoms = np.flatnonzero(is_ours & ((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
    i, j = (geoms[index] for index in np.triu_indices(len(geoms), 1))
    body = model.geom_bodyid
    weld = model.body_weldid[body]
    parent = model.body_weldid[model.body_parentid[weld]]
    may = has_mesh(i, j) & ((model.geom_contype[i] & model.geom_conaffinity[j] | model.geom_contype[j] & model.geom_conaffinity[i]) != 0)
    may &= weld[i] != weld[j]
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        may &= (weld[i] == 0) | (weld[j] == 0) | (weld[i] != parent[j]) & (weld[j] != parent[i])
    low, high = np.minimum(body[i], body[j]).astype(np.int64), np.maximum(body[i], body[j])
    may &= ~np.isin((low << 16) + high, model.exclude_signature.astype(np.int64))
    may &= ~np.isin(i * model.ngeom + j, named[:, 0] * model.ngeom + named[:, 1])
    pairs = np.concatenate([np.stack([i[may], j[may]], axis=1), named])
    return pairs, np.concatenate([np.full(int(may.sum()), -1, np.intp), rows])
