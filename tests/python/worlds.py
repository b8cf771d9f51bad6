"""What worlds on the CPU and on a GPU do alike."""
import signal
import threading
import time

import pytest


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
