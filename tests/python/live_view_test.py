"""tandem.view(world): what a world's window shows as the world goes on, its keys, and Ctrl-C."""
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

# Where nothing draws, this skips all that follows.
from pictures import RED, SIZE, body_of_pixels, box, command, h5py, hue_distance, hues, inner, is_backdrop, projected, write_run

import matplotlib
import matplotlib.image

import tandem
from meshes import BOX_FACES, BOX_VERTICES
from tandem import live_view, scene_files, viewer


FLOOR = 4 * (BOX_VERTICES - [0.5, 0.5, 1])


def falling(box, **options):
    """A box that falls on a floor, turning."""
    return tandem.World([tandem.build(FLOOR, BOX_FACES), box], asset=[0, 1], translation=[[0, 0, 0], [0, 0, 2.5]], angular_velocity=[[0, 0, 0], [1, 2, 3]],
                        filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]), **options)


def drawn_places(view):
    """Where the middles of the bodies' meshes are drawn, in the world."""
    places = np.empty((len(view.world.translation), 3))
    for row, mapper in enumerate(view._bodies):
        places[view._asset == row] = np.asarray(viewer.pyvista.wrap(mapper.GetInput()).points) + view.origin
    return places


def middles(world):
    return np.array([row["rotation"] @ np.mean(world.assets[row["asset"]].bounds, axis=0) + row["translation"] for row in world.instances])


@pytest.fixture
def live():
    views = []

    def make(world, **options):
        views.append(live_view.LiveView(world, off_screen=True, **{"size": SIZE, **options}))
        return views[-1]

    yield make
    for view in views:
        view.close()


def test_a_world_is_drawn_where_it_is_as_it_goes_on(live, box):
    view, beside = live(falling(box), dt=1 / 120), falling(box)
    seen = []
    for steps in (0, 1, 30, 60):
        view.step(steps)
        beside.step(1 / 120, steps)
        assert np.array_equal(view.world.instances, beside.instances)
        assert np.allclose(drawn_places(view), middles(beside), atol=1e-6)
        seen.append(view.picture())
        # The box and the floor are where a z-buffer puts them.
        expected = body_of_pixels(view, view.world.assets, view.world.instances)
        clear = inner(expected)
        clear[:30, :80] = False  # where the time is written
        drawn = ~is_backdrop(seen[-1])
        assert (expected == 1).sum() > 300 and drawn[clear & (expected >= 0)].all()
    assert all(not np.array_equal(one, other) for one, other in zip(seen, seen[1:]))
    view.world.push(1, [0, 0, 9000])
    beside.push(1, [0, 0, 9000])
    beside.step(1 / 60, 20)
    view.world.step(1 / 60, 20)  # by somebody else
    view.refresh()
    assert np.allclose(drawn_places(view), middles(beside), atol=1e-6)
    view.restart()
    assert view.world.time == 0 and np.allclose(drawn_places(view), middles(falling(box)), atol=1e-6)


def test_the_camera_follows_until_it_is_moved(live, box):
    world = falling(box)
    world.push(1, [4000, 0, 9000])
    for moved in (False, True):
        view = live(world)
        if moved:
            view.plotter.camera.position = np.array(view.plotter.camera.position) + 0.1
        before = tuple(view.plotter.camera.position)
        for _ in range(40):
            view.step()
            x, y, _ = projected(view, middles(view.world)[1])
            assert moved or (0 < x < SIZE[0] and 0 < y < SIZE[1])
        assert (tuple(view.plotter.camera.position) == before) == moved


def test_contacts_of_a_world_are_found_anew(live, box):
    view = live(falling(box), contacts=True)
    red = []
    for _ in range(3):
        saturated = hues(view.picture())
        red.append(((hue_distance(saturated[..., 0], RED) < 0.05) & (saturated[..., 1] > 0.6)).any())
        view.step(60)
    assert red == [False, True, True]


def test_a_picture_of_a_world_is_that_of_its_bodies(box):
    world = falling(box)
    world.step(1 / 60, 10)
    assert np.array_equal(tandem.view(world, off_screen=True, size=SIZE)[30:],
                          tandem.view(world.assets, world.instances, motion=world.motion, off_screen=True, size=SIZE)[30:])
    assert world.time == pytest.approx(1 / 6)


@pytest.mark.parametrize(("options", "text"), [({"dt": 0}, "dt is 0"), ({"dt": np.nan}, "dt is nan"), ({"step": 3}, "step 3: the run keeps")])
def test_arguments_of_a_living_view_are_named(box, options, text):
    with pytest.raises(ValueError, match=text):
        tandem.view(falling(box), off_screen=True, **options)
    found = tandem.Scene([box], translation=[[0, 0, 0]]).contacts()
    with pytest.raises(ValueError, match="contacts: what was found belongs to one state"):
        tandem.view(falling(box), off_screen=True, contacts=found)
    with pytest.raises(TypeError, match="dt"):
        tandem.view(box, off_screen=True, dt=1 / 60)
    with pytest.raises(ValueError, match="no body to show"):
        tandem.view(tandem.World([box]), off_screen=True)


