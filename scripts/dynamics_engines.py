"""Physics engines of scripts/dynamics_peers: one class each, made of bodies and gravity, with step() and positions(). Each has its settings as its documentation
gives them, one thread, and bodies that stay awake; `settings` says what decides cost and accuracy. `stiff` is MuJoCo with the stiffest contacts that its step allows.
"""
import ctypes
import importlib.metadata
import importlib.util
from pathlib import Path

import numpy as np

from common import tools

DT, FRICTION = 1 / 60, 0.5


class Engine:
    settings, most_bodies = "", 100_000

    @classmethod
    def missing(cls):
        """Why this Python cannot run it, or ""."""
        return "" if importlib.util.find_spec(cls.module) else f"this Python has no module {cls.module}"

    @classmethod
    def version(cls):
        return importlib.metadata.version(cls.module)


class Tandem(Engine):
    """World of the Python package; every body is a mesh, a box has 12 triangles."""
    module, settings = "tandem", "16 substeps"

    def __init__(self, bodies, gravity):
        import tandem
        shapes = list(dict.fromkeys(body.shape for body in bodies))
        self.moving = np.array([body.density > 0 for body in bodies])
        self.world = tandem.World(
            [tandem.build(shape.points, shape.triangles) for shape in shapes], asset=[shapes.index(body.shape) for body in bodies],
            rotation=tandem.rotations(wxyz=[body.turn for body in bodies]), translation=[body.at for body in bodies], density=[body.density or 1 for body in bodies],
            velocity=[body.velocity for body in bodies], angular_velocity=[body.spin for body in bodies], gravity=(0, 0, -gravity), friction=FRICTION, sleeping=False,
            filter=tandem.Filter(motion=[tandem.MOVING if moves else tandem.FIXED for moves in self.moving]))

    @classmethod
    def version(cls):
        return tools.commit()

    def step(self):
        self.world.step(DT)

    def positions(self):
        return self.world.translation[self.moving]


class MuJoCo(Engine):
    module, settings, contact = "mujoco", "at most 100 iterations of Newton", ""

    def __init__(self, bodies, gravity):
        import mujoco
        self.mujoco = mujoco
        self.model = mujoco.MjModel.from_xml_string(self.xml(bodies, gravity))
        self.data = mujoco.MjData(self.model)
        for i, body in enumerate(body for body in bodies if body.density):
            self.data.qvel[6 * i:6 * i + 6] = [*body.velocity, *body.spin]
        self.moving = [i + 1 for i, body in enumerate(bodies) if body.density]
        mujoco.mj_forward(self.model, self.data)  # or there are no positions yet

    def xml(self, bodies, gravity):
        def text(values):
            return " ".join(f"{value:.17g}" for value in np.ravel(values))

        meshes = {body.shape: f"mesh{i}" for i, body in enumerate(bodies) if body.shape.lengths is None}
        assets = [f'<mesh name="{name}" vertex="{text(shape.points)}"/>' for shape, name in meshes.items()]
        parts = []
        for body in bodies:
            geometry = f'type="mesh" mesh="{meshes[body.shape]}"' if body.shape in meshes else f'type="box" size="{text(0.5 * np.array(body.shape.lengths))}"'
            joint = "<freejoint/>" if body.density else ""
            parts.append(f'<body pos="{text(body.at)}" quat="{text(body.turn)}">{joint}<geom {geometry} density="{body.density or 1000:.17g}" friction="{FRICTION} 0 0" '
                         f'condim="3" {self.contact}/></body>')
        return (f'<mujoco><size memory="2G"/><option timestep="{DT:.17g}" gravity="0 0 {-gravity}"/><asset>{"".join(assets)}</asset>'
                f'<worldbody>{"".join(parts)}</worldbody></mujoco>')

    def step(self):
        self.mujoco.mj_step(self.model, self.data)

    def positions(self):
        return self.data.xpos[self.moving].copy()


