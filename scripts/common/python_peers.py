"""Libraries that find contacts of meshes, from Python: a class each for scripts/python_peers.

A peer is made of a mesh and the poses of its bodies, which it is set up for. frame() gives the bodies other poses and finds all contacts; contacts() reads what
the last frame found: rows (a, b, face of a, face of b), a < b, or (a, b).
"""
import importlib
import sys

import numpy as np


def available(gpu):
    """The peers of which all modules are installed, Tandem first."""
    found = []
    for peer in GPU if gpu else CPU:
        try:
            for module in peer.needs:
                importlib.import_module(module)
            found.append(peer)
        except ImportError as defect:
            print(f"without {peer.name}: {defect}", file=sys.stderr)
    return found


class Tandem:
    name, needs = "Tandem", ["tandem"]

    def __init__(self, vertices, faces, rotation, translation):
        import tandem
        self.scene = tandem.Scene([tandem.build(vertices, faces)])

    def frame(self, rotation, translation):
        self.found = self.scene.place(rotation=rotation, translation=translation).contacts()

    def contacts(self):
        pairs, contacts = self.found.pairs[self.found.contacts["pair"]], self.found.contacts
        return np.stack([pairs["a"], pairs["b"], contacts["face_a"], contacts["face_b"]], axis=1)


class TandemPairs(Tandem):
    name = "Tandem, bodies only"

    def frame(self, rotation, translation):
        self.found = self.scene.place(rotation=rotation, translation=translation).contacts(first_contact_only=True)

    def contacts(self):
        return super().contacts()[:, :2]


class Manager:
    """A collision manager of trimesh's kind that names the bodies that collide."""

    data = False

    def __init__(self, vertices, faces, rotation, translation):
        import trimesh
        self.manager = importlib.import_module(self.needs[0]).CollisionManager()
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        for body, transform in enumerate(self.transforms(rotation, translation)):
            self.manager.add_object(body, mesh, transform)

    def transforms(self, rotation, translation):
        transforms = np.tile(np.eye(4), (len(rotation), 1, 1))
        transforms[:, :3, :3], transforms[:, :3, 3] = rotation, translation
        return transforms

    def frame(self, rotation, translation):
        for body, transform in enumerate(self.transforms(rotation, translation)):
            self.manager.set_transform(body, transform)
        self.found = self.manager.in_collision_internal(return_names=not self.data, return_data=self.data)[1]

    def contacts(self):
        if not self.data:
            return np.array(sorted(self.found)).reshape(-1, 2)
        pairs = [sorted(contact.names) for contact in self.found]
        return np.array([(a, b, contact.index(a), contact.index(b)) for (a, b), contact in zip(pairs, self.found)]).reshape(-1, 4)


class TandemManager(Manager):
    name, needs = "tandem.trimesh, names", ["tandem.trimesh"]


class TandemManagerData(Manager):
    name, needs, data = "tandem.trimesh, data", ["tandem.trimesh"], True


class TrimeshManager(Manager):
    name, needs = "trimesh + python-fcl, names", ["trimesh.collision", "fcl"]


class TrimeshManagerData(Manager):
    name, needs, data = "trimesh + python-fcl, data", ["trimesh.collision", "fcl"], True


class Coal:
    """Its manager's broad phase with the default callback: all contacts, without points and normals."""

    name, needs = "Coal", ["coal"]

    def __init__(self, vertices, faces, rotation, translation):
        import coal
        self.coal = coal
        mesh = coal.BVHModelOBB()
        mesh.beginModel(len(faces), len(vertices))
        corners, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        corners.extend(list(vertices))
        triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
        mesh.addSubModel(corners, triangles)
        mesh.endModel()
        # A contact names the mesh, not the body.
        self.meshes = [mesh.clone() for _ in rotation]
        self.objects = [coal.CollisionObject(own, *pose) for own, *pose in zip(self.meshes, rotation, translation)]
        self.manager = coal.DynamicAABBTreeCollisionManager()
        for one in self.objects:
            self.manager.registerObject(one)
        self.manager.setup()
        self.request = coal.CollisionRequest(coal.CollisionRequestFlag.NO_REQUEST, 1 << 30)

    def frame(self, rotation, translation):
        for one, turn, place in zip(self.objects, rotation, translation):
            one.setTransform(self.coal.Transform3s(turn, place))
            one.computeAABB()
        self.manager.update()
        self.found = self.coal.CollisionCallBackDefault()
        self.found.data.request = self.request
        self.manager.collide(self.found)

    def contacts(self):
        bodies = {mesh.id(): body for body, mesh in enumerate(self.meshes)}
        rows = [(bodies[contact.o1.id()], bodies[contact.o2.id()], contact.b1, contact.b2) for contact in self.found.data.result.getContacts()]
        return np.array([row if row[0] < row[1] else (row[1], row[0], row[3], row[2]) for row in rows]).reshape(-1, 4)


def box_pairs(lower, upper, rotation, translation):
    """(n, 2) bodies a < b whose world boxes, those of the corners of a box, meet: by sorting along x."""
    corners = np.array(np.meshgrid(*zip(lower, upper))).reshape(3, -1).T
    placed = np.einsum("nij,kj->nki", rotation, corners) + translation[:, None]
    low, high = placed.min(axis=1), placed.max(axis=1)
    order = np.argsort(low[:, 0])
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    pairs = [np.array([[body, other] for other in order[place + 1 : end]]).reshape(-1, 2) for place, (body, end) in enumerate(zip(order, ends))]
    pairs = np.concatenate(pairs).astype(np.int64)
    a, b = pairs.T
    meet = (low[a] <= high[b]).all(axis=1) & (low[b] <= high[a]).all(axis=1)
    return np.unique(np.sort(pairs[meet], axis=1), axis=0)