@pytest.fixture
def falling_file(box, tmp_path):
    """A scene file of falling(), at half the density, with a velocity."""
    box.save(tmp_path / "box.bvh")
    tandem.build(FLOOR, BOX_FACES).save(tmp_path / "floor.bvh")
    with h5py.File(tmp_path / "scene.h5", "w") as file:
        file["assets"], file["instances/asset"] = ["floor.bvh", "box.bvh"], np.array([0, 1], "u4")
        file["instances/rotation"], file["instances/translation"] = np.stack([np.eye(3)] * 2), np.array([[0, 0, 0], [0, 0, 2.5]])
        file["simulation/motion"], file["simulation/density"] = np.array([1, 0], "u1"), np.full(2, 500.0)
        file["simulation/velocity"], file["simulation/angular_velocity"] = np.zeros((2, 3)), np.array([[0, 0, 0], [1.0, 2, 3]])
    return tmp_path / "scene.h5"


def test_a_world_of_a_scene_file(falling_file, box, tmp_path):
    world, same = scene_files.world(falling_file, friction=0.2), falling(box, density=500, friction=0.2)
    assert world.mass == pytest.approx([0, 500]) and world.motion.tolist() == [tandem.FIXED, tandem.MOVING]
    world.step(1 / 60, 60)
    same.step(1 / 60, 60)
    assert np.array_equal(world.instances, same.instances)
    for name, text in (("box.bvh", "is an asset"), ("run.h5", "is a run; bvhbench frame makes")):
        if name == "run.h5":
            write_run(tmp_path / name, box)
        with pytest.raises(ValueError, match=f"{name}: {text}"):
            scene_files.world(tmp_path / name)


def test_the_command_simulates(falling_file, box, tmp_path):
    result = command("view", falling_file, "--simulate", "--dt", "1/120", "--step", "70", "--width", "320", "--height", "200", "-o", tmp_path / "a.png")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    world = falling(box, density=500)
    world.step(1 / 120, 70)
    written = (matplotlib.image.imread(tmp_path / "a.png")[..., :3] * 255).round().astype(np.uint8)
    assert np.array_equal(written, tandem.view(world, off_screen=True, size=SIZE))
    for arguments, code, text in ((["--dt", "1/60"], 2, "--dt belongs to --simulate"), (["--simulate", "--dt", "0"], 2, "dt is 0"),
                                  (["--simulate", "--dt", "1/0"], 1, "invalid seconds value"), (["--simulate", "--step", "-1"], 2, "steps is -1")):
        result = command("view", falling_file, *arguments, "-o", tmp_path / "b.png")
        assert result.returncode == code and text in result.stderr and result.stderr.count("\n") == 1


@pytest.fixture
def display(monkeypatch):
    """A display that nobody sees. It stays as it is when a program that looked at it has gone: the next one would find none for a moment."""
    if shutil.which("Xvfb") is None:
        pytest.skip("a window needs Xvfb here")
    reading, writing = os.pipe()
    with subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-screen", "0", "800x600x24", "-nolisten", "tcp", "-noreset"], pass_fds=[writing], stderr=subprocess.DEVNULL) as server:
        os.close(writing)
        with os.fdopen(reading) as number:
            monkeypatch.setenv("DISPLAY", ":" + number.readline().strip())
        yield
        server.terminate()


KEYS = """
import sys
import tandem
from tandem import live_view, scene_files

told = []

class Watched(live_view.LiveView):
    pictures = 0

    def _look_after(self, due):
        self.pictures += 1
        key = {10: "space", 15: "Right", 16: "Right", 20: "Home", 25: "space", 30: "q"}.get(self.pictures)
        if key:
            keys = self.plotter.iren.interactor
            keys.SetKeySym(key)
            keys.InvokeEvent("KeyPressEvent")
            if key == "q":
                keys.SetKeyCode("q")
                keys.InvokeEvent("CharEvent")
        told.append(round(self.world.time * 60))
        super()._look_after(due)

live_view.LiveView = Watched
tandem.view(scene_files.world(sys.argv[1]), size=(320, 200))
print(told)
"""


def test_keys_of_the_window(falling_file, display):
    result = subprocess.run([sys.executable, "-c", KEYS, falling_file], capture_output=True, text=True, timeout=120)
    assert (result.returncode, result.stderr) == (0, "")
    assert json.loads(result.stdout) == [*range(1, 11), 10, 10, 10, 10, 11, 12, 12, 12, 12, *6 * [0], *range(1, 6)]


CTRL_C = """
import os
import signal
import sys
from tandem import __main__, live_view

class Watched(live_view.LiveView):
    def _look_after(self, due):
        if self.world.time > 0.1:
            os.kill(os.getpid(), signal.SIGINT)
        super()._look_after(due)

live_view.LiveView = Watched
sys.exit(__main__.main(["view", sys.argv[1], "--simulate"]))
"""


def test_ctrl_c_shuts_the_window(falling_file, display):
    result = subprocess.run([sys.executable, "-c", CTRL_C, falling_file], capture_output=True, text=True, timeout=120)
    assert (result.returncode, result.stdout, result.stderr) == (130, "", "")
