"""What the tests of tandem.view() know of pictures. A z-buffer (tests/common/z_buffer.py) says what ought to be there. Skips the test where nothing draws."""
import colorsys
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

SOURCE_DIR = pathlib.Path(os.environ["TANDEM_SOURCE_DIR"])
sys.path.append(os.fspath(SOURCE_DIR / "tests/common"))

pytest.importorskip("pyvista")
h5py = pytest.importorskip("h5py")
DRAWS = "import pyvista; plotter = pyvista.Plotter(off_screen=True); plotter.add_mesh(pyvista.Sphere()); plotter.screenshot()"
if subprocess.run([sys.executable, "-c", DRAWS], capture_output=True).returncode:
    pytest.skip("VTK cannot draw off screen here: it needs EGL or OSMesa (libegl1 libgl1-mesa-dri)", allow_module_level=True)

import tandem  # noqa: E402
import z_buffer  # noqa: E402
from meshes import BOX_FACES, BOX_VERTICES  # noqa: E402

SIZE = (320, 200)
RED = 0.99  # its hue, of 1
TURNED = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


@pytest.fixture(scope="module")
def box():
    return tandem.build(BOX_VERTICES, BOX_FACES)


def projected(view, points):
    """Points (..., 3) of the world: x and y in pixels, and the inverse of the distance."""
    camera = view.plotter.camera
    position, focus, up = (np.array(v) for v in (camera.position, camera.focal_point, camera.up))
    back = (position - focus) / np.linalg.norm(position - focus)
    right = np.cross(up, back)
    seen = (points - view.origin - position) @ np.array([right, np.cross(back, right), back]).T
    scale = SIZE[1] / 2 / np.tan(np.radians(camera.view_angle / 2))
    away = -seen[..., 2]
    return np.stack([SIZE[0] / 2 + scale * seen[..., 0] / away, SIZE[1] / 2 - scale * seen[..., 1] / away, 1 / away], -1)


def body_of_pixels(view, assets, instances):
    """What a z-buffer says each pixel shows: a row of instances, or -1."""
    posed = [assets[row["asset"]].triangles() @ row["rotation"].T + row["translation"] for row in instances]
    body = np.repeat(np.arange(len(posed)), [len(triangles) for triangles in posed])
    nearest = z_buffer.rasterise(projected(view, np.concatenate(posed)), SIZE)[1]
    return np.where(nearest < 0, -1, body[nearest])


def is_backdrop(picture):
    """Whether a pixel is as the backdrop is in the leftmost pixel of its row, which shows no body."""
    return np.abs(picture.astype(int) - picture[:, :1]).max(axis=2) <= 2


def hues(colours):
    """Hue and saturation of 8-bit colours, (..., 2)."""
    return np.array([colorsys.rgb_to_hsv(*(colour / 255))[:2] for colour in colours.reshape(-1, 3)]).reshape(*colours.shape[:-1], 2)


def hue_distance(a, b):
    return np.abs((a - b + 0.5) % 1 - 0.5)


def around(label):
    """Of each pixel what it and its eight neighbours show, (9, height, width)."""
    padded = np.pad(label, 1, mode="edge")
    return np.array([padded[y:y + label.shape[0], x:x + label.shape[1]] for y in range(3) for x in range(3)])


def inner(label):
    """Pixels whose neighbours show the same."""
    return (around(label) == label).all(axis=0)


def grown(mask):
    return around(mask).any(axis=0)


def write_run(path, box):
    """A run of two boxes that moves the second away along y: after 0, 5 and 10 steps."""
    box.save(path.parent / "box.bvh")
    with h5py.File(path, "w") as file:
        file["assets"] = ["box.bvh"]
        file["bodies/asset"], file["bodies/motion"] = np.zeros(2, "u4"), np.zeros(2, "u4")
        file["bodies/centre_of_mass"] = np.full((2, 3), 0.5)
        file["trajectory/frame"] = np.array([0, 5, 10], "u4")
        file["trajectory/position"] = np.array([[[0, 0, 0], [0, 0.9 + k, 0]] for k in range(3)], float)
        half = np.sqrt(0.5)
        file["trajectory/orientation"] = np.tile([[1.0, 0, 0, 0], [half, 0, 0, half]], (3, 1, 1))


def command(*arguments):
    return subprocess.run([sys.executable, "-m", "tandem", *map(os.fspath, arguments)], capture_output=True, text=True)
