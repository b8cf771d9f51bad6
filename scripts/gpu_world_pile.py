"""The pile of scripts/gpu_world_peers, and a judge of the states that engines report of it: Tandem's exact manifolds.

Bodies fall from a lattice, as those of tests/gpu/gpu_world_speed.cpp but from so far apart that none touches another, into a tray of five boxes, whose floor is z = 0.
"""
import sys
from pathlib import Path

import h5py
import numpy as np

from common import obj_files, rotations, tools

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/python"))
import solids

DT, GRAVITY, FRICTION, DENSITY = 1 / 60, 9.81, 0.5, 1000
GAP = 1.02  # between the middles of bodies, of the diagonal of their mesh: they start apart
THICKNESS, HEIGHT = 2.0, 8.0  # metres, of walls
AROUND_Z, AROUND_X = np.array([0, 0, 1]), np.array([1, 0, 0])


def turned(angles):
    """Rotations (n, 3, 3) about x by the angles, then about z."""
    def about(axis):
        return rotations.matrices(np.concatenate([np.cos(angles / 2)[:, None], np.sin(angles / 2)[:, None] * axis], axis=1))
    return about(AROUND_Z) @ about(AROUND_X)


class Pile:
    """Bodies of one mesh, with the poses of their start, and fixed boxes: centres and half sizes, which are not turned."""

    def __init__(self, mesh, count):
        self.name, self.count = mesh.stem, count
        vertices, self.triangles = obj_files.read(mesh)
        self.vertices = vertices.astype("f4").astype("f8")
        gap = GAP * np.linalg.norm(np.ptp(self.vertices, axis=0))
        self.middle = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2
        side = max(1, int(np.ceil(np.sqrt(count / 20))))
        number = np.arange(count)
        cell = np.stack([number % side, number // side % side, number // side ** 2], axis=1)
        self.rotation = turned(0.7 * number)
        middles = gap * (cell - [0.5 * (side - 1), 0.5 * (side - 1), -1])
        self.translation = middles - self.rotation @ self.middle
        self.half, self.highest = 0.5 * gap * side, middles[:, 2].max()  # of the floor between the walls; of the middles
        self.boxes = self._boxes()

    def planes(self):
        """Points and normals of the floor and the walls, for engines that have planes."""
        walls = [((-sign * self.half * x, -sign * self.half * y, 0.0), (sign * x, sign * y, 0.0)) for sign in (-1.0, 1.0) for x, y in ((1.0, 0.0), (0.0, 1.0))]
        return [((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), *walls]

    def _boxes(self):
        outer, middle = self.half + THICKNESS, self.half + THICKNESS / 2
        boxes = [((0, 0, -THICKNESS / 2), (outer, outer, THICKNESS / 2))]
        for sign in (-1, 1):
            boxes.append(((sign * middle, 0, HEIGHT / 2), (THICKNESS / 2, outer, HEIGHT / 2)))
            boxes.append(((0, sign * middle, HEIGHT / 2), (self.half, THICKNESS / 2, HEIGHT / 2)))
        return boxes

    def middles(self, rotation, translation):
        """Where the middles of the bodies' boxes are."""
        return rotation @ self.middle + translation

    def lost(self, rotation, translation):
        """Which bodies have left the tray: their middles are in the floor or a wall, or beyond, or nowhere."""
        middle = self.middles(rotation, translation)
        with np.errstate(invalid="ignore"):
            return ~((np.abs(middle[:, :2]) < self.half).all(axis=1) & (middle[:, 2] > 0) & (middle[:, 2] < 2 * self.highest))


class Judge:
    """Writes scene files of a pile to a folder, and asks Tandem about them."""

    def __init__(self, pile, folder):
        self.pile, self.folder = pile, Path(folder)
        self.assets = [self._asset("body", pile.vertices, pile.triangles)]
        for i, (_, half) in enumerate(pile.boxes):
            self.assets.append(self._asset(f"box{i}", *solids.box(*half)))

    def _asset(self, name, vertices, triangles):
        mesh = self.folder / f"{name}.obj"
        mesh.write_text(obj_files.text(vertices, triangles))
        tools.run(tools.tool("bvhbuild"), mesh, "-o", mesh.with_suffix(".bvh"), "-q")
        return f"{name}.bvh"

    def write(self, path, states):
        """Writes states, each the rotations and translations of some bodies, as worlds of one scene, each with boxes. Returns the world of each instance."""
        boxes, centres = len(self.pile.boxes), np.array([centre for centre, _ in self.pile.boxes], float)
        world = np.repeat(np.arange(len(states)), [boxes + len(translation) for _, translation in states])
        with h5py.File(path, "w") as file:
            file["assets"] = self.assets
            file["instances/asset"] = np.concatenate([np.r_[1:boxes + 1, np.zeros(len(translation))] for _, translation in states]).astype("u4")
            file["instances/rotation"] = np.concatenate([part for rotation, _ in states for part in (np.tile(np.eye(3), (boxes, 1, 1)), rotation)])
            file["instances/translation"] = np.concatenate([part for _, translation in states for part in (centres, translation)])
            file["instances/world"] = world.astype("u4")
            file["simulation/motion"] = np.concatenate([np.r_[np.ones(boxes), np.zeros(len(translation))] for _, translation in states]).astype("u1")
        return world

    def depths(self, states):
        """The depths of all contact points of each state, metres; of bodies that have not left the tray."""
        kept = []
        for rotation, translation in states:
            stays = ~self.pile.lost(rotation, translation)
            kept.append((rotation[stays], translation[stays]))
        scene, contacts = self.folder / "states.h5", self.folder / "contacts.h5"
        world = self.write(scene, kept)
        tools.run(tools.tool("bvhbench"), "query", scene, "--manifolds", "--out", contacts)
        with h5py.File(contacts) as file:
            body = file["pairs"][:, 0][file["manifolds/pair"][:]]
            of_point = np.repeat(world[body], np.diff(file["manifolds/first"][:].astype("i8")))
            depth = file["points/depth"][:]
        return [depth[of_point == i] for i in range(len(states))]
