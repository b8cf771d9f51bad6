"""Engines of scripts/gpu_world_peers: each lets a Pile fall, with the step, substeps and iterations of its own examples; `settings` says which.

run(pile, device, seconds, folder) yields the seconds that it took until the first step was made, then Samples.
"""
import dataclasses
import os
import time

import h5py
import numpy as np

from common import obj_files, rotations, tools
from dynamics_engines import Engine
from gpu_world_pile import DENSITY, DT, FRICTION, GRAVITY, Judge

EVERY = 15  # steps of DT between two samples


@dataclasses.dataclass
class Sample:
    """Rotations and translations after a number of steps of DT and one step earlier, and the milliseconds of each step since the last sample."""
    steps: int
    before: tuple
    now: tuple
    milliseconds: list
    notes: str = ""


class Tandem(Engine):
    """bvhbench simulate. Times are those of whole steps, copies of the states to the CPU included."""
    settings, options = "60 Hz, 16 substeps", ()

    @classmethod
    def missing(cls):
        path = tools.tool("bvhbench")
        return "" if path.exists() else f"there is no {path}"

    @classmethod
    def version(cls):
        return tools.commit()

    @classmethod
    def run(cls, pile, device, seconds, folder):
        began, scene, output = time.perf_counter(), folder / "start.h5", folder / "run.h5"
        world = Judge(pile, folder).write(scene, [(pile.rotation, pile.translation)])
        bodies = len(world) - pile.count
        tools.run(tools.tool("bvhbench"), "simulate", "scene", scene, "--frames", round(seconds / DT), "--trajectory", 1, "--checkpoint", 1e6, "--gravity", GRAVITY,
                  "--friction", FRICTION, "--density", DENSITY, "--backend", device, *cls.options, "-o", output)
        with h5py.File(output) as file:
            spent = 1e3 * file["frames/seconds/step"][:]
            yield time.perf_counter() - began - spent.sum() / 1e3
            centre = file["bodies/centre_of_mass"][bodies:]

            def state(row):
                rotation = rotations.matrices(file["trajectory/orientation"][row, bodies:])
                return rotation, file["trajectory/position"][row, bodies:] - np.einsum("nij,nj->ni", rotation, centre)

            for steps in range(EVERY, len(spent) + 1, EVERY):
                yield Sample(steps, state(steps - 1), state(steps), spent[steps - EVERY:steps].tolist())


class SleepingTandem(Tandem):
    settings, options = f"{Tandem.settings}, sleeping", ("--sleep",)


class Stepped(Engine):
    """An engine whose object makes a step of DT by step(), waits for it by wait(), and says where bodies are by state()."""

    @classmethod
    def run(cls, pile, device, seconds, folder):
        began = time.perf_counter()
        world, milliseconds, before = cls(pile, device, folder), [], None
        for steps in range(1, round(seconds / DT) + 1):
            start = time.perf_counter()
            world.step()
            world.wait()
            milliseconds.append(1e3 * (time.perf_counter() - start))
            if steps == 1:
                yield time.perf_counter() - began
            if steps % EVERY == EVERY - 1:
                before = world.state()
            elif steps % EVERY == 0:
                yield Sample(steps, before, world.state(), milliseconds, world.notes())
                milliseconds = []

    def notes(self):
        """What went wrong, or ""."""
        return ""


class OnWarp(Stepped):
    """Where Warp has a GPU, a step is a graph, captured after the first; self.advance() makes one."""
    graph = None

    def __init__(self, device):
        import warp
        self.warp = warp
        warp.config.log_level = warp.LOG_WARNING
        warp.set_device("cuda:0" if device == "cuda" else "cpu")
        self.device = warp.get_device()

    def step(self):
        if self.graph:
            self.warp.capture_launch(self.graph)
            return
        self.advance()
        if self.device.is_cuda:
            with self.warp.ScopedCapture() as capture:
                self.advance()
            self.graph = capture.graph

    def wait(self):
        self.warp.synchronize_device(self.device)


