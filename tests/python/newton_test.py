"""tandem.newton: meshes are no hulls, rows are as Newton writes them, and worlds stay apart."""
import pathlib

import numpy as np
import pytest

import fakes
import solids
import tandem

newton = pytest.importorskip("newton", reason="needs the package newton")
import warp as wp  # noqa: E402

import tandem.newton  # noqa: E402
from tandem import _warp  # noqa: E402

UPRIGHT = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture(autouse=True)
def on_the_cpu():
    wp.config.log_level = wp.LOG_WARNING
    with wp.ScopedDevice("cpu"):
        yield


def mesh_of(solid):
    return newton.Mesh(solid[0].astype("f4"), solid[1].astype("i4").ravel())


def turn(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return (*np.sin(angle / 2) * axis, np.cos(angle / 2))


def builder_of(*bodies, **shape):
    """Bodies are solids and where they are; without a place they are fixed at the origin."""
    builder = newton.ModelBuilder()
    for name, value in shape.items():
        setattr(builder.default_shape_cfg, name, value)
    for solid, *place in bodies:
        body = builder.add_body(xform=wp.transform(*place)) if place else -1
        builder.add_shape_mesh(body, mesh=mesh_of(solid))
    return builder


def collide(model, pipeline=None):
    pipeline = pipeline or tandem.newton.CollisionPipeline(model)
    contacts, state = pipeline.contacts(), model.state()
    pipeline.collide(state, contacts)
    return contacts, state


def rows(contacts, name):
    return getattr(contacts, f"rigid_contact_{name}").numpy()[:int(contacts.rigid_contact_count.numpy()[0])]


def run(model, pipeline, solver, seconds, steps):
    contacts, states, control = pipeline.contacts(), [model.state(), model.state()], model.control()
    for _ in range(steps):
        states[0].clear_forces()
        pipeline.collide(states[0], contacts)
        solver.step(states[0], states[1], control, contacts, seconds / steps)
        states.reverse()
    return states[0]


def ball_over_a_cup():
    builder = builder_of((solids.cup(0.15, 0.18, 0.04, 0.25), (0, 0, 0), UPRIGHT), (solids.ball(0.1), (0.01, 0, 0.4), UPRIGHT))
    builder.add_ground_plane()
    return builder.finalize()


def test_ball_falls_into_the_cup_and_rests():
    model = ball_over_a_cup()
    state = run(model, tandem.newton.CollisionPipeline(model), newton.solvers.SolverXPBD(model, iterations=10), 1.5, 750)
    assert state.body_q.numpy()[1, 2] == pytest.approx(0.14, abs=0.003)
    assert state.body_q.numpy()[0, 2] == pytest.approx(0, abs=0.001)  # on Newton's contacts with the plane
    assert np.abs(state.body_qd.numpy()[:, :3]).max() < 0.1  # it may roll


def test_ball_falls_into_the_cup_in_newtons_mujoco():
    """Which, left to its own contacts, makes the meshes convex (newton #4065)."""
    pytest.importorskip("mujoco_warp")
    model = ball_over_a_cup()
    own = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True, use_mujoco_contacts=True)
    assert run(model, newton.CollisionPipeline(model), own, 1, 500).body_q.numpy()[1, 2] > 0.3
    solver = newton.solvers.SolverMuJoCo(model, use_mujoco_contacts=False)
    state = run(model, tandem.newton.CollisionPipeline(model), solver, 1, 500)
    assert state.body_q.numpy()[1, 2] == pytest.approx(0.14, abs=0.003)


def test_the_program_of_the_page_runs():
    page = pathlib.Path(__file__).parents[2] / "docs" / "python_simulators.md"
    program = page.read_text().split("## Newton")[1].split("```python\n")[1].split("```")[0]
    model = ball_over_a_cup()
    names = {"tandem": tandem, "model": model, "state": model.state(), "next_state": model.state(), "control": model.control(), "dt": 1 / 500, "steps": 250,
             "solver": newton.solvers.SolverXPBD(model, iterations=10)}
    exec(program, names)
    assert names["state"].body_q.numpy()[1, 2] < 0.2


