"""Who may die before whom, threads, exceptions in callbacks, and Ctrl-C."""
import gc
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import tandem
from meshes import BOX_FACES, BOX_VERTICES, needs_alarm

BODIES = tandem.instances(translation=np.random.default_rng(1).uniform(0, 6, (400, 3)))


def sphere(count):
    """A closed mesh of some 4 count^2 triangles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, count + 1), np.linspace(0, 2 * np.pi, 2 * count, endpoint=False), indexing="ij")
    vertices = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    vertices[-2 * count:, :2] = 0  # sin(pi) is not quite 0
    row, column = np.meshgrid(np.arange(count), np.arange(2 * count), indexing="ij")
    at = lambda r, c: (r * 2 * count + c % (2 * count)).ravel()  # noqa: E731
    faces = np.concatenate([np.stack([at(row, column), at(row + 1, column), at(row + 1, column + 1)], -1),
                            np.stack([at(row, column), at(row + 1, column + 1), at(row, column + 1)], -1)])
    return vertices, faces


def test_assets_die_before_scenes_and_scenes_before_arrays():
    arrays = []
    for number in range(5):
        scene = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES), tandem.build(BOX_VERTICES / 2, BOX_FACES).levels_from(0)], BODIES)
        gc.collect()
        found, manifolds = scene.contacts(), scene.manifolds()
        scene.place(BODIES[:20])
        distances, verdicts, impacts = scene.distances(), scene.verdicts(tolerance=0.1), scene.impacts(np.zeros(20, tandem.MOTION), 1.0)
        arrays.append([array for result in (found[:2], manifolds, distances, verdicts, impacts) for array in result])
        del scene, found, manifolds, distances, verdicts, impacts
        gc.collect()
    for array in zip(*arrays):
        for other in array[1:]:
            assert other.tobytes() == array[0].tobytes()
            other[:] = 0


def test_views_of_bytes_outlive_assets():
    asset = tandem.build(BOX_VERTICES, BOX_FACES)
    view, triangles, expected = asset.data, asset.triangles(), asset.triangles().copy()
    again = tandem.Asset.from_bytes(view)
    del asset
    gc.collect()
    assert bytes(view) == bytes(again) and (triangles == expected).all()


def test_threads_share_assets_and_have_scenes_of_their_own():
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    expected = tandem.Scene([box], BODIES).contacts().contacts.tobytes()
    same = []

    def ask(threads):
        scene = tandem.Scene([box], BODIES, threads=threads)
        same.extend(scene.contacts().contacts.tobytes() == expected for _ in range(5))

    workers = [threading.Thread(target=ask, args=(1 + number % 3,)) for number in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert same == [True] * 30


def test_a_scene_takes_one_call_at_a_time_while_other_threads_run():
    scene = tandem.Scene([tandem.build(BOX_VERTICES, BOX_FACES)], translation=np.random.default_rng(2).uniform(0, 3, (700, 3)))
    expected = len(scene.contacts().contacts)
    refused, found, done = [], [], threading.Event()

    def work():
        for _ in range(5):
            try:
                found.append(len(scene.contacts().contacts))
            except RuntimeError as error:
                refused.append(str(error))
        done.set()

    worker = threading.Thread(target=work)
    worker.start()
    while not done.is_set():  # runs only where calls let it
        try:
            found.append(len(scene.contacts(pairs=[[0, 1]]).contacts) * 0 + expected)
        except RuntimeError as error:
            refused.append(str(error))
    worker.join()
    assert set(refused) == {"another thread is in a call of this scene"}
    assert set(found) == {expected}


def test_arguments_may_change_during_a_call():
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    bodies = tandem.instances(translation=np.random.default_rng(3).uniform(0, 4, (500, 3)))
    expected = tandem.Scene([box], bodies).contacts().contacts.tobytes()
    results, start = [], threading.Barrier(2)

    def work():
        scene = tandem.Scene([box])
        start.wait()
        rows = bodies.copy()
        changing.append(rows)
        results.append(scene.place(rows).contacts().contacts.tobytes())

    changing = []
    worker = threading.Thread(target=work)
    worker.start()
    start.wait()
    while worker.is_alive():
        if changing and results:
            changing[0]["translation"] = np.nan
    worker.join()
    assert results == [expected]


def test_progress_ascends_and_comes_in_the_callers_thread():
    shares, threads = [], set()
    vertices, faces = sphere(16)

    def progress(share):
        shares.append(share)
        threads.add(threading.get_ident())

    asset = tandem.build(vertices, faces, effort="best", progress=progress)
    assert asset.levels[0].closed
    assert shares == sorted(shares) and len(shares) > 0 and 0 <= shares[0] and shares[-1] <= 1
    assert threads == {threading.get_ident()}


@pytest.mark.parametrize("effort", ["default", "best"])
def test_what_progress_raises_ends_the_build(effort):
    class Enough(Exception):
        pass

    def progress(share):
        raise Enough(share)

    vertices, faces = sphere(50 if effort == "best" else 400)
    with pytest.raises(Enough) as caught:
        tandem.build(vertices, faces, effort=effort, threads=1, progress=progress)
    assert 0 < caught.value.args[0] <= 1


@needs_alarm
@pytest.mark.parametrize("levels", [None, "auto"])
def test_ctrl_c_ends_a_long_build(levels):
    if levels:
        pytest.importorskip("tandem._bvhbuild")
    vertices, faces = sphere(120)  # which takes many seconds
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(KeyboardInterrupt):
            tandem.build(vertices, faces, effort="best", levels=levels)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)


@needs_alarm
@pytest.mark.parametrize("effort, levels", [("fast", None), ("default", None), ("default", ["4%"])])
def test_ctrl_c_ends_a_build_before_its_next_step(effort, levels):
    if levels:
        pytest.importorskip("tandem._bvhbuild")
    vertices, faces = sphere(280)
    start = time.process_time()
    tandem.build(vertices, faces, effort=effort)
    whole = time.process_time() - start
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.02)
    start = time.process_time()
    try:
        with pytest.raises(KeyboardInterrupt):
            tandem.build(vertices, faces, effort=effort, levels=levels)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    assert time.process_time() - start < 0.8 * whole


DAEMON = """
import threading, time
import numpy as np
import tandem
SETUP
def work():
    while True:
        WORK
