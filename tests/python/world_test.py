"""Worlds: bodies come to rest, what is asked of them, wrong calls, threads and Ctrl-C."""
import itertools
import os
from pathlib import Path

import numpy as np
import pytest

import solids
import tandem
import worlds
from meshes import needs_alarm

ASSETS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "assets"
HALF = 0.5
BOX = tandem.build(*solids.box(HALF, HALF, HALF))
FLOOR = tandem.build(*solids.box(10, 10, HALF))
FIRST_FIXED = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])


def pair(height=1.0, **options):
    """A box so high above a fixed one."""
    return tandem.World([BOX], translation=[[0, 0, 0], [0.2, 0.1, height]], filter=FIRST_FIXED, **options)


def pile(count=100, threads=1, asset=BOX, spacing=1.2, size=5):
    """Turned bodies above a floor."""
    places = np.array(list(itertools.islice(itertools.product(range(count), range(size), range(size)), count)))[:, ::-1]
    places = spacing * (places - [(size - 1) / 2, (size - 1) / 2, -1])
    turns = tandem.rotations(xyzw=np.random.default_rng(2).normal(size=(count, 4)))
    return tandem.World([FLOOR, asset], asset=[0] + count * [1], translation=[[0, 0, -HALF], *places], rotation=[np.eye(3), *turns],
                        filter=tandem.Filter(motion=[tandem.FIXED] + count * [tandem.MOVING]), threads=threads)


def states(world):
    return world.bodies.tobytes() + world.contacts.tobytes()


def test_a_pile_comes_to_rest():
    world = pile()
    while not world.sleeping[1:].all() and world.time < 20:
        world.step(1 / 60, 30)
    assert world.sleeping[1:].all() and (world.velocity == 0).all() and (world.angular_velocity == 0).all()
    assert world.rotation.shape == (101, 3, 3) and world.translation.shape == (101, 3) and not world.sleeping[0]
    assert world.translation[1:, 2].min() > HALF - 0.01
    # At rest they overlap by little, as the scene says, which takes the same bodies.
    depth = tandem.Scene([FLOOR, BOX], world.instances).manifolds().manifolds["depth"]
    assert len(depth) >= 100 and depth.max() < 0.01


def test_cows_come_to_rest():
    mesh = tandem.read_mesh(ASSETS / "cow_1500.obj")
    world = pile(12, asset=tandem.build(mesh.vertices, mesh.triangles), size=2)
    while not world.sleeping[1:].all() and world.time < 20:
        world.step(1 / 60, 30)
    assert world.sleeping[1:].all() and world.translation[1:, 2].max() < 4