def test_rows_are_manifolds_in_the_frames_of_bodies():
    """Turned and moved shapes of turned and moved bodies, scaled, on a fixed one: rows are those of a scene with the poses that follow."""
    ball, floor = solids.ball(1.0), solids.box(1, 1, 0.1)
    builder = builder_of((floor,))
    turned, quaternion = turn((1, 2, 3), 0.7), turn((0, 1, 1), 0.4)
    body = builder.add_body(xform=wp.transform((0.2, 0.1, 0.5), quaternion))
    scale = np.array([0.1, 0.12, 0.14])
    # The middle of the ball is to be at (0.2, 0.1, 0.2), 0.1 over the floor.
    middle = np.array(wp.quat_rotate(wp.quat_inverse(wp.quat(*quaternion)), wp.vec3(0, 0, -0.3)))
    builder.add_shape_mesh(body, xform=wp.transform(middle, turned), mesh=mesh_of(ball), scale=tuple(scale))
    model = builder.finalize()
    contacts, state = collide(model)
    assert rows(contacts, "shape0").tolist() == [0] * len(rows(contacts, "shape0")) and set(rows(contacts, "shape1")) == {1}

    rotation = np.array(wp.quat_to_matrix(wp.quat(*quaternion) * wp.quat(*turned)), float).reshape(3, 3)
    u, _, v = np.linalg.svd(rotation)
    assets = [tandem.build(*floor), tandem.build(ball[0].astype("f4").astype(float) * scale.astype("f4"), ball[1])]
    made = tandem.Scene(assets, asset=[0, 1], rotation=[np.eye(3), u @ v], translation=[[0, 0, 0], [0.2, 0.1, 0.2]]).manifolds()
    assert len(made.points) > 3 and len(made.points) == len(rows(contacts, "normal"))
    np.testing.assert_allclose(rows(contacts, "normal"), made.manifolds["normal"][made.points["manifold"]], atol=1e-5)
    distance = wp.zeros(contacts.rigid_contact_max, dtype=float)
    point0, point1 = wp.zeros(contacts.rigid_contact_max, dtype=wp.vec3), wp.zeros(contacts.rigid_contact_max, dtype=wp.vec3)
    newton.eval_rigid_contact_kinematics(model, state, contacts, out_distance=distance, out_point0_world=point0, out_point1_world=point1)
    count = len(made.points)
    np.testing.assert_allclose(distance.numpy()[:count], -made.points["depth"], atol=2e-6)
    # The deepest point, alone deep in the ball's round overlap, acts across from it in the middle.
    first, middle, up = made.points["position"][0], made.manifolds["centre"][0], made.manifolds["normal"][0]
    second = made.points["depth"][1:].max() / made.points["depth"][0]
    assert 0 <= second < 0.5
    expected = made.points["position"].copy()
    expected[0] += (1 - 2 * second) * (middle - first - (middle - first) @ up * up)
    np.testing.assert_allclose(0.5 * (point0.numpy() + point1.numpy())[:count], expected, atol=2e-6)


SHAPES = {"sphere": {"radius": 0.1}, "ellipsoid": {"rx": 0.1, "ry": 0.2, "rz": 0.3}, "capsule": {"radius": 0.1, "half_height": 0.2},
          "cylinder": {"radius": 0.1, "half_height": 0.2}, "cone": {"radius": 0.1, "half_height": 0.2}, "box": {"hx": 0.1, "hy": 0.2, "hz": 0.3}}
LOWEST = {"sphere": 0.1, "ellipsoid": 0.3, "capsule": 0.3, "cylinder": 0.2, "cone": 0.2, "box": 0.3}  # below its middle


