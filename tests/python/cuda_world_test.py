"""Worlds on a GPU: bodies move as on the CPU, states are given in place, and what is missing is named. Skipped where there is no GPU."""
import gc
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import solids
import tandem
import worlds
from meshes import needs_alarm

cuda = pytest.importorskip("tandem.cuda", exc_type=ImportError)
ROOT = Path(os.environ["TANDEM_SOURCE_DIR"])
BOX = tandem.build(*solids.box(0.5, 0.5, 0.5))
FLOOR = tandem.build(*solids.box(10, 10, 0.5))


def has_gpu():
    try:
        tandem.World([], device="cuda")
    except tandem.Error as error:
        assert error.name == "NoGpu"
        return False
    return True


needs_gpu = pytest.mark.skipif(not has_gpu(), reason="there is no GPU")


@pytest.fixture
def torch():
    return pytest.importorskip("torch")


def drop(count=30, **options):
    """Turned boxes above a floor."""
    places = np.stack(np.unravel_index(np.arange(count), (count, 3, 3))[::-1], axis=1) * 1.5 - [1.5, 1.5, -1.2]
    turns = tandem.rotations(xyzw=np.random.default_rng(2).normal(size=(count, 4)))
    return tandem.World([FLOOR, BOX], asset=[0] + count * [1], translation=[[0, 0, -0.5], *places], rotation=[np.eye(3), *turns],
                        filter=tandem.Filter(motion=[tandem.FIXED] + count * [tandem.MOVING]), **{"device": "cuda", **options})


def floating(**options):
    return tandem.World([BOX], translation=[[0, 0, 0], [3, 0, 0]], gravity=[0, 0, 0], **{"device": "cuda", **options})


def test_without_a_gpu_the_reason_is_told():
    program = "import tandem\ntry:\n    tandem.World([], device='cuda')\nexcept tandem.Error as error:\n    print(error.name, error)"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})
    assert told.stdout.startswith("NoGpu there is no GPU"), told.stderr


@needs_gpu
def test_continuous_motion_is_that_of_the_cpu():
    fixed = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])
    on_cpu, on_gpu = (tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 5]], velocity=[[0, 0, 0], [0, 0, -900]], filter=fixed, continuous=True,
                                   device=device) for device in ("cpu", "cuda"))
    for world in (on_cpu, on_gpu):
        world.step(1 / 60, 60)
    assert on_gpu.translation[1, 2] > 0.9 and np.allclose(on_gpu.translation, on_cpu.translation, atol=0.01)


@needs_gpu
def test_a_device_that_there_is_not_is_named():
    for make in (lambda: tandem.World([BOX], device="cuda:99"), lambda: tandem.Scene([BOX], device="cuda:99"), lambda: cuda.Query([BOX], device=99)):
        with pytest.raises(ValueError, match="device is GPU 99 where 0 to"):
            make()


@needs_gpu
def test_bodies_fall_as_on_the_cpu():
    given = {"velocity": [[1, 0, 2], [0, 0, 0]], "angular_velocity": [[0, 0.5, 1], [3, 0, 0]], "density": [1000, 300], "gravity_scale": [1, 0.5]}
    on_cpu, on_gpu = (tandem.World([BOX], translation=[[0, 0, 5], [3, 0, 5]], device=device, **given) for device in ("cpu", "cuda"))
    for world in (on_cpu, on_gpu):
        world.step(1 / 60, 30)
    assert on_gpu.time == on_cpu.time and np.array_equal(on_gpu.mass, on_cpu.mass)
    for name in ("translation", "rotation", "velocity", "angular_velocity"):
        assert np.allclose(getattr(on_gpu, name), getattr(on_cpu, name), atol=1e-9)
    assert on_gpu.bodies.dtype == tandem.BODY_MOTION and len(on_gpu.instances) == 2 and not on_gpu.sleeping.any()


@needs_gpu
def test_boxes_come_to_rest():
    world = drop()
    while not world.sleeping[1:].all() and world.time < 30:
        world.step(1 / 60, 30)
    assert world.sleeping[1:].all() and np.abs(world.velocity).max() < 0.03
    assert 0.45 < world.translation[1:, 2].min() and world.translation[1:, 2].max() < 3
    depth = tandem.Scene([FLOOR, BOX], world.instances).manifolds().manifolds["depth"]
    assert len(depth) >= 30 and depth.max() < 0.01


@needs_gpu
def test_contacts_hold_bodies_up():
    world = tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]), sleeping=False, device="cuda")
    world.step(1 / 60, 120)
    contacts, touching = world.contacts, world.touching
    assert contacts.dtype == tandem.WORLD_CONTACT and contacts["impulse"].sum(axis=0)[2] * 60 == pytest.approx(9810, rel=0.02)
    assert touching.dtype == tandem.WORLD_TOUCH and touching[["a", "b"]].tolist() == [(0, 1)] and touching["impulse"][0] * 60 == pytest.approx(9810, rel=0.02)
    assert world.began[["a", "b"]].tolist() == [(0, 1)] and len(world.ended) == 0


