"""Contacts of non-convex meshes in MuJoCo, whose own are those of the meshes' convex hulls.

    model = mujoco.MjModel.from_xml_path("scene.xml")
    data = mujoco.MjData(model)
    contacts = tandem.mujoco.MeshContacts(model)
    while data.time < 1:
        contacts.step(data)                  # instead of mujoco.mj_step(model, data)

Needs the package `mujoco`; tried with 3.17 and 4.0.
"""

from __future__ import annotations

from typing import Any, Literal

import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np
from numpy.typing import NDArray

import tandem
from tandem._solver_pairs import Touches, asked_pairs

__all__ = ["MeshContacts"]

_Array = NDArray[np.float64]
# Contacts have a surface velocity, and may be speculative, from MuJoCo 4 on.
_CONTACT_FIELDS = [name for name in dir(mujoco.MjContact) if not name.startswith("_")]
_INTEGRATORS_THAT_COLLIDE = {mujoco.mjtIntegrator.mjINT_RK4: "RK4", mujoco.mjtIntegrator.mjINT_DISCRETE: "discrete"}
_FLAGS_THAT_COLLIDE = {flag: name for name in ("sleep", "speculative") if (flag := mujoco.mjtEnableBit.__members__.get(f"mjENBL_{name.upper()}"))}
_LEAST_FRICTION = 1e-5  # mjMINMU
_LEAST_MIX = 1e-15  # mjMINVAL