@pytest.mark.parametrize("kind", SHAPES)
def test_round_shapes_and_boxes_meet_meshes(kind):
    """Upright on a floor that is a mesh: one millimetre deep, to the tolerance; another such shape beside it, which it meets, stays Newton's."""
    builder = builder_of((solids.box(1, 1, 0.1),), gap=0.0)
    for x in (0, 0.15):
        body = builder.add_body(xform=wp.transform((x, 0, 0.1 + LOWEST[kind] - 0.001), UPRIGHT))
        getattr(builder, f"add_shape_{kind}")(body, **SHAPES[kind])
    pipeline = tandem.newton.CollisionPipeline(builder.finalize(), tolerance=0.002)
    contacts, state = pipeline.contacts(), pipeline.model.state()
    count = pipeline.collide(state, contacts)
    pairs = np.stack([rows(contacts, "shape0"), rows(contacts, "shape1")], axis=1)
    assert count > 1 and {tuple(pair) for pair in pairs[-count:].tolist()} == {(0, 1), (0, 2)}
    assert len(pairs) > count and {tuple(sorted(pair)) for pair in pairs[:-count].tolist()} == {(1, 2)}
    distance = wp.zeros(contacts.rigid_contact_max, dtype=float)
    newton.eval_rigid_contact_kinematics(pipeline.model, state, contacts, out_distance=distance)
    deepest = distance.numpy()[len(pairs) - count:len(pairs)].min()
    assert deepest == pytest.approx(-0.001, abs=1e-6 + (0 if kind in ("box", "cylinder", "cone") else 0.002 * LOWEST[kind]))
    np.testing.assert_allclose(rows(contacts, "normal")[-count:], np.tile([0, 0, 1], (count, 1)), atol=1e-5)


def test_ring_hangs_on_a_capsule():
    builder = newton.ModelBuilder()
    builder.add_shape_capsule(-1, xform=wp.transform((0, 0, 1), turn((0, 1, 0), np.pi / 2)), radius=0.015, half_height=0.2)
    builder.add_shape_mesh(builder.add_body(xform=wp.transform((0, 0, 0.94), turn((0, 1, 0), np.pi / 2))), mesh=mesh_of(solids.chain_link(0.08, 0.015)))
    model = builder.finalize()
    state = run(model, tandem.newton.CollisionPipeline(model), newton.solvers.SolverXPBD(model, iterations=10), 1, 500)
    assert state.body_q.numpy()[0, 2] == pytest.approx(1 + 0.015 - 0.065, abs=0.005)


def test_worlds_at_one_place_do_not_meet():
    world = builder_of((solids.box(1, 1, 0.1), (0, 0, 0), UPRIGHT), (solids.ball(0.1), (0, 0, 0.199), UPRIGHT), (solids.ball(0.1), (0.19, 0, 0.199), UPRIGHT))
    builder = newton.ModelBuilder()
    for _ in range(5):
        builder.add_world(world)
    contacts, _ = collide(builder.finalize())
    pairs = np.stack([rows(contacts, "shape0"), rows(contacts, "shape1")], axis=1)
    assert {tuple(pair) for pair in pairs.tolist()} == {(3 * i + a, 3 * i + b) for i in range(5) for a, b in ((0, 1), (0, 2), (1, 2))}


def test_a_ring_about_a_peg_has_no_contacts():
    model = builder_of((solids.peg(0.05, 0.4),), (solids.ring(0.06, 0.1, 0.03), (0.002, 0.001, 0.2), UPRIGHT)).finalize()
    assert len(rows(collide(model)[0], "normal")) == 0


def test_within_margins_there_are_points():
    for height, expected in ((0.215, True), (0.225, False)):
        model = builder_of((solids.box(1, 1, 0.1),), (solids.ball(0.1), (0.2, 0.1, height), UPRIGHT), margin=0.01).finalize()
        contacts, state = collide(model)
        count = len(rows(contacts, "normal"))
        assert (count > 0) == expected
        distance = wp.zeros(contacts.rigid_contact_max, dtype=float)
        newton.eval_rigid_contact_kinematics(model, state, contacts, out_distance=distance)
        for k in range(count):
            np.testing.assert_allclose(rows(contacts, "normal")[k], [0, 0, 1], atol=1e-6)
            np.testing.assert_allclose(rows(contacts, "offset0")[k], [0, 0, 0.01], atol=1e-6)
            np.testing.assert_allclose(rows(contacts, "offset1")[k], [0, 0, -0.01], atol=1e-6)
            assert rows(contacts, "point0")[k, 2] == pytest.approx(0.1, abs=1e-6)
        if expected:
            deepest = distance.numpy()[:count].argmin()
            assert distance.numpy()[deepest] == pytest.approx(height - 0.2 - 0.02, abs=1e-6) and distance.numpy()[:count].max() <= 1e-6
            np.testing.assert_allclose(rows(contacts, "point1")[deepest], [0, 0, -0.1], atol=1e-5)


