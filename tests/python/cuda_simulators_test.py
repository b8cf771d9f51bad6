"""tandem.newton and tandem.mujoco_warp on a GPU: nothing goes through the CPU, contacts are those of the way through the CPU, and a graph replays them."""
import sys

import numpy as np
import pytest

import solids
import tandem

wp = pytest.importorskip("warp", reason="needs the package warp-lang")
pytest.importorskip("tandem.cuda", exc_type=ImportError)
if not wp.is_cuda_available():
    pytest.skip("needs a GPU", allow_module_level=True)


@pytest.fixture(autouse=True)
def on_the_gpu(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo keeps a log where it runs
    wp.config.log_level = wp.LOG_WARNING
    with wp.ScopedDevice("cuda:0"):
        yield


def through_the_cpu(monkeypatch, make):
    """What a door makes where there is no tandem.cuda."""
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "tandem.cuda", None)
        patch.delattr(tandem, "cuda", raising=False)
        return make()


def as_rows(columns):
    """Rows of numbers, sorted."""
    table = np.concatenate([np.asarray(column, float).reshape(len(column), -1) for column in columns], axis=1)
    return table[np.lexsort(table.T[::-1])]


def turns(random, count):
    made = random.normal(size=(count, 4))
    return made / np.linalg.norm(made, axis=1)[:, None]


class Newton:
    """Balls, rings and a fixed box in each world, at random places, and a box that is in all worlds."""

    def __init__(self, worlds):
        self.newton = pytest.importorskip("newton", reason="needs the package newton")
        import tandem.newton
        self.door = tandem.newton
        world, builder = self.newton.ModelBuilder(), self.newton.ModelBuilder()
        for solid in [solids.ball(0.1)] * 3 + [solids.ring(0.06, 0.1, 0.03)] * 3:
            world.add_shape_mesh(world.add_body(), mesh=self.mesh(solid))
        world.add_shape_mesh(-1, mesh=self.mesh(solids.box(0.3, 0.3, 0.02)))
        builder.add_shape_mesh(-1, xform=wp.transform((0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)), mesh=self.mesh(solids.box(0.3, 0.3, 0.02)))
        for _ in range(worlds):
            builder.add_world(world)
        self.model = builder.finalize(device="cuda:0")
        self.state = self.model.state()

    def mesh(self, solid):
        return self.newton.Mesh(solid[0].astype("f4"), solid[1].astype("i4").ravel())

    def shake(self, seed):
        random, count = np.random.default_rng(seed), self.model.body_count
        self.state.body_q.assign(np.concatenate([random.uniform((-0.2, -0.2, 0), (0.2, 0.2, 0.3), (count, 3)), turns(random, count)], axis=1).astype("f4"))

    def rows(self, contacts):
        count = int(contacts.rigid_contact_count.numpy()[0])
        names = [f"{name}{side}" for name in ("shape", "point", "offset", "margin") for side in (0, 1)] + ["normal"]
        return as_rows([getattr(contacts, f"rigid_contact_{name}").numpy()[:count] for name in names])


@pytest.mark.parametrize("worlds", (1, 300))
def test_newtons_contacts_are_those_through_the_cpu(monkeypatch, worlds):
    scene = Newton(worlds)
    most = 400 * worlds
    ours = scene.door.CollisionPipeline(scene.model, rigid_contact_max=most)
    theirs = through_the_cpu(monkeypatch, lambda: scene.door.CollisionPipeline(scene.model, rigid_contact_max=most))
    assert ours.is_on_gpu and not theirs.is_on_gpu
    a, b = ours.contacts(), theirs.contacts()
    for seed in range(4):
        scene.shake(seed)
        count = ours.collide(scene.state, a)
        assert count == theirs.collide(scene.state, b) > 5 * worlds
        assert np.array_equal(scene.rows(a), scene.rows(b))