@needs_gpu
def test_what_a_call_began_and_ended_is_that_of_the_cpu():
    fixed = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])
    on_cpu, on_gpu = (tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1.5]], filter=fixed, restitution=0.8, device=device) for device in ("cpu", "cuda"))
    for world in (on_cpu, on_gpu):
        world.step(1 / 240, 160)
        assert world.began[["a", "b"]].tolist() == world.ended.tolist() == [(0, 1)] and len(world.touching) == 0
    assert on_gpu.began["speed"] == pytest.approx(on_cpu.began["speed"], rel=0.02) and on_gpu.began["impulse"] == pytest.approx(on_cpu.began["impulse"], rel=0.1)
    on_gpu.step(1 / 240)
    assert len(on_gpu.began) == len(on_gpu.ended) == 0


@needs_gpu
def test_materials_and_gravity_change():
    world = tandem.World([BOX], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]), gravity=[2, 0, -9.81], device="cuda")
    world.step(1 / 60, 60)
    assert world.sleeping[1]
    world.set_material(0)
    assert world.sleeping[1]
    world.set_material(0, friction=0)
    assert not world.sleeping[1]
    world.step(1 / 60, 12)
    assert world.velocity[1, 0] == pytest.approx(0.4, abs=0.02)
    world.set_gravity_scale(1, 0)
    before = world.velocity[1, 0]
    world.step(1 / 60, 12)
    assert world.velocity[1, 0] == pytest.approx(before)


@needs_gpu
def test_going_back_gives_the_same_bytes():
    world = drop()
    world.step(1 / 60, 40)
    state, time_then, touching = world.save(), world.time, world.touching.tobytes()
    seen = []
    for _ in range(2):
        world.step(1 / 60, 60)
        seen.append(world.bodies.tobytes() + world.contacts.tobytes() + world.touching.tobytes() + world.began.tobytes() + world.ended.tobytes())
        world.set_material(0, friction=0)
        world.set_gravity_scale(3, -1)
        world.set_force(4, [1000, 0, 0])
        world.step(1 / 100, 50)
        world.restore(state)
        assert world.time == time_then and len(world.contacts) == len(world.began) == 0 and world.touching.tobytes() == touching
    assert seen[0] == seen[1]
    with pytest.raises(ValueError, match="another kind of device"):
        world.restore(tandem.World([BOX], translation=np.zeros(3)).save())
    with pytest.raises(ValueError, match="another kind of device"):
        tandem.World([BOX], translation=np.zeros(3)).restore(state)
    world.place(translation=np.zeros(3))
    with pytest.raises(tandem.Error) as caught:
        world.restore(state)
    assert caught.value.name == "KeptMismatch"
    del world
    gc.collect()
    del state
    assert drop().bytes > 1e6


@needs_gpu
def test_a_body_that_leaves_the_world_is_named(torch):
    world = drop(8)
    world.step(1 / 60, 20)
    world.move(3, translation=[100, 0, 1000])
    world.set_force(3, [4e9 * world.mass[3], 0, 0])
    before = world.time
    with pytest.raises(tandem.Error) as caught:
        world.step(1.0, 10)
    assert caught.value.name == "OutOfRange" and caught.value.where == 3 and world.time == pytest.approx(before + 2) and len(world.contacts) == 0
    world.set_force(3)
    torch.from_dlpack(world.states)[2, 8] = float("nan")
    torch.cuda.synchronize()
    world.wake()
    with pytest.raises(tandem.Error) as caught:
        world.step(1 / 60)
    assert caught.value.name == "OutOfRange" and caught.value.where == 2
    world.move(2, translation=[0, 0, 9], velocity=[0, 0, 0])
    world.step(1 / 60)
    assert world.velocity[2, 2] == pytest.approx(-9.81 / 60)


@needs_gpu
def test_the_same_bytes_however_steps_are_called():
    made = [drop(), drop(), drop(threads=4)]
    made[0].step(1 / 60, 60)
    for _ in range(60):
        made[1].step(1 / 60)
    for _ in range(6):
        made[2].step(1 / 60, 10)
        made[2].contacts, made[2].touching
    assert len({world.bodies.tobytes() + world.contacts.tobytes() for world in made}) == 1
    made[0].step(1 / 60, 0)
    assert made[0].time == made[1].time


@needs_gpu
def test_bodies_are_pushed_pulled_and_moved():
    world = floating()
    world.push(0, [0, 0, world.mass[0]])
    world.set_force(1, [world.mass[1], 0, 0])
    world.step(0.01, 100)
    assert np.allclose(world.velocity, [[0, 0, 1], [1, 0, 0]], atol=1e-9)
    world.move(0, translation=[0, 0, 9], velocity=[0, 1, 0])
    assert np.allclose(world.translation[0], [0, 0, 9]) and np.allclose(world.velocity[0], [0, 1, 0])