threading.Thread(target=work, daemon=True).start()
time.sleep(0.5)
"""


@pytest.mark.parametrize("setup, work", [
    ("scene = tandem.Scene([tandem.build(np.random.rand(30, 3), np.arange(30).reshape(-1, 3))], translation=np.random.rand(40, 3))", "scene.contacts()"),
    ("", "tandem.build(np.random.rand(90000, 3), np.arange(90000).reshape(-1, 3), progress=lambda share: time.sleep(0.01))"),
    ("", "tandem.build(np.random.rand(90000, 3), np.arange(90000).reshape(-1, 3), levels=['1%'], effort='best', progress=lambda share: sum(range(10**6)))")])
def test_daemon_threads_in_a_call_let_the_process_end(setup, work):
    if "levels" in work:
        pytest.importorskip("tandem._bvhbuild")
    done = subprocess.run([sys.executable, "-c", DAEMON.replace("SETUP", setup).replace("WORK", work)], capture_output=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps a file that is mapped")
def test_files_may_be_replaced_while_they_are_mapped(tmp_path):
    path = tmp_path / "box.bvh"
    tandem.build(BOX_VERTICES, BOX_FACES).save(path)
    mapped = tandem.Asset.load(path)
    expected = bytes(mapped)
    tandem.build(BOX_VERTICES * 2, BOX_FACES).save(path)
    assert bytes(mapped) == expected != bytes(tandem.Asset.load(path))
