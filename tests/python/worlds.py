"""What worlds on the CPU and on a GPU do alike."""
import signal
import threading
import time

import numpy as np
import pytest

import tandem


def expect_that_a_second_thread_is_refused(world):
    refused, done = [], threading.Event()

    def work():
        world.step(1 / 240, 200)
        done.set()

    worker = threading.Thread(target=work)
    worker.start()
    while not done.is_set():
        try:
            world.translation
        except RuntimeError as error:
            refused.append(str(error))
    worker.join()
    assert set(refused) == {"another thread is in a call of this world"}


def expect_that_ctrl_c_ends_many_steps(world, after):
    """after: seconds."""
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, after)
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            world.step(1 / 60, 2**40)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    assert time.monotonic() - start < 5 and world.time > 0
    world.step(1 / 60)


def expect_that_joints_hold_and_motors_turn(box, device, within):
    """box: of 1 m. within: what joints may give way by, in metres and metres per second."""
    joints = [tandem.Joint("fixed", None, 0, anchor=[0, 0, 0]),
              tandem.Joint("hinge", 0, 1, anchor=[0.2, 0.1, 1.0], axis=[0, 0, 3], limits=(-1, 7), speed=2, most_effort=1e6)]
    world = tandem.World([box], translation=[[0, 0, 0], [0.2, 0.1, 1.0]], joints=joints, device=device)
    world.step(1 / 60, 60)
    assert len(world.contacts) == 0
    assert np.allclose(world.translation, [[0, 0, 0], [0.2, 0.1, 1]], atol=within)
    assert np.allclose(world.joints["position"], [0, 2], atol=0.02) and np.allclose(world.joints["speed"], [0, 2], atol=within)
    world.set_motor(1, -3, 1e6)
    world.step(1 / 60, 2)
    assert np.allclose(world.angular_velocity[1], [0, 0, -3], atol=within)
    with pytest.raises(tandem.Error, match="no such joint"):
        world.set_motor(0, 1, 1)
    with pytest.raises(tandem.Error, match="axis"):
        world.place(translation=[0, 0, 0], joints=[tandem.Joint("slider", 0, None, anchor=[0, 0, 0], axis=[0, 0, 0])])
    with pytest.raises(ValueError, match="kind is 'rope'"):
        world.place(translation=[0, 0, 0], joints=[tandem.Joint("rope", 0, None, anchor=[0, 0, 0])])


def expect_that_joints_come_go_and_break(box, device, within):
    world = tandem.World([box], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]), device=device)
    world.step(1 / 60, 60)
    assert world.sleeping[1] and len(world.joints) == 0
    weight = 9.81 * world.mass[1]
    kept = world.save()
    assert world.add_joint(tandem.Joint("fixed", 0, 1, anchor=[0, 0, 0.5], breaking_force=2 * weight)) == 0
    assert world.joints["holds"].tolist() == [1] and not world.sleeping[1]
    world.set_force(1, [0, 0, 2.5 * weight])
    world.step(1 / 60, 30)
    assert len(world.touching) == len(world.broken) == 0 and (abs(world.velocity) < within).all()
    world.set_force(1, [0, 0, 3.5 * weight])
    world.step(1 / 60, 61)
    assert world.broken.tolist() == [0] and world.joints["holds"].tolist() == [0]
    assert world.velocity[1, 2] == pytest.approx(2.5 * 9.81, abs=within)
    world.step(1 / 60)
    assert len(world.broken) == 0
    world.remove_joint(0)
    with pytest.raises(tandem.Error, match="no such joint"):
        world.remove_joint(0)
    with pytest.raises(tandem.Error, match="nothing"):
        world.add_joint(tandem.Joint("ball", 0, None, anchor=[0, 0, 0]))
    with pytest.raises(ValueError, match="breaking_torque is 0"):
        world.add_joint(tandem.Joint("ball", 1, None, anchor=[0, 0, 0], breaking_torque=0))
    world.restore(kept)
    assert len(world.joints) == 0 and world.sleeping[1]