def test_masses_and_contacts():
    world = pair(density=[1, 500])
    assert world.mass.round(6).tolist() == [0, 500]
    world.step(1 / 60, 5)
    contacts = world.contacts
    assert contacts.dtype == tandem.WORLD_CONTACT and (contacts["a"] == 0).all() and (contacts["b"] == 1).all() and len(contacts) >= 3
    assert np.allclose(contacts["normal"], [0, 0, 1], atol=1e-2)
    assert np.allclose(contacts["impulse"].sum(axis=0) * 60, [0, 0, 500 * 9.81], atol=5)
    assert world.time == pytest.approx(5 / 60)
    sheet = tandem.build([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    assert tandem.World([sheet], translation=np.zeros(3), density=100).mass == pytest.approx([100 * 0.01 * 2 ** 0.5])


def test_options():
    thrown = tandem.World([BOX], translation=np.zeros(3), velocity=[1, 0, 0], angular_velocity=[[0, 0, 2]], gravity=np.zeros(3))
    thrown.step(0.01, 100)
    assert np.allclose(thrown.translation, [[1, 0, 0]]) and np.allclose(thrown.angular_velocity, [[0, 0, 2]])
    assert np.allclose(thrown.rotation[0], [[np.cos(2), -np.sin(2), 0], [np.sin(2), np.cos(2), 0], [0, 0, 1]], atol=1e-3)
    for friction, slides in ((0, True), (0.9, False)):
        world = pair(friction=friction, gravity=[1, 0, -9.81], sleeping=False)
        world.step(1 / 60, 30)
        assert (world.translation[1, 0] > 0.25) == slides
    bouncing = pair(1.5, restitution=0.9, slop=0.0, rolling_resistance=0.0, substeps=8)
    bouncing.step(1 / 240, 130)
    assert bouncing.velocity[1, 2] > 1 or bouncing.translation[1, 2] > 1.05
    assert not pair(sleeping=False).sleeping.any()
    bullet = pair(1000, velocity=[[0, 0, 0], [0, 0, -900]], continuous=True, gravity=[0, 0, 0])
    bullet.step(1 / 10, 20)
    assert bullet.translation[1, 2] > 0.9


def test_bodies_are_pushed_and_moved():
    world = pair()
    world.step(1 / 60, 60)
    assert world.sleeping[1]
    world.push(1, [1000, 0, 0])
    assert world.velocity[1].round(6).tolist() == [1, 0, 0] and (world.angular_velocity[1] == 0).all() and not world.sleeping[1]
    world.push(1, [-1000, 0, 0], at=world.translation[1] + [0, 0, HALF])
    assert world.velocity[1].round(6).tolist() == [0, 0, 0] and world.angular_velocity[1].round(6).tolist() == [0, -3, 0]
    world.push(0, [1e6, 0, 0])
    assert (world.velocity[0] == 0).all()
    world.move(1, translation=[0, 0, 3])
    assert world.translation[1].tolist() == [0, 0, 3] and world.angular_velocity[1].round(6).tolist() == [0, -3, 0]
    world.move(1, velocity=[0, 0, 0], angular_velocity=[0, 0, 0])
    world.step(1 / 60, 120)
    assert np.allclose(world.translation[1], [0, 0, 1], atol=1e-3)
    belt = tandem.World([BOX], translation=np.zeros((1, 3)), velocity=[0, 1, 0], filter=tandem.Filter(motion=[tandem.KINEMATIC]))
    belt.step(0.1, 10)
    assert np.allclose(belt.translation, [[0, 1, 0]])


def test_materials_of_bodies():
    for frictions, slides in (([0.2, 0.8], False), ([0.2, 0.6], True), ([0.2, -1], True), (0.4, False)):
        world = pair(friction=frictions, gravity=[0.9 * 0.4 * 9.81, 0, -9.81])
        world.step(1 / 60, 60)
        assert (world.velocity[1, 0] > 0.1) == slides, frictions
    for restitutions in ([-1, 0.9], [0.9, 0], 0.9):
        world = pair(1.5, restitution=restitutions, rolling_resistance=[0.01, -1])
        world.step(1 / 60, 20)
        assert world.velocity[1, 2] > 2
    floats = pair(3, gravity_scale=[1, 0])
    floats.step(1 / 60, 60)
    assert floats.translation[1, 2] == 3
    floats.place(translation=[0, 0, 3], gravity_scale=0.5, friction=-1, restitution=0.5, rolling_resistance=0)
    floats.step(1 / 60, 60)
    assert floats.translation[0, 2] == pytest.approx(3 - 0.25 * 9.81)


def test_forces_last_and_are_kept():
    world = pair(friction=0.4)
    world.step(1 / 60, 60)
    assert world.sleeping[1]
    world.set_force(1, [3000, 0, 0])
    world.step(1 / 60, 60)
    assert world.sleeping[1] and world.translation[1, 0] == pytest.approx(0.2, abs=1e-3)
    world.set_force(1, [5000, 0, 0])
    assert not world.sleeping[1]
    kept = world.save()
    world.step(1 / 60, 30)
    then = states(world)
    assert world.velocity[1, 0] == pytest.approx((5 - 0.4 * 9.81) / 2, rel=0.01)
    world.set_force(1)
    world.restore(kept)
    world.step(1 / 60, 30)
    assert states(world) == then
    world = tandem.World([BOX], translation=np.zeros(3), gravity=np.zeros(3))
    world.set_force(0, torque=[0, 0, 1000 / 6])
    world.step(1 / 60, 60)
    assert np.allclose(world.angular_velocity, [[0, 0, 1]])


def pairs_of(touches):
    return touches[["a", "b"]].tolist()


def test_what_touches_is_told():
    world, ones = pair(1.3, restitution=[0, 0.8], sleeping=False), pair(1.3, restitution=[0, 0.8], sleeping=False)
    kept = world.save()
    began, ended, hardest = [], [], []
    for _ in range(60):
        ones.step(1 / 60)
        began += pairs_of(ones.began)
        hardest += ones.touching["impulse"].tolist()
        ended += ones.ended.tolist()
    assert began.count((0, 1)) >= 2 and ended.count((0, 1)) >= 1
    world.step(1 / 60, 60)
    assert world.touching.dtype == world.began.dtype == tandem.WORLD_TOUCH and world.ended.dtype == tandem.PAIR
    assert pairs_of(world.began) == world.ended.tolist() == [(0, 1)]
    assert world.touching.tolist() == ones.touching.tolist()
    assert world.began["impulse"][0] == max(hardest) == pytest.approx(1000 * 1.8 * (2 * 9.81 * 0.3) ** 0.5, rel=0.05)
    assert world.began["speed"][0] == pytest.approx((2 * 9.81 * 0.3) ** 0.5, abs=9.81 / 60)
    assert np.allclose(world.began["position"], [0.1, 0.05, 0.5], atol=0.5)
    world.step(1 / 60, 0)
    assert len(world.began) == len(world.ended) == 0
    world.step(1 / 60, 60)
    world.restore(kept)
    assert len(world.touching) == len(world.began) == len(world.ended) == 0


def test_joints_hold_and_motors_turn():
    worlds.expect_that_joints_hold_and_motors_turn(BOX, "cpu", within=1e-6)


def test_joints_come_go_and_break():
    worlds.expect_that_joints_come_go_and_break(BOX, "cpu", within=1e-6)


def test_materials_and_gravity_change():
    world = pair(friction=0.5, gravity=[0.3 * 9.81, 0, -9.81])
    world.step(1 / 60, 60)
    kept = world.save()
    for body in (0, 1):
        assert world.sleeping[1]
        world.set_material(body, friction=0.02)
        world.step(1 / 60, 30)
        assert world.velocity[1, 0] == pytest.approx(0.5 * (0.3 - 0.1) * 9.81, rel=0.02)
        world.restore(kept)
    world.set_gravity_scale(1, -1)
    world.step(1 / 60, 30)
    assert world.velocity[1, 2] == pytest.approx(0.5 * 9.81)
    world.restore(kept)
    world.set_material(1, friction=0.1)
    world.set_material(1)
    world.step(1 / 60, 60)
    assert world.sleeping[1]


def test_a_fixed_body_that_moves_wakes_what_lies_on_it():
    world = pair()
    world.step(1 / 60, 60)
    world.move(0, translation=[0, 0, -1], velocity=[1, 0, 0])
    assert not world.sleeping[1] and (world.velocity[0] == 0).all()
    world.step(1 / 60, 60)
    assert world.translation[1, 2] == pytest.approx(0, abs=1e-3)


def test_filters_and_no_bodies():
    world = tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.SLEEPING], excluded=[[1, 0]]))
    world.step(1 / 60, 30)
    assert world.translation[1, 2] < 0.5 and len(world.contacts) == 0
    world = tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING], group=[1, 2], mask=[1, 1]))
    world.step(1 / 60, 30)
    assert world.translation[1, 2] < 0.5
    assert world.place(translation=np.zeros(3)).translation.tolist() == [[0, 0, 0]] and world.time == 0
    empty = tandem.World([])
    empty.step(0.1, 10)
    assert empty.rotation.shape == (0, 3, 3) and len(empty.contacts) == len(empty.instances) == len(empty.mass) == 0


