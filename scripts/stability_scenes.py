"""Scenes of scripts/stability, and runs of `bvhbench simulate` on them."""
import functools
import json
from pathlib import Path

import h5py
import numpy as np

from common import tools
from stability_shapes import SHAPES, obj_of

BVHBENCH, BVHBUILD, BVHINFO, MAKEASSETS = (tools.tool(name) for name in ("bvhbench", "bvhbuild", "bvhinfo", "makeassets"))
SLOP = 5e-4  # metres, in every run of a scene
GRAVITY = 9.81
# Boxes by their lengths; all other meshes are SHAPES and files of assets/.
BOXES = {"slab": (300, 40, 2), "flat": (1, 1, 0.2), "uneven": (1, 0.6, 0.2), "thin": (1, 1, 0.01), "target": (2, 2, 0.01),
         "rod": (0.04, 0.04, 1), "plate": (0.5, 0.5, 0.02)}
KINEMATIC = 2  # what `fixed` is of a body that keeps its velocity
ROCK = 80_000  # triangles of the rough rock, which makeassets makes
NUDGE = 1e-6  # metres
LEVELS = "0.1%,0.3%,1%,3%"  # errors of its coarser levels, of its diagonal


def box_obj(lengths):
    """A closed box around the origin."""
    corners = [[(1 if i >> k & 1 else -1) * lengths[k] / 2 for k in range(3)] for i in range(8)]
    faces = [(1, 5, 7, 3), (2, 4, 8, 6), (1, 2, 6, 5), (3, 7, 8, 4), (1, 3, 4, 2), (5, 6, 8, 7)]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join("f " + " ".join(map(str, face)) + "\n" for face in faces)


# Rotations are not scipy's here: scipy rounds in another way, and bodies that tumble or lie in a heap show the last bit. With scipy's, 23 of the 36 rows of
# the cases `tumble` and `order` in docs/results/cpu/stability.csv get other values; with these the table comes out again in all digits but those of times.
def rotation_about(axis, angle):
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def random_rotation(random):
    w, x, y, z = (q := random.normal(size=4)) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


class Scene:
    """A scene to be written: names of meshes, and bodies with their poses."""

    def __init__(self):
        self.meshes, self.bodies = [], []

    def add(self, mesh, at, turned=np.eye(3), fixed=False, density=1000, velocity=(0, 0, 0), spin=(0, 0, 0), level=0):
        if mesh not in self.meshes:
            self.meshes.append(mesh)
        self.bodies.append((self.meshes.index(mesh), at, turned, fixed, density, velocity, spin, level))
        return self

    def at_level(self, level):
        """The same scene with its moving bodies at a level of detail."""
        scene = Scene()
        scene.meshes = self.meshes
        scene.bodies = [(*body[:7], 0 if body[3] else level) for body in self.bodies]
        return scene

    def moved_to(self, rotations, places):
        """The same scene with its bodies elsewhere, at rest."""
        scene = Scene()
        scene.meshes = self.meshes
        scene.bodies = [(body[0], place, turned, *body[3:5], (0, 0, 0), (0, 0, 0), body[7]) for body, turned, place in zip(self.bodies, rotations, places)]
        return scene

    def nudged(self):
        """The same scene with its moving bodies moved by NUDGE, each in some direction, at rest."""
        random = np.random.default_rng(1)
        steps = [step / np.linalg.norm(step) for step in random.normal(size=(len(self.bodies), 3))]
        return self.moved_to([body[2] for body in self.bodies], [np.asarray(body[1]) + (0 if body[3] else NUDGE) * step for body, step in zip(self.bodies, steps)])

    def tilted(self, angle):
        """The same scene, all turned about the y axis, at rest."""
        about = rotation_about((0, 1, 0), angle)
        return self.moved_to([about @ body[2] for body in self.bodies], [about @ body[1] for body in self.bodies])

    def slab(self, turned=np.eye(3)):
        """Fixed; its upper side goes through the origin."""
        return self.add("slab", turned @ [0, 0, -BOXES["slab"][2] / 2], turned, fixed=True)

    def write(self, path, mesh_file):
        assets, at, turned, fixed, density, velocity, spin, level = zip(*self.bodies)
        with h5py.File(path, "w") as file:
            file["assets"] = [str(mesh_file(mesh)) for mesh in self.meshes]
            file["instances/asset"] = np.array(assets, "u4")
            if any(level):
                file["instances/level"] = np.array(level, "u4")
            file["instances/rotation"] = np.array(turned, float)
            file["instances/translation"] = np.array(at, float)
            file["simulation/motion"] = np.array(fixed, "u4")
            file["simulation/density"] = np.array(density, float)
            file["simulation/velocity"] = np.array(velocity, float)
            file["simulation/angular_velocity"] = np.array(spin, float)