def test_contacts_that_have_no_room_are_an_error():
    builder = builder_of((solids.box(1, 1, 0.1),), *((solids.box(0.1, 0.1, 0.1), (0.21 * i - 0.9, 0, 0.199), UPRIGHT) for i in range(9)))
    model = builder.finalize()
    assert len(rows(collide(model)[0], "normal")) == 36
    pipeline = tandem.newton.CollisionPipeline(model, rigid_contact_max=35)
    with pytest.raises(MemoryError, match="36 contacts have no room"):
        collide(model, pipeline)
    with pytest.raises(ValueError, match="contact_matching"):
        tandem.newton.CollisionPipeline(model, contact_matching="latest")


def test_a_pose_that_is_not_a_number_is_an_error():
    model = builder_of((solids.box(1, 1, 0.1),), (solids.ball(0.1), (0, 0, np.nan), UPRIGHT)).finalize()
    with pytest.raises(tandem.Error):
        collide(model)


@pytest.mark.parametrize("named", (False, True))
def test_the_way_of_a_gpu_has_the_points_of_a_cpu(named):
    """On arrays in CPU memory, to the last bit: of pairs that the query finds by worlds, or that are named; from too little room on."""
    world = builder_of(*((solids.ball(0.1), (0.17 * i, 0.02 * i, 0), turn((1, i, 0), i)) for i in range(4)), (solids.box(0.3, 0.1, 0.05), (0.2, 0, 0.1), UPRIGHT))
    builder = newton.ModelBuilder()
    for _ in range(40):
        builder.add_world(world)
    model = builder.finalize()
    pipeline = tandem.newton.CollisionPipeline(model)
    count = pipeline.collide(model.state(), pipeline.contacts())
    assert count > 1000
    touches = pipeline._touches
    expected = touches.touches.numpy()[:count]
    columns = {"group": np.ones(200, np.uint32), "mask": np.ones(200, np.uint32), "world": np.repeat(np.arange(40, dtype=np.uint32), 5), "excluded": np.empty((0, 2), np.uint32)}
    asked = np.unique(np.stack([expected["a"], expected["b"]], axis=1), axis=0) if named else None
    assets, asset = pipeline.assets, np.array(pipeline._asset)
    gpu = _warp._OnGpu(fakes.Cuda, touches, assets, asset, asked, None if named else columns, 7)
    gpu._room = dict.fromkeys(gpu._room, 3) | ({"pairs": len(asked)} if named else {})
    gpu._reserve()
    assert gpu.find() == count and len(gpu._query.reserved) > 2
    shown = gpu.touches.numpy()[:count]
    for name in expected.dtype.names:  # numbers to the last bit, but that 0 may be -0
        assert np.array_equal(shown[name], expected[name])


def test_pairs_that_may_not_collide_are_left_out():
    """Worlds of shapes of which some filter each other, and a shape that is in all worlds: the pairs that are asked about are the model's."""
    world = builder_of(*((solids.ball(0.1), (0.01 * i, 0, 0), UPRIGHT) for i in range(5)))
    world.add_shape_collision_filter_pair(0, 3)
    builder = newton.ModelBuilder()
    builder.add_shape_mesh(-1, mesh=mesh_of(solids.box(1, 1, 0.1)))
    for _ in range(6):
        builder.add_world(world)
    model = builder.finalize()
    contacts, _ = collide(model)
    found = {tuple(sorted(pair)) for pair in zip(rows(contacts, "shape0").tolist(), rows(contacts, "shape1").tolist())}
    assert found == {tuple(sorted(pair)) for pair in model.shape_contact_pairs.numpy().tolist()}
    assert len(found) == 6 * (10 - 1 + 5)
