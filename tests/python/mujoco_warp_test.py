"""tandem.mujoco_warp: contacts of many worlds are those that tandem.mujoco finds in each, beside MuJoCo Warp's own."""
import numpy as np
import pytest

import solids
import tandem

mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
mujoco_warp = pytest.importorskip("mujoco_warp", reason="needs the package mujoco_warp")
import warp as wp  # noqa: E402

import tandem.mujoco  # noqa: E402
import tandem.mujoco_warp  # noqa: E402
from mujoco_test import free, model_of  # noqa: E402

COLUMNS = ("dist", "pos", "frame", "includemargin", "friction", "solref", "solimp", "dim", "geom")


@pytest.fixture(autouse=True)
def on_the_cpu(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo keeps a log where it runs
    wp.config.log_level = wp.LOG_WARNING
    with wp.ScopedDevice("cpu"):
        yield


def made(model, worlds=1, **room):
    m, d = mujoco_warp.put_model(model), mujoco_warp.make_data(model, nworld=worlds, **({"nconmax": 64, "njmax": 256} | room))
    return m, d, tandem.mujoco_warp.MeshContacts(model, m, d)


def contacts_of(d, world):
    """The contacts of a world, by column, sorted by geoms and place."""
    count = int(d.nacon.numpy()[0])
    rows = {name: getattr(d.contact, name).numpy()[:count] for name in (*COLUMNS, "worldid")}
    order = np.flatnonzero(rows["worldid"] == world)
    order = order[np.lexsort((*rows["pos"][order].T, *rows["geom"][order].T))]
    return {name: rows[name][order] for name in COLUMNS}


def cups():
    """A cup and a ball on a floor, and a box; ball and box have parameters of their own as a <pair>."""
    return model_of("<geom type='plane' size='2 2 0.1'/>" + free("cup", "0 0 0") + free("ball", "0.01 0 0.4", geom="name='ball' friction='0.3' condim='4'")
                    + "<body pos='0.3 0 0.2'><freejoint/><geom name='box' type='box' size='0.1 0.1 0.1' priority='1' solref='0.01 1'/></body>",
                    extra="<contact><pair geom1='ball' geom2='box' condim='6' friction='0.1 0.2 0.3 0.4 0.5'/></contact>", cup=solids.cup(0.15, 0.18, 0.04, 0.25), ball=solids.ball(0.1))


def test_contacts_of_worlds_are_those_of_each():
    model = cups()
    worlds = 5
    m, d, contacts = made(model, worlds)
    random = np.random.default_rng(4)
    qpos = np.tile(model.qpos0, (worlds, 1))
    qpos[:, 7:10] = [[0.01, 0.02, 0.14], [0.1, 0, 0.2], [0, 0, 0.4], [-0.08, 0.05, 0.16], [0.02, 0, 0.135]]
    qpos[:, 14:17] = [[0.2, 0, 0.1], [0.12, 0, 0.3], [0, 0, 0.31], [0, 0.2, 0.1], [0.15, 0.1, 0.2]]
    for k in range(3):
        turns = random.normal(size=(worlds, 4))
        qpos[:, 7 * k + 3:7 * k + 7] = turns / np.linalg.norm(turns, axis=1)[:, None] if k != 1 else [1, 0, 0, 0]
    d.qpos.assign(qpos.astype("f4"))
    mujoco_warp.kinematics(m, d)
    mujoco_warp.collision(m, d)
    assert not contacts.is_on_gpu
    on_cpu = tandem.mujoco.MeshContacts(model)
    plane = int(mujoco.mjtGeom.mjGEOM_PLANE)
    total = 0
    for world in range(worlds):
        data = mujoco.MjData(model)
        data.geom_xpos[:], data.geom_xmat[:] = d.geom_xpos.numpy()[world], d.geom_xmat.numpy()[world].reshape(-1, 9)
        on_cpu.collide(data)
        theirs = contacts_of(d, world)
        # MuJoCo Warp drops what is at a distance of 0, which takes no part in constraints.
        of_meshes = (model.geom_type[data.contact.geom] != plane).all(axis=1) & (data.contact.dist.astype("f4") < 0)
        order = np.flatnonzero(of_meshes)
        order = order[np.lexsort((*data.contact.pos[order].astype("f4").T, *data.contact.geom[order].T))]
        ours = (model.geom_type[theirs["geom"]] != plane).all(axis=1)
        assert ours.sum() == len(order)
        total += len(order)
        for name in COLUMNS:
            expected = getattr(data.contact, name)[order]
            shown = theirs[name][ours].reshape(len(order), *expected.shape[1:])
            if name == "frame":  # the tangents may be turned about the normal
                expected, shown = expected[:, :3], shown[:, :3]
            np.testing.assert_allclose(shown, expected, rtol=1e-6, atol=1e-6, err_msg=name)
    assert total > 20


def test_ball_falls_into_the_cup():
    model = cups()
    m, d, _ = made(model, 2)
    for _ in range(500):
        mujoco_warp.step(m, d)
    np.testing.assert_allclose(d.xpos.numpy()[:, model.body("ball").id, 2], 0.14, atol=0.004)


def test_contacts_that_have_no_room_are_counted():
    model = cups()
    m, d, _ = made(model, 1, naconmax=3, nconmax=3)
    qpos = model.qpos0.copy()
    qpos[14:17] = 0.2, 0, 0.1  # the box is in the wall of the cup
    d.qpos.assign(qpos.astype("f4")[None])
    mujoco_warp.kinematics(m, d)
    mujoco_warp.collision(m, d)
    assert int(d.nacon.numpy()[0]) > d.naconmax


def test_what_cannot_be_taken_is_refused():
    for extra, message in ((free("ball", "0 0 0.4", geom="margin='0.01'"), "geom_margin"), (free("ball", "0 0 0.4", geom="gap='0.01'"), "geom_gap")):
        with pytest.raises(ValueError, match=message):
            made(model_of(free("cup", "0 0 0") + extra, cup=solids.cup(0.15, 0.18, 0.04, 0.25), ball=solids.ball(0.1)))
    with pytest.raises(ValueError, match="no mesh geom"):
        made(model_of("<geom type='plane' size='2 2 0.1'/>" + free("ball", "0 0 0.4"), ball=solids.ball(0.1)))