class Newton(OnWarp):
    """Contacts of Newton's own pipeline; on a CPU, where it has no distance fields, of its trees of triangles."""
    module, gap, field = "newton", 0.1, {"max_resolution": 256}
    rounds, substeps = 2, 5  # of contacts in a step of DT, and of the solver for each

    def __init__(self, pile, device, folder):
        super().__init__(device)
        import newton
        warp, builder = self.warp, newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        shape = newton.ModelBuilder.ShapeConfig(density=DENSITY, mu=FRICTION, gap=self.gap)
        mesh = newton.Mesh(pile.vertices.astype("f4"), pile.triangles.astype("i4").ravel())
        if self.device.is_cuda:
            mesh.build_sdf(**self.field)
        for point, normal in pile.planes():
            builder.add_shape_plane(plane=(*normal, -float(np.dot(point, normal))), width=0.0, length=0.0, cfg=shape)
        for rotation, translation in zip(pile.rotation, pile.translation):
            turn = np.roll(rotations.quaternion(rotation), -1)
            builder.add_shape_mesh(builder.add_body(xform=warp.transform(translation, warp.quat(*turn))), mesh=mesh, cfg=shape)
        self.model = builder.finalize()
        self.room = 400 * pile.count + 1000
        self.model.rigid_contact_max = self.room
        self.pipeline = newton.CollisionPipeline(self.model, broad_phase="sap", rigid_contact_max=self.room)
        self.solver = self.solver_of(newton)
        self.states, self.control, self.contacts = [self.model.state(), self.model.state()], self.model.control(), self.pipeline.contacts()
        self.most = 0

    def advance(self):
        for _ in range(self.rounds):
            self.pipeline.collide(self.states[0], self.contacts)
            for _ in range(self.substeps):
                self.states[0].clear_forces()
                self.solver.step(self.states[0], self.states[1], self.control, self.contacts, DT / (self.rounds * self.substeps))
                self.states.reverse()

    def state(self):
        pose = self.states[0].body_q.numpy().astype("f8")
        return rotations.matrices(np.roll(pose[:, 3:], 1, axis=1)), pose[:, :3]

    def notes(self):
        self.most = max(self.most, int(self.contacts.rigid_contact_count.numpy()[0]))
        return f"{self.most} contacts of its own" if self.most <= self.room else f"{self.most} contacts of its own in room for {self.room}"


class NewtonXPBD(Newton):
    settings = "XPBD; contacts at 120 Hz, 5 substeps each, 10 iterations, relaxation 0.8 (its example nut_bolt_sdf); fields of 256 cells, gap 0.1 m"

    def solver_of(self, newton):
        return newton.solvers.SolverXPBD(self.model, iterations=10, rigid_contact_relaxation=0.8)


class NewtonMuJoCo(Newton):
    settings = "SolverMuJoCo with Newton's contacts; contacts at 60 Hz, 16 substeps, 15 iterations (its example brick_stacking); fields of 256 cells, gap 0.1 m"
    rounds, substeps = 1, 16

    def solver_of(self, newton):
        return newton.solvers.SolverMuJoCo(self.model, use_mujoco_contacts=False, solver="newton", integrator="implicitfast", cone="elliptic", iterations=15,
                                           ls_iterations=100, impratio=1.0, nconmax=self.room, njmax=self.room, njmax_nnz=12 * self.room)


def numbers(values):
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