def test_results_do_not_depend_on_threads_or_calls():
    one, two, several = pile(40), pile(40, threads=2), pile(40)
    one.step(1 / 60, 45)
    two.step(1 / 60, 45)
    for _ in range(45):
        several.step(1 / 60)
    assert states(one) == states(two) == states(several)


def test_a_restored_world_goes_on_alike():
    world = pile(30)
    world.step(1 / 60, 30)
    kept = world.save()
    world.step(1 / 60, 30)
    then = states(world)
    for _ in range(2):
        world.restore(kept)
        assert world.time == pytest.approx(0.5) and len(world.contacts) == 0
        world.step(1 / 60, 30)
        assert states(world) == then
    for other in (pair(), world.place(world.instances)):
        with pytest.raises(tandem.Error, match="is kept is of other") as caught:
            other.restore(kept)
        assert caught.value.name == "KeptMismatch"


@pytest.mark.parametrize("call, error, words", [
    (lambda w: tandem.World(BOX), TypeError, "assets is one asset"),
    (lambda w: tandem.World([BOX], speed=1), TypeError, "speed"),
    (lambda w: tandem.World([BOX], filter=FIRST_FIXED), TypeError, "instances is missing"),
    (lambda w: tandem.World([BOX], gravity=9.81), ValueError, r"gravity has shape \(\)"),
    (lambda w: tandem.World([BOX], gravity=[0, 0, np.nan]), ValueError, "gravity is"),
    (lambda w: tandem.World([BOX], friction=-1), ValueError, "friction is -1"),
    (lambda w: tandem.World([BOX], restitution=1.5), ValueError, "restitution is 1.5 where 0 to 1.0"),
    (lambda w: tandem.World([BOX], slop=np.nan), ValueError, "slop is nan"),
    (lambda w: tandem.World([BOX], rolling_resistance="x"), TypeError, "rolling_resistance is str"),
    (lambda w: tandem.World([BOX], substeps=0), ValueError, "substeps is 0"),
    (lambda w: tandem.World([BOX], sleeping=1), TypeError, "sleeping is int"),
    (lambda w: tandem.World([BOX], continuous=None), TypeError, "continuous is NoneType"),
    (lambda w: tandem.World([BOX], threads=1025), ValueError, "threads is 1025"),
    (lambda w: w.place(asset=[0, 1]), tandem.Error, "instance 1: .*asset"),
    (lambda w: w.place(rotation=2 * np.eye(3)), tandem.Error, "instance 0: .*scales by 2"),
    (lambda w: w.place(translation=np.zeros((2, 3)), density=[1, 0]), tandem.Error, "instance 1: .*density"),
    (lambda w: w.place(translation=np.zeros((2, 3)), density=[1, 1, 1]), ValueError, "density has 3 rows where there are 2 bodies"),
    (lambda w: w.place(translation=np.zeros(3), velocity=[0, 0, np.inf]), tandem.Error, "instance 0: .*not finite"),
    (lambda w: w.place(translation=np.zeros(3), velocity=[0, 0]), ValueError, "velocity has shape"),
    (lambda w: w.place(translation=np.zeros(3), filter=FIRST_FIXED), tandem.Error, "filter"),
    (lambda w: w.place(translation=np.zeros(3), filter=tandem.Filter(excluded=[[0, 5]])), tandem.Error, "pair 0"),
    (lambda w: w.place(translation=np.zeros(3), filter="fixed"), TypeError, "filter is str"),
    (lambda w: tandem.World([BOX, tandem.build(*solids.box(1, 1, 1), topology=False)], asset=[0, 1]), tandem.Error, "asset 1"),
    (lambda w: w.place(translation=np.zeros((2, 3)), friction=[1, np.nan]), ValueError, "friction of body 1 is nan"),
    (lambda w: tandem.World([BOX], translation=np.zeros(3), restitution=[1.5]), ValueError, "restitution of body 0 is 1.5 where at most 1"),
    (lambda w: tandem.World([BOX], translation=np.zeros(3), friction=[1, 2]), ValueError, "friction has 2 rows where there are 1 bodies"),
    (lambda w: tandem.World([BOX], rolling_resistance=[1]), TypeError, "instances is missing"),
    (lambda w: w.place(translation=np.zeros(3), gravity_scale=np.inf), tandem.Error, "instance 0: .*not finite"),
    (lambda w: w.place(translation=[[0, 0, 0], [0, np.nan, 0]]), tandem.Error, "instance 1: .*translation is not finite"),
    (lambda w: w.place(translation=np.zeros(3), rotation=np.full((3, 3), np.inf)), tandem.Error, "instance 0: .*rotation is not finite"),
    (lambda w: w.place(translation=np.zeros(3), density=np.nan), tandem.Error, "instance 0: .*density"),
    (lambda w: w.place(translation=np.zeros(3), density=1e300), tandem.Error, "instance 0: .*too large"),
    (lambda w: w.place(translation=np.zeros(3), angular_velocity=[np.nan, 0, 0]), tandem.Error, "instance 0: .*not finite"),
    (lambda w: w.place(translation=np.zeros(3), angular_velocity=[1e11, 0, 0]), tandem.Error, "instance 0: .*too large"),
    (lambda w: w.set_force(1, [1e300, 0, 0]), tandem.Error, "instance 1: .*too large"),
    (lambda w: w.set_force(2, np.zeros(3)), ValueError, "body is 2 where 0 to 1"),
    (lambda w: w.set_force(1, [1, 2]), ValueError, "force has shape"),
    (lambda w: w.set_force(1, torque=[0, 0, np.inf]), tandem.Error, "not finite"),
    (lambda w: w.set_material(2, friction=1), ValueError, "body is 2 where 0 to 1"),
    (lambda w: w.set_material(1, restitution=1.1), ValueError, "restitution is 1.1 where at most 1"),
    (lambda w: w.set_material(1, friction=np.nan), ValueError, "friction is nan"),
    (lambda w: w.set_gravity_scale(1, np.nan), tandem.Error, "not finite"),
    (lambda w: w.remove_joint(0), tandem.Error, "no such joint"),
    (lambda w: w.add_joint({"kind": "ball"}), TypeError, "joint 0 is dict where a tandem.Joint"),
    (lambda w: tandem.World([BOX], translation=np.zeros(3), joints=[tandem.Joint("ball", None, 0, np.zeros(3)), 7]), TypeError, "joint 1 is int"),
    (lambda w: w.add_joint(tandem.Joint("slider", 0, 1, np.zeros(3), limits=3)), TypeError, "limits is 3 where two numbers"),
    (lambda w: w.add_joint(tandem.Joint("slider", 0, 1, np.zeros(3), limits=(0, "1"))), TypeError, r"limits\[1\] is str"),
    (lambda w: w.step(0), ValueError, "dt is 0"),
    (lambda w: w.step(-1 / 60), ValueError, "dt is -0.01"),
    (lambda w: w.step(np.nan), ValueError, "dt is nan"),
    (lambda w: w.step(1001), ValueError, "dt is 1001"),
    (lambda w: w.step("1"), TypeError, "dt is str"),
    (lambda w: w.step(1 / 60, -1), ValueError, "steps is -1"),
    (lambda w: w.step(1 / 60, 1.5), TypeError, "steps is float"),
    (lambda w: w.push(2, np.zeros(3)), ValueError, "body is 2 where 0 to 1"),
    (lambda w: w.push(1, [1, 2]), ValueError, "impulse has shape"),
    (lambda w: w.push(1, [0, 0, np.nan]), tandem.Error, "not finite"),
    (lambda w: w.push(1, np.zeros(3), at=[np.inf, 0, 0]), tandem.Error, "not finite"),
    (lambda w: w.move(-1, velocity=np.zeros(3)), ValueError, "body is -1"),
    (lambda w: w.move(1, velocity=[np.nan, 0, 0]), tandem.Error, "instance 1"),
    (lambda w: w.move(1, rotation=3 * np.eye(3)), tandem.Error, "instance 1: .*scales by 3"),
    (lambda w: w.move(1, translation=np.zeros((2, 3))), ValueError, "2 poses where one"),
    (lambda w: tandem.World([BOX]).move(0), ValueError, "there are no bodies"),
    (lambda w: w.restore(None), TypeError, "state is NoneType"),
])
def test_wrong_calls_say_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words):
        call(pair())


