"""Reads what stands where from scene files and from the states that runs of bvhbench simulate keep, and which triangles meet from contacts files."""
import dataclasses
import struct

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

import bvh_file


@dataclasses.dataclass
class Bodies:
    """What stands where: rows of `asset`, which are of `shapes`, `rotation` and `translation` are bodies."""
    shapes: list  # Shape
    asset: np.ndarray
    fixed: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    contacts: np.ndarray | None = None  # bool [body, source face]: which triangles meet others; None: not asked for

    @property
    def diagonals(self):
        return np.array([shape.diagonal for shape in self.shapes])[self.asset]

    @property
    def subject(self):
        """Which bodies a picture has to show: all but fixed ones that are more than four times as large as the median body, the ground."""
        ground = self.fixed & (self.diagonals > 4 * np.median(self.diagonals))
        return ~ground if not ground.all() else ground


@dataclasses.dataclass
class Mesh:
    points: np.ndarray  # [p,3]
    corners: np.ndarray  # [t,3]: points
    closed: bool
    face: np.ndarray  # [t]: of the source file
    error: float  # no point is farther than this from the mesh of which it is a level of detail


@dataclasses.dataclass
class Shape:
    levels: list  # Mesh: the one that a body has, then coarser ones

    @property
    def points(self):
        return self.levels[0].points

    @property
    def face(self):
        return self.levels[0].face

    @property
    def box(self):
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])

    @property
    def diagonal(self):
        return np.linalg.norm(self.box[7] - self.box[0])


def is_closed(corners):
    """Whether every edge has its opposite, so that a face is never seen from behind."""
    start, end = corners, np.roll(corners, -1, axis=1)
    there, back = start * (corners.max() + 1) + end, end * (corners.max() + 1) + start
    return np.array_equal(np.sort(there, axis=None), np.sort(back, axis=None))


def read_mesh(path, level):
    try:
        file = bvh_file.read(path, level)
    except (AssertionError, KeyError, struct.error) as error:
        raise ValueError(f"{path}: not a .bvh file that can be read") from error
    points, corners = np.unique(file.world.reshape(-1, 3), axis=0, return_inverse=True)
    corners = corners.reshape(-1, 3)
    return Mesh(points, corners, is_closed(corners), file.source_face, file.levels[level]["error_bound"]), len(file.levels)


def read_shape(path, level):
    first, count = read_mesh(path, level)
    return Shape([first] + [read_mesh(path, k)[0] for k in range(level + 1, count)])


def read_shapes(path, file, group):
    """The shapes of the bodies in a group, /instances or /bodies, and which of them each body has: one for each asset and level of detail in use."""
    names = [name.decode() if isinstance(name, bytes) else name for name in file["assets"][:]]
    asset = file[f"{group}/asset"][:].astype(int)
    level = file[f"{group}/level"][:].astype(int) if f"{group}/level" in file else np.zeros(len(asset), int)
    used, of_each = np.unique(np.stack([asset, level], 1), axis=0, return_inverse=True)
    return [read_shape(path.parent / names[row], at) for row, at in used.tolist()], of_each.reshape(-1)


def read_run(path, file, wanted):
    """The states after the wanted numbers of steps, or the last state where no number is wanted."""
    kept = file["trajectory/frame"][:].tolist() if "trajectory" in file else []
    if not kept:
        raise ValueError("keeps no state: simulate with --trajectory")
    for frame in wanted:
        if frame not in kept:
            raise ValueError(f"does not keep the state after step {frame}, but every {kept[1] - kept[0]}th "
                             f"up to {kept[-1]}" if len(kept) > 1 else "keeps the start alone")
    (shapes, asset), fixed = read_shapes(path, file, "bodies"), file["bodies/motion"][:] == 1
    centre = file["bodies/centre_of_mass"][:]
    position, orientation = file["trajectory/position"], file["trajectory/orientation"]  # which remember chunks as long as they are open
    for row in [kept.index(frame) for frame in wanted or kept[-1:]]:
        w_last = np.roll(orientation[row], -1, axis=1)
        rotation = Rotation.from_quat(w_last).as_matrix()
        moved = np.einsum("nij,nj->ni", rotation, centre)
        yield Bodies(shapes, asset, fixed, rotation, position[row] - moved)


def read_scene(path, file):
    shapes, asset = read_shapes(path, file, "instances")
    if "simulation/motion" in file:
        fixed = file["simulation/motion"][:] == 1
    else:
        fixed = np.ones(len(asset), bool)
    bodies = Bodies(shapes, asset, fixed, file["instances/rotation"][:], file["instances/translation"][:])
    if "simulation/motion" not in file:
        bodies.fixed = ~bodies.subject
    return bodies


def read(path, wanted=()):
    """What stands where, for each of the frames that are wanted, one at a time: a large run does not fit into memory."""
    with h5py.File(path, rdcc_nbytes=1 << 26, rdcc_nslots=20011) as file:  # chunks of a thinned run hold many states
        if "trajectory" in file or "bodies" in file:
            yield from read_run(path, file, wanted)
        elif wanted:
            raise ValueError("is a scene, which has no frames")
        else:
            yield read_scene(path, file)


def read_contacts(path, bodies):
    """The bodies with the contacts that `bvhbench query --out` found of their scene file."""
    with h5py.File(path) as file:
        pair = file["pairs"][:][file["contacts/pair"][:]].astype(int)
        face = np.stack([file["contacts/face_a"][:], file["contacts/face_b"][:]], 1).astype(int)
    contacts = np.zeros((len(bodies.asset), max(int(shape.face.max()) for shape in bodies.shapes) + 1), bool)
    if pair.size and (pair.max() >= contacts.shape[0] or face.max() >= contacts.shape[1]):
        raise ValueError(f"{path}: holds the contacts of another scene")
    contacts[pair, face] = True
    return dataclasses.replace(bodies, contacts=contacts)