class StiffMuJoCo(MuJoCo):
    """solref: the shortest time constant that a step of 1/60 s takes; solimp: impedance as near to 1 as it goes."""
    settings = f"{MuJoCo.settings}; solref 1/30, solimp 0.9999"
    contact = f'solref="{2 * DT:.17g} 1" solimp="0.9999 0.9999 0.001 0.5 2"'


class PyBullet(Engine):
    """The first step of a group of n touching bodies takes time that grows with n^2: 7 s of 820 cubes, more than five minutes of 5,050."""
    module, settings, most_bodies = "pybullet", "50 iterations; no damping", 1000

    def __init__(self, bodies, gravity):
        import pybullet
        self.bullet = pybullet
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.setTimeStep(DT)
        pybullet.setGravity(0, 0, -gravity)
        self.moving, shapes = [], {}
        for body in bodies:
            if body.shape not in shapes:
                shapes[body.shape] = (pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=body.shape.points.tolist()) if body.shape.lengths is None else
                                      pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5 * length for length in body.shape.lengths]))
            made = pybullet.createMultiBody(body.mass, shapes[body.shape], basePosition=list(body.at), baseOrientation=[*body.turn[1:], body.turn[0]])
            pybullet.changeDynamics(made, -1, lateralFriction=FRICTION, linearDamping=0, angularDamping=0)
            pybullet.resetBaseVelocity(made, list(body.velocity), list(body.spin))
            if body.density:
                self.moving.append(made)

    def step(self):
        self.bullet.stepSimulation()

    def positions(self):
        return np.array([self.bullet.getBasePositionAndOrientation(body)[0] for body in self.moving])

    def __del__(self):
        self.bullet.disconnect(self.client)


class PeerBody(ctypes.Structure):
    """As peer.h has it."""
    _fields_ = [("position", ctypes.c_double * 3), ("quaternion", ctypes.c_double * 4), ("velocity", ctypes.c_double * 3), ("angular_velocity", ctypes.c_double * 3),
                ("half", ctypes.c_double * 3), ("density", ctypes.c_double), ("friction", ctypes.c_double), ("points", ctypes.POINTER(ctypes.c_double)),
                ("point_count", ctypes.c_long)]


def library(path):
    """The class of an engine that scripts/peers/ made a library of."""
    peer = ctypes.CDLL(str(Path(path).absolute()))
    peer.peer_version.restype = peer.peer_settings.restype = ctypes.c_char_p
    peer.peer_create.argtypes = [ctypes.c_double, ctypes.POINTER(PeerBody), ctypes.c_long]
    peer.peer_step.argtypes = [ctypes.c_double]
    peer.peer_positions.argtypes = [ctypes.c_void_p]

    class Library(Engine):
        settings = peer.peer_settings().decode()

        def __init__(self, bodies, gravity):
            self.moving = np.array([body.density > 0 for body in bodies])
            points = {body.shape: np.ascontiguousarray(body.shape.points) for body in bodies}
            rows = (PeerBody * len(bodies))()
            for row, body in zip(rows, bodies):
                row.position[:], row.quaternion[:] = body.at, [*body.turn[1:], body.turn[0]]
                row.velocity[:], row.angular_velocity[:] = body.velocity, body.spin
                row.half[:] = [0.5 * length for length in body.shape.lengths or (0, 0, 0)]
                row.density, row.friction = body.density, FRICTION
                row.points, row.point_count = points[body.shape].ctypes.data_as(ctypes.POINTER(ctypes.c_double)), len(body.shape.points)
            peer.peer_create(gravity, rows, len(rows))

        @classmethod
        def missing(cls):
            return ""

        @classmethod
        def version(cls):
            return peer.peer_version().decode()

        def step(self):
            peer.peer_step(DT)

        def positions(self):
            found = np.empty((len(self.moving), 3))
            peer.peer_positions(found.ctypes.data)
            return found[self.moving]

    return Library


ENGINES = {"tandem": Tandem, "mujoco": MuJoCo, "mujoco, stiff": StiffMuJoCo, "pybullet": PyBullet}