class MeshLib:
    """findCollidingTriangles() of the pairs whose boxes meet, which numpy finds. float32."""

    name, needs = "MeshLib", ["meshlib.mrmeshpy", "meshlib.mrmeshnumpy"]

    def __init__(self, vertices, faces, rotation, translation):
        from meshlib import mrmeshnumpy, mrmeshpy
        self.library = mrmeshpy
        self.bounds = vertices.min(axis=0), vertices.max(axis=0)
        self.mesh = mrmeshnumpy.meshFromFacesVerts(faces.astype(np.int32), vertices.astype(np.float32))
        self.part = mrmeshpy.MeshPart(self.mesh)
        mrmeshpy.findCollidingTriangles(self.part, self.part)  # makes the tree

    def frame(self, rotation, translation):
        library, vector = self.library, self.library.Vector3f
        self.pairs = box_pairs(*self.bounds, rotation, translation)
        a, b = self.pairs.T
        turn = np.einsum("nji,njk->nik", rotation[a], rotation[b])
        shift = np.einsum("nji,nj->ni", rotation[a], translation[b] - translation[a])
        self.found = []
        for rows, place in zip(turn.tolist(), shift.tolist()):
            pose = library.AffineXf3f(library.Matrix3f(vector(*rows[0]), vector(*rows[1]), vector(*rows[2])), vector(*place))
            self.found.append(library.findCollidingTriangles(self.part, self.part, pose))

    def contacts(self):
        return np.array([(a, b, int(row.aFace), int(row.bFace)) for (a, b), rows in zip(self.pairs.tolist(), self.found) for row in rows]).reshape(-1, 4)


class Warp:
    """A thread for each triangle of the first body of every pair whose boxes meet (numpy finds these) asks the tree of the second for boxes, and decides by
    Warp's intersect_tri_tri in float64."""

    name, needs, device = "Warp", ["warp"], "cpu"

    def __init__(self, vertices, faces, rotation, translation):
        import warp
        from . import warp_contacts
        self.warp, self.kernel = warp, warp_contacts.find
        self.bounds = vertices.min(axis=0), vertices.max(axis=0)
        points = warp.array(vertices.astype(np.float32), dtype=warp.vec3, device=self.device)
        self.mesh = warp.Mesh(points, warp.array(faces.reshape(-1).astype(np.int32), dtype=int, device=self.device))
        self.corners = warp.array(vertices[faces].reshape(-1, 3), dtype=warp.vec3d, device=self.device)
        self.faces, self.room = len(faces), 1 << 16
        self.frame(rotation, translation)  # compiles the kernel

    def placed(self, rotation, translation):
        """Pairs, rotations and translations, where the kernel takes them."""
        warp = self.warp
        pairs = box_pairs(*self.bounds, rotation, translation).astype(np.int32)
        return [warp.array(values, dtype=kind, device=self.device) for values, kind in ((pairs, warp.vec2i), (rotation, warp.mat33d), (translation, warp.vec3d))]

    def frame(self, rotation, translation):
        warp, posed = self.warp, self.placed(rotation, translation)
        while True:
            self.count = warp.zeros(1, dtype=int, device=self.device)
            self.found = warp.empty(self.room, dtype=warp.vec4i, device=self.device)
            warp.launch(self.kernel, (len(posed[0]), self.faces), [self.mesh.id, self.corners, self.corners, *posed, self.count, self.found], device=self.device)
            count = int(self.count.numpy()[0])
            if count <= self.room:
                return
            self.room = 2 * count

    def contacts(self):
        return self.found.numpy()[: int(self.count.numpy()[0])]


class WarpCuda(Warp):
    """As Warp; pairs and poses lie on the GPU before the frame's time begins."""

    device = "cuda"

    def placed(self, rotation, translation):
        if not hasattr(self, "kept"):
            self.kept = {}
        if id(rotation) not in self.kept:
            self.kept[id(rotation)] = rotation, super().placed(rotation, translation)
        return self.kept[id(rotation)][1]


class TandemCuda:
    """tandem.cuda.Query; poses lie on the GPU before the frame's time begins."""

    name, needs = "Tandem", ["tandem.cuda", "cupy"]

    def __init__(self, vertices, faces, rotation, translation):
        import tandem.cuda
        self.query, self.kept = tandem.cuda.Query([tandem.build(vertices, faces)]), {}

    def frame(self, rotation, translation):
        import cupy
        if id(rotation) not in self.kept:
            self.kept[id(rotation)] = rotation, self.query.instances(pose=cupy.asarray(np.concatenate([rotation, translation[:, None]], axis=1)))
        self.found = self.query.contacts(self.kept[id(rotation)][1])

    def contacts(self):
        pairs, contacts = self.found.pairs.numpy(), self.found.contacts.numpy()
        pairs = pairs[contacts["pair"]]
        return np.stack([pairs["a"], pairs["b"], contacts["face_a"], contacts["face_b"]], axis=1)


CPU = [Tandem, TandemPairs, TandemManager, TandemManagerData, TrimeshManager, TrimeshManagerData, Coal, MeshLib, Warp]
GPU = [TandemCuda, WarpCuda]