def test_newtons_contacts_in_a_graph():
    scene = Newton(50)
    pipeline = scene.door.CollisionPipeline(scene.model, rigid_contact_max=40000)
    contacts, expected = pipeline.contacts(), pipeline.contacts()
    scene.shake(0)
    pipeline.collide(scene.state, contacts)
    with wp.ScopedCapture() as capture:
        assert pipeline.collide(scene.state, contacts) is None
    for seed in range(3):
        scene.shake(seed)
        wp.capture_launch(capture.graph)
        pipeline.check()
        pipeline.collide(scene.state, expected)
        assert np.array_equal(scene.rows(contacts), scene.rows(expected)) and len(scene.rows(contacts)) > 200
    poses = scene.state.body_q.numpy()
    poses[:, :3] *= 0.01  # all bodies of a world in a heap: more than there is room for
    scene.state.body_q.assign(poses)
    wp.capture_launch(capture.graph)
    with pytest.raises(tandem.cuda.TooLittleRoom):
        pipeline.check()
    poses[3, 0] = np.nan
    scene.state.body_q.assign(poses)
    wp.capture_launch(capture.graph)
    with pytest.raises(tandem.Error):
        pipeline.check()


class MujocoWarp:
    """A floor, a cup, a ball and a box in each world."""

    COLUMNS = ("worldid", "geom", "dist", "pos", "frame", "includemargin", "friction", "solref", "solimp", "dim")

    def __init__(self, worlds):
        mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
        self.mjw = pytest.importorskip("mujoco_warp", reason="needs the package mujoco_warp")
        import tandem.mujoco_warp
        from mujoco_warp_test import cups
        self.door, self.model = tandem.mujoco_warp, cups()
        self.plane = int(mujoco.mjtGeom.mjGEOM_PLANE)
        self.worlds = worlds

    def made(self):
        m = self.mjw.put_model(self.model)
        d = self.mjw.make_data(self.model, nworld=self.worlds, nconmax=96, njmax=400)
        return m, d, self.door.MeshContacts(self.model, m, d)

    def shake(self, m, d, seed):
        random = np.random.default_rng(seed)
        qpos = np.tile(self.model.qpos0, (self.worlds, 1))
        qpos[:, 7:10] = random.uniform((-0.1, -0.1, 0.1), (0.1, 0.1, 0.25), (self.worlds, 3))
        qpos[:, 14:17] = random.uniform((-0.25, -0.25, 0.1), (0.25, 0.25, 0.3), (self.worlds, 3))
        qpos[:, 10:14], qpos[:, 17:21] = turns(random, self.worlds), turns(random, self.worlds)
        d.qpos.assign(qpos.astype("f4"))
        self.mjw.kinematics(m, d)

    def rows(self, d):
        """Those of two geoms of which none is a plane, which are Tandem's."""
        count = int(d.nacon.numpy()[0])
        assert count <= d.naconmax
        geom = d.contact.geom.numpy()[:count]
        ours = (self.model.geom_type[geom] != self.plane).all(axis=1)
        return as_rows([getattr(d.contact, name).numpy()[:count][ours] for name in self.COLUMNS])


@pytest.mark.parametrize("worlds", (1, 300))
def test_mujoco_warps_contacts_are_those_through_the_cpu(monkeypatch, worlds):
    scene = MujocoWarp(worlds)
    ours, theirs = scene.made(), through_the_cpu(monkeypatch, scene.made)
    assert ours[2].is_on_gpu and not theirs[2].is_on_gpu
    total = 0
    for seed in range(4):
        for m, d, _ in (ours, theirs):
            scene.shake(m, d, seed)
            scene.mjw.collision(m, d)
        assert np.array_equal(scene.rows(ours[1]), scene.rows(theirs[1]))
        total += len(scene.rows(ours[1]))
    assert total > 4 * worlds


def test_steps_of_mujoco_warp_in_a_graph():
    scene = MujocoWarp(64)
    m, d, contacts = scene.made()
    scene.mjw.step(m, d)
    with wp.ScopedCapture() as capture:
        scene.mjw.step(m, d)
    for _ in range(500):
        wp.capture_launch(capture.graph)
    contacts.check()
    np.testing.assert_allclose(d.xpos.numpy()[:, scene.model.body("ball").id, 2], 0.14, atol=0.004)  # on the bottom of the cup