class MeshContacts:
    """Finds the contacts between mesh geoms of a model by Tandem, and leaves all others to MuJoCo.

    The meshes are those of the model, with all their faces; their hulls play no part. A pair of geoms has the points of its manifolds, each with
    the manifold's normal and its depth; where it is apart by less than its margin and gap, the points that are, found along the way from one to the
    other. Which pairs may collide is MuJoCo's rule (contype and conaffinity, weld and parent bodies, <exclude>, <pair>), taken from the model when
    this is made; the callback mjcb_contactfilter is not asked. Margin, gap, condim, friction, solref, solimp and what else a contact has are combined
    as MuJoCo does, from the model as it is in each call. A mesh that is wholly within another does not touch it.

    One call at a time; for threads that each have an MjData, make one for each.

    Args:
        model: not changed.
        most_points: of a manifold, 1 to 7.
        threads: of a scene.
        effort: as of tandem.build().

    Raises:
        ValueError: no two mesh geoms of the model may collide, or most_points is not 1 to 7.
    """

    def __init__(self, model: mujoco.MjModel, *, most_points: int = 7, threads: int = 1, effort: Literal["default", "fast", "best"] = "default") -> None:
        if not 1 <= most_points <= 7:
            raise ValueError(f"most_points {most_points}: is not from 1 to 7")
        self.model, self.most_points, self.threads = model, most_points, threads
        geom_pairs, explicit = _pairs_that_may_collide(model)
        if len(geom_pairs) == 0:
            raise ValueError("no two mesh geoms of the model may collide")
        self.geoms = np.unique(geom_pairs)  #: the geoms that Tandem looks at, ascending
        self._is_ours = np.zeros(model.ngeom, bool)
        self._is_ours[self.geoms] = True
        meshes, asset = np.unique(model.geom_dataid[self.geoms], return_inverse=True)
        self.assets = [_asset_of(model, mesh, effort) for mesh in meshes]  #: of the meshes that these geoms have
        self.instances = np.zeros(len(self.geoms), tandem.INSTANCE)  #: the geoms, posed as in the last call
        self.instances["asset"] = asset
        self._scene = tandem.Scene(self.assets, threads=threads)
        rows = np.searchsorted(self.geoms, geom_pairs)
        self._asked = asked_pairs(len(self.geoms), rows)
        self._explicit = {(int(a), int(b)): int(pair) for (a, b), pair in zip(geom_pairs, explicit) if pair >= 0}

    def step(self, data: mujoco.MjData, count: int = 1) -> None:
        """Does what mj_step(model, data, count) does, with Tandem's contacts.

        Raises:
            ValueError: the integrator is RK4 or discrete, or sleeping or speculative contacts are enabled: these look for contacts at places that
                MuJoCo does not open to others.
            MemoryError, tandem.Error: as of collide().
        """
        model, option = self.model, self.model.opt
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
        model, flags = self.model, self.model.opt.enableflags
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
        mujoco.mj_collision(self.model, data)
        if self.model.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT):
            return 0
        self._drop_hull_contacts(data)
        self.instances["rotation"] = data.geom_xmat[self.geoms].reshape(-1, 3, 3)
        self.instances["translation"] = data.geom_xpos[self.geoms]
        touches = Touches(self._scene, self.instances, self.most_points, self._asked)
        if (reach := self._reach()) > 0:
            touches.add_near(self._reach_of, reach)
        geom = np.stack([self.geoms[touches.a], self.geoms[touches.b]], axis=1)
        contact = self._parameters(geom)
        contact |= {"dist": touches.gap, "pos": touches.position, "frame": _frames(touches.normal)}
        if "surfacevel" in _CONTACT_FIELDS:
            contact["surfacevel"] = _surface_velocity(self.model, data, geom, touches.position, contact["frame"])
        contact["exclude"] = touches.gap >= contact["includemargin"]  # in the gap
        near = touches.gap <= contact["includemargin"] + contact.pop("gap")
        if not near.all():
            contact = {name: values[near] for name, values in contact.items()}
        _append(self.model, data, contact)
        return len(contact["dist"])

    def _drop_hull_contacts(self, data: mujoco.MjData) -> None:
        geom = data.contact.geom
        keep = np.flatnonzero(~((geom >= 0) & self._is_ours[geom]).all(axis=1))
        if len(keep) == len(geom):
            return
        if len(keep) > 0 and keep[-1] >= len(keep):
            contact = data.contact
            for name in _CONTACT_FIELDS:
                values = getattr(contact, name)
                values[:len(keep)] = values[keep]
        data.ncon = len(keep)

    def _reach(self) -> float:
        """Returns the largest sum of margin and gap of any pair, 0 at least."""
        model = self.model
        pairs = list(self._explicit.values())
        if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
            margin = max(model.opt.o_margin, 0.0)
            gap = np.concatenate([model.geom_gap[self.geoms] * 2, model.pair_gap[pairs]])
            return float(margin + gap.max(initial=0))
        one = (model.geom_margin + model.geom_gap)[self.geoms]
        return float(np.concatenate([2 * one, (model.pair_margin + model.pair_gap)[pairs]]).max(initial=0))

    def _reach_of(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> _Array:
        contact = self._parameters(np.stack([self.geoms[a], self.geoms[b]], axis=1))
        return np.asarray(contact["includemargin"] + contact["gap"])

    def _parameters(self, geom: NDArray[np.intp]) -> dict[str, Any]:
        """Returns what MuJoCo combines of the properties of two geoms (n, 2), or takes from the <pair> that they are, by the names of MjContact; and `gap`."""
        model = self.model
        priority, mix = model.geom_priority[geom], model.geom_solmix[geom]
        is_small = mix < _LEAST_MIX
        mix = np.where(is_small.all(axis=1, keepdims=True), 1.0, np.where(is_small, 0.0, mix))
        share = mix[:, 0] / mix.sum(axis=1)
        first, second = priority[:, 0] > priority[:, 1], priority[:, 0] < priority[:, 1]
        share = np.where(first, 1.0, np.where(second, 0.0, share))[:, None]

        def mixed(values: NDArray[Any]) -> NDArray[Any]:
            both = values[geom]
            return np.asarray(share * both[:, 0] + (1 - share) * both[:, 1])

        def combined(values: NDArray[Any], rule: Any) -> NDArray[Any]:
            both, shape = values[geom], (-1,) + (1,) * (values.ndim - 1)
            return np.where(first.reshape(shape), both[:, 0], np.where(second.reshape(shape), both[:, 1], rule(both[:, 0], both[:, 1])))

        solref = model.geom_solref[geom]
        is_standard = ((solref[:, :, 0] > 0).all(axis=1) | first | second)[:, None]
        friction = combined(model.geom_friction, np.maximum)[:, [0, 0, 1, 2, 2]]
        result = {
            "geom": geom, "dim": combined(model.geom_condim, np.maximum), "friction": friction, "adhesion": combined(model.geom_adhesion, np.add),
            "solref": np.where(is_standard, mixed(model.geom_solref), solref.min(axis=1)), "solreffriction": np.zeros((len(geom), mujoco.mjNREF)),
            "solimp": mixed(model.geom_solimp), "includemargin": model.geom_margin[geom].sum(axis=1), "gap": model.geom_gap[geom].sum(axis=1),
        }
        self._apply_explicit(geom, result)
        if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
            option = model.opt
            for name, value in (("friction", option.o_friction), ("solref", option.o_solref), ("solreffriction", option.o_solref),
                                ("solimp", option.o_solimp), ("includemargin", option.o_margin)):
                result[name][:] = value
        np.maximum(result["friction"], _LEAST_FRICTION, out=result["friction"])
        return result | {"geom1": geom[:, 0], "geom2": geom[:, 1]}

    def _apply_explicit(self, geom: NDArray[np.intp], result: dict[str, Any]) -> None:
        if not self._explicit:
            return
        pair = np.array([self._explicit.get((int(a), int(b)), -1) for a, b in geom], np.intp)
        rows, pair = np.flatnonzero(pair >= 0), pair[pair >= 0]
        for name, field in (("dim", "dim"), ("friction", "friction"), ("solref", "solref"), ("solreffriction", "solreffriction"), ("solimp", "solimp"),
                            ("includemargin", "margin"), ("gap", "gap"), ("adhesion", "adhesion")):
            result[name][rows] = getattr(self.model, f"pair_{field}")[pair]


def _asset_of(model: mujoco.MjModel, mesh: int, effort: Literal["default", "fast", "best"]) -> tandem.Asset:
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[vertex:vertex + model.mesh_vertnum[mesh]].astype(np.float64)
    return tandem.build(vertices, model.mesh_face[face:face + model.mesh_facenum[mesh]], effort=effort)


def _pairs_that_may_collide(model: mujoco.MjModel) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of mesh geoms, (m, 2), the lower one first, and of each its row among the model's <pair>s, or -1."""
    is_mesh = model.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    rows = np.flatnonzero(is_mesh[model.pair_geom1] & is_mesh[model.pair_geom2]) if model.npair else np.empty(0, np.intp)
    named = np.sort(np.stack([model.pair_geom1[rows], model.pair_geom2[rows]], axis=1).astype(np.intp), axis=1).reshape(-1, 2)
    geoms = np.flatnonzero(is_mesh & ((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
    i, j = (geoms[index] for index in np.triu_indices(len(geoms), 1))
    body = model.geom_bodyid
    weld = model.body_weldid[body]
    parent = model.body_weldid[model.body_parentid[weld]]
    may = (model.geom_contype[i] & model.geom_conaffinity[j] | model.geom_contype[j] & model.geom_conaffinity[i]) != 0
    may &= weld[i] != weld[j]
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        may &= (weld[i] == 0) | (weld[j] == 0) | (weld[i] != parent[j]) & (weld[j] != parent[i])
    low, high = np.minimum(body[i], body[j]).astype(np.int64), np.maximum(body[i], body[j])
    may &= ~np.isin((low << 16) + high, model.exclude_signature.astype(np.int64))
    may &= ~np.isin(i * model.ngeom + j, named[:, 0] * model.ngeom + named[:, 1])
    pairs = np.concatenate([np.stack([i[may], j[may]], axis=1), named])
    return pairs, np.concatenate([np.full(int(may.sum()), -1, np.intp), rows])


def _frames(normal: _Array) -> _Array:
    """Normal and two tangents, (n, 9), chosen as mju_makeFrame() does."""
    row = np.arange(len(normal))
    axis = np.where(np.abs(normal[:, 1]) < 0.5, 1, 2)
    tangent = -normal[row, axis][:, None] * normal
    tangent[row, axis] += 1
    tangent /= np.sqrt(np.einsum("ni,ni->n", tangent, tangent))[:, None]
    frames = np.empty((len(normal), 9))
    frames[:, :3], frames[:, 3:6] = normal, tangent
    frames[:, 6:] = normal[:, (1, 2, 0)] * tangent[:, (2, 0, 1)] - normal[:, (2, 0, 1)] * tangent[:, (1, 2, 0)]
    return frames


def _surface_velocity(model: mujoco.MjModel, data: mujoco.MjData, geom: NDArray[np.intp], position: _Array, frame: _Array) -> _Array:
    """Returns the surface velocity of geom[:, 1] against geom[:, 0] at the contacts, along both tangents, and spin about the normal: (n, 3)."""
    if not model.geom_surfacevel.any():
        return np.zeros((len(geom), 3))
    rotation, axes = data.geom_xmat.reshape(-1, 3, 3)[geom], frame.reshape(-1, 3, 3)
    linear, spin = (np.einsum("nsij,nsj->nsi", rotation, model.geom_surfacevel[geom][:, :, part]) for part in (slice(0, 3), slice(3, 6)))
    linear += np.cross(spin, position[:, None] - data.geom_xpos[geom])
    along = np.einsum("nij,nj->ni", axes[:, 1:], linear[:, 1] - linear[:, 0])
    return np.column_stack([along, np.einsum("ni,ni->n", axes[:, 0], spin[:, 1] - spin[:, 0])])


def _append(model: mujoco.MjModel, data: mujoco.MjData, contact: dict[str, Any]) -> None:
    """Adds the contacts, whose fields have a row for each, to data.contact."""
    before = data.ncon
    blank = mujoco.MjContact()
    blank.flex[:], blank.elem[:], blank.vert[:], blank.efc_address = -1, -1, -1, -1
    for _ in range(len(contact["dist"])):
        if mujoco.mj_addContact(model, data, blank):
            data.ncon = before
            raise MemoryError(f"{len(contact['dist'])} contacts of meshes have no room in MjData: give the model <size memory=\"...\"/> more")
    added = data.contact
    for name, values in contact.items():
        getattr(added, name)[before:] = values