def is_finite(world):
    return all(np.isfinite(rows[name]).all() for rows in (world.bodies, world.contacts) for name in rows.dtype.names)


def test_a_body_that_leaves_the_world_is_named():
    world = tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1], [9, 0, 0]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING, tandem.MOVING]))
    world.step(1 / 60)
    assert len(world.contacts) > 0
    world.set_force(2, [9e12, 0, 0])
    before = world.translation
    with pytest.raises(tandem.Error, match="instance 2") as caught:
        world.step(1000.0, 10)
    assert caught.value.name == "OutOfRange" and caught.value.where == 2
    assert is_finite(world) and len(world.contacts) == 0 and np.array_equal(world.translation[2], before[2])
    world.set_force(2)
    world.step(1 / 60)
    assert is_finite(world) and world.translation[2, 2] < before[2, 2]


@pytest.mark.parametrize("continuous", [False, True])
def test_strange_scenes_stay_finite(continuous):
    wall = tandem.build(*solids.box(0.005, 5, 5))
    for speed in (1e3, 1e6, 1e9):
        world = tandem.World([wall, BOX], asset=[0, 1], translation=[[0, 0, 0], [20, 0, 0.2]], velocity=[[0, 0, 0], [-speed, 0, 0]], filter=FIRST_FIXED,
                             gravity=[0, 0, 0], continuous=continuous)
        world.step(1 / 60, 60)
        assert is_finite(world) and (world.translation[1, 0] > 0.5) == continuous
    vertices, triangles = solids.box(HALF, HALF, HALF)
    for shape in (triangles, triangles[:, ::-1], triangles[:-2]):
        body = tandem.build(vertices, shape)
        world = tandem.World([FLOOR, body], asset=[0] + 10 * [1], translation=[[0, 0, -HALF]] + 10 * [[0.3, 0.2, 1]], continuous=continuous,
                             filter=tandem.Filter(motion=[tandem.FIXED] + 10 * [tandem.MOVING]))
        for _ in range(60):
            world.step(1 / 60)
            assert is_finite(world)
        assert np.ptp(world.translation[1:], axis=0).max() > 0.5


def test_a_second_thread_is_refused_and_others_run():
    worlds.expect_that_a_second_thread_is_refused(pile(60))


@needs_alarm
def test_ctrl_c_ends_many_steps():
    world = pair(sleeping=False)
    worlds.expect_that_ctrl_c_ends_many_steps(world, after=0.2)
    assert world.translation[1, 2] == pytest.approx(1, abs=1e-3)