class MuJoCoWarp(OnWarp):
    """Convex hulls of the bodies."""
    module = "mujoco_warp"
    settings = "convex hulls; steps of 1/480 s, Newton with at most 100 iterations (MuJoCo's defaults)"
    geom, contact, per_body = "mesh", "", 40

    def __init__(self, pile, device, folder):
        super().__init__(device)
        import mujoco
        import mujoco_warp
        self.mjw, model = mujoco_warp, mujoco.MjModel.from_xml_string(self.xml(pile))
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self.room = self.per_body * pile.count + 100
        self.model = mujoco_warp.put_model(model)
        self.data = mujoco_warp.make_data(model, nworld=1, nconmax=self.room, njmax=4 * self.room, njmax_nnz=4 * self.room * 12)
        self.bodies, self.most = slice(1, 1 + pile.count), 0

    def xml(self, pile):
        planes = "".join(f'<geom type="plane" pos="{numbers(point)}" zaxis="{numbers(normal)}" size="0 0 1"/>' for point, normal in pile.planes())
        bodies = "".join(f'<body pos="{numbers(translation)}" quat="{numbers(rotations.quaternion(rotation))}"><freejoint/><geom type="{self.geom}" mesh="body"/></body>'
                         for rotation, translation in zip(pile.rotation, pile.translation))
        return (f'<mujoco><size memory="4G"/><option timestep="{DT / 8:.17g}" gravity="0 0 {-GRAVITY}" sdf_iterations="10" sdf_initpoints="40"/>'
                f'<default><geom density="{DENSITY}" friction="{FRICTION}" {self.contact}/></default>'
                f'<asset><mesh name="body" inertia="exact" vertex="{numbers(pile.vertices)}" face="{" ".join(map(str, pile.triangles.ravel()))}"/></asset>'
                f'<worldbody>{planes}{bodies}</worldbody></mujoco>')

    def advance(self):
        for _ in range(8):
            self.mjw.step(self.model, self.data)

    def state(self):
        return self.data.xmat.numpy()[0, self.bodies].astype("f8").reshape(-1, 3, 3), self.data.xpos.numpy()[0, self.bodies].astype("f8")

    def notes(self):
        self.most = max(self.most, int(self.data.nacon.numpy()[0]))
        return f"{self.most} contacts of its own" if self.most <= self.room else f"{self.most} contacts of its own in room for {self.room}"


class MuJoCoWarpSDF(MuJoCoWarp):
    settings = "distance fields; steps of 1/480 s, Newton with at most 100 iterations, 40 points and 10 iterations a pair, solref 0.01 (its model cow.xml)"
    geom, contact, per_body = "sdf", 'solref="0.01 1" solimp=".95 .99 .0001"', 80


class Genesis(Stepped):
    module, settings = "genesis", "distance fields of the meshes (convexify=False); steps of 1/120 s, else its defaults: Newton with at most 25 iterations"

    @classmethod
    def version(cls):
        import importlib.metadata
        return importlib.metadata.version("genesis-world")

    def __init__(self, pile, device, folder):
        import genesis as gs
        import torch
        self.torch, mesh = torch, folder / "body.obj"
        mesh.write_text(obj_files.text(pile.vertices, pile.triangles))
        gs.init(backend=gs.gpu if device == "cuda" else gs.cpu, precision="32", logging_level="warning")
        self.scene = gs.Scene(sim_options=gs.options.SimOptions(dt=DT / 2, gravity=(0, 0, -GRAVITY)),
                              rigid_options=gs.options.RigidOptions(max_collision_pairs=20 * pile.count), show_viewer=False)
        material = gs.materials.Rigid(rho=DENSITY, friction=FRICTION)
        for point, normal in pile.planes():
            self.scene.add_entity(gs.morphs.Plane(pos=point, normal=normal), material=material)
        self.bodies = [self.scene.add_entity(gs.morphs.Mesh(file=os.fspath(mesh), pos=tuple(translation), quat=tuple(rotations.quaternion(rotation)), convexify=False,
                                                            decimate=False, watertighten=0, align=False), material=material)
                       for rotation, translation in zip(pile.rotation, pile.translation)]
        self.scene.build()
        self.rigid = self.scene.sim.rigid_solver
        self.links = [body.base_link_idx for body in self.bodies]

    def step(self):
        self.scene.step()
        self.scene.step()

    def wait(self):
        if self.torch.cuda.is_available():
            self.torch.cuda.synchronize()

    def state(self):
        place, turn = (get(self.links).cpu().numpy().astype("f8") for get in (self.rigid.get_links_pos, self.rigid.get_links_quat))
        return rotations.matrices(turn.reshape(-1, 4)), place.reshape(-1, 3)


ENGINES = {"tandem": Tandem, "tandem, sleeping": SleepingTandem, "newton, xpbd": NewtonXPBD, "mujoco warp": MuJoCoWarp, "mujoco warp, sdf": MuJoCoWarpSDF,
           "genesis": Genesis, "newton, mujoco": NewtonMuJoCo}