class Run:
    """What a run file holds."""

    def __init__(self, path, command):
        self.command = command
        with h5py.File(path) as file:
            self.options = json.loads(file.attrs["options"])
            self.bodies = len(file["bodies/asset"])
            self.moving = file["bodies/motion"][:] == 0
            self.mass, self.inertia, self.centre = (file[f"bodies/{name}"][:][self.moving] for name in ("mass", "inertia", "centre_of_mass"))
            self.frames = {}
            file["frames"].visititems(lambda name, item: self.frames.update({name: item[:]}) if isinstance(item, h5py.Dataset) else None)
            # [state kept, moving body, ...]
            self.position = file["trajectory/position"][:][:, self.moving]
            self.orientation = file["trajectory/orientation"][:][:, self.moving]
        self.dt = self.options["dt"]
        self.ms_per_step = 1e3 * np.median(self.frames["seconds/step"])

    def last(self, seconds):
        """A slice of the frames: the end of the run."""
        return slice(-max(1, round(seconds / self.dt)), None)

    def drift(self):
        """For each state kept, how far the body that went farthest is from its start."""
        return np.linalg.norm(self.position - self.position[0], axis=2).max(axis=1)

    def sideways(self):
        return np.linalg.norm((self.position - self.position[0])[..., :2], axis=2).max(axis=1)

    def rms_speed(self, seconds):
        """The speed at which all mass would have the kinetic energy, mean of squares over the end of the run: turning counts."""
        return np.sqrt(np.mean(2 * self.frames["kinetic_energy"][self.last(seconds)]) / self.mass.sum())

    def energy_gain(self, seconds):
        """The largest rise of mechanical energy above what it was before, in the end of the run: the height that it would lift all bodies, metres."""
        energy = (self.frames["kinetic_energy"] + self.frames["potential_energy"])[self.last(seconds)]
        return (energy - np.minimum.accumulate(energy)).max() / (self.mass.sum() * GRAVITY)

    def mean_of(self, name, seconds):
        return self.frames[name][self.last(seconds)].mean()


class Workshop:
    """Builds meshes and makes runs in a folder of its own, by one solver."""

    def __init__(self, folder, quick, solver="auto", seeds=range(1, 11), backend="cpu"):
        self.folder, self.quick, self.solver, self.seeds, self.on_gpu = Path(folder), quick, solver, seeds, backend == "cuda"

    @functools.cache
    def mesh(self, name):
        """The .bvh file of a mesh; of the rock, and of names that end in _levels, with LEVELS."""
        asset = name.removesuffix("_levels")
        source = tools.ROOT / f"assets/{asset}.obj"
        if name in BOXES:
            source = self.folder / f"{name}.obj"
            source.write_text(box_obj(BOXES[name]))
        if name in SHAPES:
            source = self.folder / f"{name}.obj"
            source.write_text(obj_of(*SHAPES[name]()))
        if name == "rock":
            source = self.folder / "rock.ply"
            tools.run(MAKEASSETS, "rock", "--triangles", ROCK, "-o", source)
        built = self.folder / f"{name}.bvh"
        tools.run(BVHBUILD, source, "-o", built, "-q", *(["--levels", LEVELS] if name == "rock" or name != asset else []))
        return built

    def levels(self, mesh):
        """What bvhinfo says of the levels of a mesh."""
        return tools.run_json(BVHINFO, self.mesh(mesh), "--json")["levels"]

    def settled(self, scene, seconds):
        """The scene as it is after a while, at rest."""
        run = self.simulate(scene, seconds)
        frame = self.folder / "settled.h5"
        tools.run(BVHBENCH, "frame", self.folder / "run.h5", "--frame", len(run.frames["time"]), "-o", frame)
        with h5py.File(frame) as file:
            return scene.moved_to(file["instances/rotation"][:], file["instances/translation"][:])

    def scene_file(self, scene):
        path = self.folder / "scene.h5"
        scene.write(path, self.mesh)
        return path

    def simulate(self, scene, seconds, every=None, **settings):
        """A run of a Scene, or of what ("stack", ...) says to simulate. Settings are options of bvhbench simulate; True is a flag, None is left out.
        `every`: seconds between states that are kept; unless given, the first and the last."""
        kind = ("scene", self.scene_file(scene), "--slop", SLOP) if isinstance(scene, Scene) else scene
        dt = settings.get("dt") or 1 / 60
        steps = max(1, round(seconds / dt))
        options = ["--solver", self.solver]
        for name, value in settings.items():
            if value is not None and value is not False:
                options += [f"--{name.replace('_', '-')}"] + ([] if value is True else [repr(value) if isinstance(value, float) else value])
        output = self.folder / "run.h5"
        keep = min(steps, max(1, round(every / dt))) if every else steps
        tools.run(BVHBENCH, "simulate", *kind, "--frames", steps, *(("--backend", "cuda") if self.on_gpu else ("--threads", 1)), "--trajectory", keep, *options, "-o", output)
        return Run(output, " ".join(map(str, options[2:])))