@needs_gpu
def test_states_are_the_memory_of_the_steps(torch):
    world = floating()
    states = torch.from_dlpack(world.states)
    assert states.shape == (2, 13) and states.dtype == torch.float64 and states.data_ptr() == world.states.pointer
    assert np.allclose(states.cpu().numpy(), [[0, 0, 0, 1, 0, 0, 0] + 6 * [0], [3, 0, 0, 1, 0, 0, 0] + 6 * [0]])
    states[0, 7:10] = torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    states[1, 0] = 5
    torch.cuda.synchronize()
    world.wake()
    assert not world.sleeping.any()
    world.step(0.01, 50)
    assert np.allclose(world.translation, [[0, 0, 1], [5, 0, 0]], atol=1e-9)
    assert states.cpu().numpy()[0, 2] == pytest.approx(1)  # the steps wrote there


@needs_gpu
def test_states_by_the_array_interface():
    cupy = pytest.importorskip("cupy")
    world = floating()
    states = cupy.asarray(world.states)
    assert states.shape == (2, 13) and states.data.ptr == world.states.pointer
    assert states[1, :3].get().tolist() == [3, 0, 0]


@needs_gpu
def test_states_outlive_bodies_and_worlds(torch):
    world = floating()
    first = torch.from_dlpack(world.states)
    world.place(translation=[[0, 0, 7]])
    assert torch.from_dlpack(world.states).shape == (1, 13) and world.states.pointer != first.data_ptr()
    world.step(1 / 60, 10)
    assert first.cpu().numpy()[1, 0] == 3
    second = torch.from_dlpack(world.states)
    del world
    gc.collect()
    drop().step(1 / 60, 10)
    assert first.cpu().numpy()[1, 0] == 3 and second.cpu().numpy()[0, 2] == 7


@needs_gpu
def test_no_bodies():
    world = tandem.World([BOX], device="cuda")
    world.step(1 / 60, 3)
    world.wake()
    assert len(world.bodies) == len(world.contacts) == len(world.touching) == len(world.began) == len(world.ended) == len(world.joints) == len(world.mass) == 0 and world.states.shape == (0, 13)
    world.place(translation=[0, 0, 1]).step(1 / 60)
    assert world.translation[0, 2] < 1
    world.place(translation=np.zeros((0, 3))).step(1 / 60)
    assert len(world.bodies) == 0


@needs_gpu
def test_joints_hold_and_motors_turn():
    worlds.expect_that_joints_hold_and_motors_turn(BOX, "cuda", within=1e-3)


@needs_gpu
def test_joints_come_go_and_break():
    worlds.expect_that_joints_come_go_and_break(BOX, "cuda", within=1e-3)


@needs_gpu
@pytest.mark.parametrize("call, words", [
    (lambda w: w.place(translation=np.zeros((2, 3)), density=[1, 0]), "instance 1: .*density"),
    (lambda w: w.place(translation=[[0, 0, 0], [0, np.nan, 0]]), "instance 1: .*translation is not finite"),
    (lambda w: w.place(translation=np.zeros(3), filter=tandem.Filter(excluded=[[0, 5]])), "pair 0"),
    (lambda w: tandem.World([BOX, tandem.build(*solids.box(1, 1, 1), topology=False)], device="cuda"), "asset 1"),
    (lambda w: w.push(1, [0, 0, np.nan]), "not finite"),
    (lambda w: w.remove_joint(0), "no such joint"),
    (lambda w: w.set_motor(0, 1, 1), "no such joint"),
    (lambda w: w.set_force(1, [1e300, 0, 0]), "instance 1: .*too large"),
    (lambda w: w.move(1, rotation=3 * np.eye(3)), "instance 1: .*scales by 3"),
])
def test_wrong_calls_say_what_is_wrong(call, words):
    with pytest.raises(tandem.Error, match=words):
        call(floating())


@needs_gpu
def test_a_second_thread_is_refused_and_others_run():
    worlds.expect_that_a_second_thread_is_refused(drop())


@needs_gpu
@needs_alarm
def test_ctrl_c_ends_many_steps():
    worlds.expect_that_ctrl_c_ends_many_steps(drop(4, sleeping=False), after=0.5)


@needs_gpu
def test_the_example_of_the_page_runs(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    example, shown = re.search(r"^## On a GPU$.*?^```python\n(.*?)^```\n```\n(.*?)^```$", (ROOT / "docs/dynamics.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL).groups()
    exec(compile(example, "docs/dynamics.md", "exec"), {})
    assert capsys.readouterr().out == shown
